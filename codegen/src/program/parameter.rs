//! The program of a run-time parameter's constructor.

use crate::equations::bind::constructed;
use crate::equations::Robot;
use crate::options::Options;
use crate::program::equivalence::{self, Disagreement};
use crate::program::passed;
use crate::scene::Parameter;
use straightline_graph::expr::{Graph, Port};
use straightline_graph::pass::dead_code;
use straightline_graph::trace::trace;

/// The program of a parameter's constructor: from mass \[kg\], centre of mass \[m\] and inertia about it \[kg·m²\] (xx, xy, xz,
/// yy, yz, zz) in the parameter's frame, or from the free numbers of a drive, to the scalars that the functions take.
pub fn parameter_program(robot: &Robot, parameter: &Parameter, options: &Options) -> Graph {
    let outputs = vec![Port::new("parameters", &[parameter.scalars(&robot.model)])];
    let name = parameter.input_name();
    let traced = trace(options.rules(), parameter.given(), outputs, |x| constructed(robot, parameter, x));
    passed("parameter: dead code", &name, dead_code(&passed("parameter: traced", &name, traced)))
}

/// The same, if it makes what the functions take.
///
/// # Errors
/// If it does not.
pub(crate) fn checked_parameter(
    robot: &Robot,
    parameter: &Parameter,
    options: &Options,
) -> Result<Graph, Disagreement> {
    let graph = parameter_program(robot, parameter, options);
    equivalence::of_parameter(robot, parameter, options, &graph).map(|()| graph)
}
