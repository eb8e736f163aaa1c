//! Functions in fixed point: their boxes, their programs, and the check of these.
//!
//! Points, errors and the absence of overflow follow from ranges over the box of inputs, so every input needs one: of the robot file's limits or
//! the scene's ranges; no defaults are taken. After all that the words are run at random states and corners of the box, in 64 bits, beside the
//! graph in double-double: no word may leave 32 bits, no result its certified bound.

use super::companion::ROUNDED;
use super::input_box::input_box;
use super::TracedProgram;
use crate::choices::FixedProducts;
use crate::diagnostic::{Diagnostic, Diagnostics};
use crate::equations::Robot;
use crate::function::{Function, Quantity};
use crate::options::Options;
use crate::scene::messages as say;
use straightline_core::random::Random;
use straightline_core::Dd;
use straightline_graph::certify::{box_in_words, Interval};
use straightline_graph::element;
use straightline_graph::expr::{evaluate, Graph, Op};
use straightline_graph::fixed::{fixed, FixedDemand, FixedProgram, NoFixedForm};

/// So many states a program is run at.
const STATES: usize = 60;

/// A function in fixed point.
#[derive(Clone, Debug)]
pub struct FixedFunction {
    /// What it computes.
    pub function: Function,
    /// The same over real numbers.
    pub graph: Graph,
    /// Its words.
    pub program: FixedProgram,
    /// The ranges of its inputs.
    pub inputs: Vec<Interval>,
}

impl FixedFunction {
    /// The ranges of its inputs in words, a line each.
    pub fn ranges(&self) -> Vec<String> {
        box_in_words(&self.graph.inputs, &self.inputs)
    }
}

/// All functions in fixed point, where that is asked for; of what has none it is said why.
pub(crate) fn fixed_functions(
    robot: &Robot,
    programs: &[TracedProgram],
    options: &Options,
    diagnostics: &mut Diagnostics,
) -> Vec<FixedFunction> {
    let Some(products) = options.fixed else { return Vec::new() };
    let demand = FixedDemand { wide: products == FixedProducts::Wide, error: options.fixed_error };
    let mut all = Vec::new();
    for program in programs {
        let name = program.function.name();
        let made = match program.has_folded_constants(options) {
            true => input_ranges(&program.graph, robot, options)
                .map_err(|(port, what)| Box::new(say::fixed_range_missing(name, &port, &what)))
                .and_then(|inputs| of_program(program, inputs, demand)),
            false => Err(Box::new(say::fixed_impossible(name, ROUNDED, "leave out `rules`"))),
        };
        match made {
            Ok(made) => all.push(made),
            Err(complaint) => options.scene.places.complain("options.fixed", *complaint, diagnostics),
        }
    }
    all
}

/// The range of every input, by default where it is not read; or an input that has none, and what of it.
fn input_ranges(graph: &Graph, robot: &Robot, options: &Options) -> Result<Vec<Interval>, (String, String)> {
    let reads = |k: usize| graph.ops.contains(&Op::Input(k as u32));
    let mut first = 0;
    for port in &graph.inputs {
        let ranges = options.scene.input_ranges(port, &robot.model);
        if let Some(k) = (0..port.len()).find(|k| !ranges[*k].is_bounded() && reads(first + k)) {
            let is_configuration = Quantity::of(port).is_some_and(Quantity::is_configuration);
            let of_joint = |j: &&straightline_core::model::Joint| match is_configuration {
                true => (j.iq..j.iq + j.kind.nq()).contains(&k),
                false => (j.iv..j.iv + j.kind.nv()).contains(&k),
            };
            let joints = robot.model.joints();
            let joint =
                joints.iter().find(|j| of_joint(j)).filter(|_| port.wrapper.is_none() && port.name != "gravity");
            let of = joint.map(|joint| format!(" of `{}`", joint.name)).unwrap_or_default();
            return Err((port.name.clone(), format!("{}{of}", element(port, k))));
        }
        first += port.len();
    }
    let missing = |_| (String::new(), "an input".to_string());
    input_box(&graph.inputs, &options.scene, &robot.model).map_err(missing)
}

fn of_program(
    program: &TracedProgram,
    inputs: Vec<Interval>,
    demand: FixedDemand,
) -> Result<FixedFunction, Box<Diagnostic>> {
    let name = program.function.name();
    // in one format; rows of limbs are no matter of words
    let graph = Graph { formats: Vec::new(), alike: Vec::new(), ..program.graph.clone() };
    let refusal = |refused| match refused {
        NoFixedForm::Operation(what) => say::fixed_impossible(
            name,
            &format!("it {what}, and words have no such operation"),
            "choose other functions",
        ),
        NoFixedForm::Ranges(why) => say::fixed_impossible(name, why.words(), "narrow the ranges of its inputs"),
        NoFixedForm::Angle => {
            say::fixed_impossible(name, "an angle is too far from zero", "narrow the ranges of its angles")
        }
        NoFixedForm::Error(least) => say::fixed_error(name, demand.error, least),
    };
    let made = fixed(&graph, &inputs, demand).map_err(|refused| Box::new(refusal(refused)))?;
    let made = FixedFunction { function: program.function, graph, program: made, inputs };
    check(&made).map_err(|what| say::fixed_disagrees(name, &what))?;
    Ok(made)
}

/// Runs the words beside the graph.
///
/// # Errors
/// Where a word leaves 32 bits, or a result its bound.
pub fn check(made: &FixedFunction) -> Result<(), String> {
    let FixedFunction { graph, program, inputs, .. } = made;
    let mut random = Random(0x243f_6a88_85a3_08d3);
    for state in 0..STATES {
        let mut place = |r: &Interval| match state % 3 {
            0 => [r.lo, r.hi][random.below(2)],
            _ => (r.lo + (r.hi - r.lo) * random.unit()).clamp(r.lo, r.hi),
        };
        let x: Vec<f64> = inputs.iter().map(&mut place).collect();
        let results = program.words.run(&program.words_of(&x));
        let results = results.map_err(|over| format!("word {} overflows: {} at {x:?}", over.word.0, over.value))?;
        let truth = evaluate::<Dd>(graph, &x.iter().map(|x| Dd::from(*x)).collect::<Vec<_>>());
        let found = program.numbers_of(&results);
        for (k, (found, truth)) in found.iter().zip(truth).enumerate() {
            let error = (Dd::from(*found) - truth).to_f64().abs();
            let bound = program.errors[k];
            if error.is_nan() || error > bound {
                return Err(format!("result {k} is off by {error:e}, certified are {bound:e}, at {x:?}"));
            }
        }
    }
    Ok(())
}
