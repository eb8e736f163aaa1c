//! The types of run-time parameters, before they are text.

use super::module::{ParameterOf, ParameterType};
use super::Lowering;
use crate::equations::Robot;
use crate::options::Options;
use crate::program::equivalence::Disagreement;
use crate::program::parameter::checked_parameter;
use crate::program::written::{DriveNumbers, WrittenFunction, WrittenParameter};
use crate::scene::free_drive::FreeDrive;
use crate::scene::Parameter;
use straightline_graph::schedule::schedule;

/// The types of those run-time parameters that something takes, and their programs.
///
/// # Errors
/// A constructor that differs from its plain equations.
pub(super) fn parameter_types(
    robot: &Robot,
    options: &Options,
    takes: &dyn Fn(&Parameter) -> bool,
    lowering: Lowering<'_>,
) -> Result<(Vec<ParameterType>, Vec<WrittenParameter>), Disagreement> {
    let lowering = Lowering { title: &|_| String::new(), ..lowering };
    let parameters = options.scene.parameters.iter().filter(|p| p.is_of(&robot.model) && takes(p));
    let (mut types, mut written) = (Vec::new(), Vec::new());
    for p in parameters {
        let graph = checked_parameter(robot, p, options)?;
        let (type_name, input) = (p.type_name(), p.input_name());
        let drive = FreeDrive::new(p, &robot.model);
        let doc = match &drive {
            None => "The parameters about the origins, and in the axes, of the frames that the equations use.",
            Some(_) => "The numbers of the drive that the equations use.",
        };
        let private = format!("{input}_parameters");
        let constructor = lowering
            .routine(&graph, &schedule(&graph, options.limits, options.schedule_machine().as_ref()), &private, doc)
            .private();
        let program = WrittenFunction::plain(&private, graph, options.scalar);
        let of = match drive {
            None => ParameterOf::Body(p.frame().unwrap_or_default().to_string()),
            Some(drive) => {
                let numbers = DriveNumbers { nominal: drive.values(&drive.nominal()), numbers: drive.numbers };
                ParameterOf::Drive(p.name().to_string(), numbers)
            }
        };
        let numbers = match &of {
            ParameterOf::Body(_) => None,
            ParameterOf::Drive(_, numbers) => Some(numbers.clone()),
        };
        written.push(WrittenParameter { type_name: type_name.clone(), program, numbers });
        types.push(ParameterType { name: type_name, input, scalars: p.scalars(&robot.model), constructor, of });
    }
    Ok((types, written))
}
