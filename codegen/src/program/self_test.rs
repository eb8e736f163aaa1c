//! What tests the functions of a file on a machine: states that are drawn there, and the hashes of all results at them.
//!
//! Inputs take no space: they are drawn by a linear congruential generator into the ranges of the scene and the limits of the robot file,
//! in the scalar that is generated, by operations that are the same on all machines. The results to expect are those of the interpreter
//! (`computed_at`), which shares nothing with a compiler for the machine.

use super::input_box::input_box;
use super::written::{AllWritten, WrittenFunction, WrittenParameter};
use crate::diagnostic::fnv_1a;
use crate::function::Quantity;
use crate::model::states::BODY;
use crate::scene::Scene;
use straightline_core::model::Model;
use straightline_core::Dd;
use straightline_graph::certify::search::computed_at;
use straightline_graph::expr::{Graph, Port};
use straightline_graph::{in_scalar, Scalar};

/// At so many states functions are run.
pub const STATES: u32 = 8;
/// What neither the scene nor the robot file limits, and has no [box](super::input_box), is drawn within ± so much.
const BOUND: f64 = 1.0;
/// Multiplier and increment modulo 2³² (Knuth; Numerical Recipes, `ranqd1`), and the first number.
pub const GENERATOR: [u32; 3] = [1_664_525, 1_013_904_223, 2_463_534_242];
/// So many bits of a number are used, the upper ones: as many as a significand of every scalar has.
pub const BITS: u32 = 24;

/// What tests the functions of a file.
#[derive(Clone, Debug)]
pub struct SelfTest {
    /// The ranges of inputs, each once.
    pub ranges: Vec<DrawnRanges>,
    /// The functions, in the order of [`AllWritten::asked_for`].
    pub functions: Vec<TestedFunction>,
}

/// The ranges of an input: least value and width of each number, in the scalar; one pair where all are alike.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawnRanges {
    /// The name of the constant that holds them.
    pub name: String,
    /// Least value and width.
    pub pairs: Vec<[f64; 2]>,
}

/// A function that is tested.
#[derive(Clone, Debug)]
pub struct TestedFunction {
    /// The module of its contact mode.
    pub mode: Option<String>,
    /// Its name.
    pub name: String,
    /// Its inputs, and how each is made.
    pub inputs: Vec<(Port, TestedInput)>,
    /// Its outputs.
    pub outputs: Vec<Port>,
    /// The hash of its results.
    pub hash: u64,
}

/// How an input is made.
#[derive(Clone, Debug, PartialEq)]
pub enum TestedInput {
    /// By drawing in these ranges, by their place; three numbers each become the quaternion that begins there.
    Drawn {
        /// The place of the ranges.
        ranges: usize,
        /// Where quaternions begin.
        quaternions: Vec<usize>,
    },
    /// These numbers at every state: a run-time parameter.
    Given(Vec<f64>),
}

impl TestedFunction {
    /// Its path in the file.
    pub fn path(&self) -> String {
        match &self.mode {
            Some(mode) => format!("contact::{mode}::{}", self.name),
            None => self.name.clone(),
        }
    }

    /// The name of the function that runs it.
    pub fn runner(&self) -> String {
        self.path().replace("::", "_")
    }
}

impl SelfTest {
    /// What tests these functions.
    pub(crate) fn new(written: &AllWritten, scene: &Scene, model: &Model<Dd>, scalar: Scalar) -> SelfTest {
        let mut ranges = Vec::new();
        let functions = written.asked_for().map(|(mode, function)| {
            let WrittenFunction { name, graph, .. } = function;
            let input = |port: &Port| match &port.wrapper {
                Some(wrapper) => TestedInput::Given(given(&written.parameters, wrapper, scalar)),
                None => drawn(port, (scene, model, scalar), &mut ranges),
            };
            let made: Vec<TestedInput> = graph.inputs.iter().map(input).collect();
            TestedFunction {
                mode: mode.map(str::to_string),
                name: name.clone(),
                inputs: graph.inputs.iter().cloned().zip(made).collect(),
                outputs: graph.outputs.clone(),
                hash: 0,
            }
        });
        let functions = functions.collect();
        let mut made = SelfTest { ranges, functions };
        let hashes: Vec<u64> = written
            .asked_for()
            .zip(&made.functions)
            .map(|((_, f), t)| made.hash(&f.graph, t, scalar, STATES))
            .collect();
        made.functions.iter_mut().zip(hashes).for_each(|(function, hash)| function.hash = hash);
        made
    }

    /// The hash of a function's results at the first so many states.
    pub fn hash(&self, graph: &Graph, function: &TestedFunction, scalar: Scalar, states: u32) -> u64 {
        let states = self.states(function, scalar, states);
        let results = states.flat_map(|inputs| computed_at(graph, scalar, &inputs));
        fnv_1a(results.flat_map(|x| bytes_of(x, scalar)))
    }

    /// The inputs of a function at the first so many states.
    pub fn states<'a>(
        &'a self,
        function: &'a TestedFunction,
        scalar: Scalar,
        states: u32,
    ) -> impl Iterator<Item = Vec<f64>> + 'a {
        let mut random = GENERATOR[2];
        // before the first state arrays are filled with a number
        next(&mut random);
        (0..states).map(move |_| {
            let mut values = |(port, made): &(Port, TestedInput)| self.values(port, made, scalar, &mut random);
            function.inputs.iter().flat_map(&mut values).collect()
        })
    }

    /// The numbers of an input at the next state.
    fn values(&self, port: &Port, made: &TestedInput, scalar: Scalar, random: &mut u32) -> Vec<f64> {
        let (ranges, quaternions) = match made {
            TestedInput::Given(numbers) => return numbers.clone(),
            TestedInput::Drawn { ranges, quaternions } => (&self.ranges[*ranges].pairs, quaternions),
        };
        in_scalar!(scalar, T => {
            let place = |[least, width]: &[f64; 2]| *least as T + *width as T * next(random) as T;
            let mut values: Vec<T> = ranges.iter().cycle().take(port.len()).map(place).collect();
            for k in quaternions {
                let [x, y, z] = [values[*k], values[k + 1], values[k + 2]];
                // stereographic projection: of any three numbers a unit quaternion, of all three all but one
                let s = x * x + y * y + z * z;
                let scale = 1.0 / (1.0 + s);
                values[*k..k + 4].copy_from_slice(&[2.0 * x * scale, 2.0 * y * scale, 2.0 * z * scale, (1.0 - s) * scale]);
            }
            values.into_iter().map(f64::from).collect()
        })
    }
}

/// The next number in [0, 1).
fn next(random: &mut u32) -> f64 {
    *random = random.wrapping_mul(GENERATOR[0]).wrapping_add(GENERATOR[1]);
    f64::from(*random >> (u32::BITS - BITS)) / f64::from(1u32 << BITS)
}

/// The bytes of a number, least first; NaN is one number.
fn bytes_of(x: f64, scalar: Scalar) -> Vec<u8> {
    in_scalar!(scalar, T => {
        let x = x as T;
        if x.is_nan() { T::NAN } else { x }.to_bits().to_le_bytes().to_vec()
    })
}

/// How an input is drawn; its ranges are added where they are others than those that are there.
fn drawn(
    port: &Port,
    (scene, model, scalar): (&Scene, &Model<Dd>, Scalar),
    ranges: &mut Vec<DrawnRanges>,
) -> TestedInput {
    let found = input_box(std::slice::from_ref(port), scene, model);
    let pair = |[least, most]: [f64; 2]| [scalar.rounded(least), scalar.rounded(most - least)];
    let mut pairs: Vec<[f64; 2]> = match found {
        Ok(found) => found.iter().map(|range| pair([range.lo, range.hi])).collect(),
        Err(_) => vec![pair([-BOUND, BOUND])],
    };
    let is_configuration = Quantity::of(port).is_some_and(Quantity::is_configuration);
    let joints = model.free_joints().filter(|_| is_configuration);
    let quaternions = joints.filter_map(|joint| Some(joint.iq + joint.kind.row().quaternion?)).collect();
    if pairs.iter().all(|pair| *pair == pairs[0]) {
        pairs.truncate(1);
    }
    let known = ranges.iter().position(|of| of.pairs == pairs).unwrap_or_else(|| {
        let upper = port.name.to_uppercase();
        let same =
            ranges.iter().filter(|of| of.name.trim_end_matches(|c: char| c == '_' || c.is_ascii_digit()) == upper);
        let name = match same.count() {
            0 => upper,
            n => format!("{upper}_{n}"),
        };
        ranges.push(DrawnRanges { name, pairs });
        ranges.len() - 1
    });
    TestedInput::Drawn { ranges: known, quaternions }
}

/// The numbers of a run-time parameter: of a drive those of the robot file, of a load those of a body that may be.
fn given(parameters: &[WrittenParameter], type_name: &str, scalar: Scalar) -> Vec<f64> {
    let parameter = parameters.iter().find(|p| p.type_name == type_name).expect("what functions take is written");
    match &parameter.numbers {
        Some(numbers) => numbers.nominal.iter().map(|x| scalar.nearest(*x)).collect(),
        None => {
            let body: Vec<f64> = BODY.iter().map(|x| scalar.rounded(*x)).collect();
            computed_at(&parameter.program.graph, scalar, &body)
        }
    }
}
