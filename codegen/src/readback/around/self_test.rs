//! The functions `self_test` and `self_test_hashes`, and their module: every word, and the hashes by an evaluation of its own.

use super::{Around, BlockReading};
use crate::program::self_test::{SelfTest, TestedFunction, TestedInput};
use crate::readback::items::Sort;
use straightline_graph::expr::{evaluate, Graph};
use straightline_graph::in_scalar;

impl Around<'_, '_, '_> {
    /// The self-test, where one is asked for.
    pub(super) fn self_test(&mut self) -> BlockReading<()> {
        let generated = self.generated;
        let Some(test) = &generated.programs.self_test else { return Ok(()) };
        let (root, s, n) = (self.root, self.scalar().name(), test.functions.len());
        let text = "pub fn self_test() -> Result<(), &'static str> {
            let found = self_test_hashes(8);
            for ((function, hash), expected) in found.iter().zip(&self_tests::EXPECTED) {
                if hash != expected { return Err(function); }
            }
            Ok(())
        }";
        self.is(root, Sort::Function, "self_test", text)?;
        let calls = test.functions.iter().map(|f| format!("({:?}, self_tests::{}(states)),", f.path(), f.runner()));
        let calls: String = calls.collect();
        let text = format!("pub fn self_test_hashes(states: u32) -> [(&'static str, u64); {n}] {{ [{calls}] }}");
        self.is(root, Sort::Function, "self_test_hashes", &text)?;
        let module = self.module(root, "self_tests")?;
        let programs = generated.programs.asked_for().map(|(_, program)| program);
        let hashes = programs.zip(&test.functions).map(|(program, function)| {
            let made = match program.graph.formats.is_empty() {
                true => self.hash(test, function, &program.graph),
                // more than one format: the interpreter's
                false => test.hash(&program.graph, function, self.scalar(), 8),
            };
            format!("{made:#018x}")
        });
        let text = format!("pub const EXPECTED: [u64; {n}] = [{}];", hashes.collect::<Vec<_>>().join(", "));
        self.is(module, Sort::Constant, "EXPECTED", &text)?;
        for ranges in &test.ranges {
            let pair = |[least, width]: &[f64; 2]| {
                format!("[{}, {}]", self.scalar().literal(*least), self.scalar().literal(*width))
            };
            let pairs = ranges.pairs.iter().map(pair).collect::<Vec<_>>().join(", ");
            let text = format!("const {}: [[{s}; 2]; {}] = [{pairs}];", ranges.name, ranges.pairs.len());
            self.is(module, Sort::Constant, &ranges.name, &text)?;
        }
        let bytes = self.scalar().bytes().to_string();
        for (name, text) in HELPERS {
            self.is(module, Sort::Function, name, &text.replace("{s}", s).replace("{bytes}", &bytes))?;
        }
        for function in &test.functions {
            let text = self.runner(test, function);
            self.is(module, Sort::Function, &function.runner(), &text)?;
        }
        Ok(())
    }

    /// What is to run a function.
    fn runner(&self, test: &SelfTest, function: &TestedFunction) -> String {
        let s = self.scalar().name();
        let (mut types, mut arguments, mut arrays, mut draws) =
            ([String::new(), String::new()], vec![], vec![], vec![]);
        let mut matrices = [String::new(), String::new()];
        let inputs = function.inputs.iter().map(|(port, made)| (port, Some(made)));
        for (port, made) in inputs.chain(function.outputs.iter().map(|port| (port, None))) {
            let (name, reference) = (&port.name, if made.is_some() { "&" } else { "&mut " });
            if let Some(TestedInput::Given(numbers)) = made {
                let wrapper = port.wrapper.as_deref().unwrap_or_default();
                let numbers: Vec<String> = numbers.iter().map(|x| self.scalar().literal(*x)).collect();
                types[0] += &format!("&super::{wrapper}, ");
                arguments.push(format!("&super::{wrapper}([{}])", numbers.join(", ")));
                continue;
            }
            let array = port.shape.iter().rev().fold(s.to_string(), |inner, n| format!("[{inner}; {n}]"));
            types[usize::from(made.is_none())] += &format!("{reference}{array}, ");
            arrays.push(format!("let mut {name} = [first; {}];", port.len()));
            if let Some(TestedInput::Drawn { ranges, quaternions }) = made {
                draws.push(format!("draw(&mut random, &{}, &mut {name});", test.ranges[*ranges].name));
                draws.extend(quaternions.iter().map(|k| {
                    let three = format!("{name}[{k}], {name}[{}], {name}[{}]", k + 1, k + 2);
                    format!("[{three}, {name}[{}]] = quaternion({three});", k + 3)
                }));
            }
            if port.shape.len() == 1 {
                arguments.push(format!("{reference}{name}"));
                continue;
            }
            let method = if made.is_some() { "as_chunks" } else { "as_chunks_mut" };
            let chunks: String = port.shape[1..].iter().rev().map(|n| format!(".{method}::<{n}>().0")).collect();
            matrices[0] += &format!("Ok({name}), ");
            matrices[1] += &format!("{name}{chunks}.try_into(), ");
            arguments.push(name.clone());
        }
        let mut call = format!("function({});", arguments.join(", "));
        if !matrices[0].is_empty() {
            call = format!("if let ({}) = ({}) {{ {call} }}", matrices[0], matrices[1]);
        }
        let hashes: String = function.outputs.iter().map(|p| format!("hash = hashed(hash, &{});", p.name)).collect();
        let types = types.concat();
        format!(
            "pub fn {}(states: u32) -> u64 {{
                let function = core::hint::black_box::<fn({})>(super::{});
                let mut random = core::hint::black_box(2463534242);
                let first = next(&mut random);
                {}
                let mut hash = 0xcbf29ce484222325;
                for _ in 0..states {{ {} {call} {hashes} }}
                hash
            }}",
            function.runner(),
            types.trim_end_matches(", "),
            function.path(),
            arrays.concat(),
            draws.concat(),
        )
    }

    /// The hash that the text above makes, computed as it says.
    fn hash(&self, test: &SelfTest, function: &TestedFunction, graph: &Graph) -> u64 {
        in_scalar!(self.scalar(), T => {
            let mut state = 2_463_534_242_u32;
            let mut next = || {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (state / 256) as T / 16_777_216.0
            };
            let mut hash = 0xcbf2_9ce4_8422_2325_u64;
            next();
            for _ in 0..8 {
                let mut inputs: Vec<T> = Vec::new();
                for (port, made) in &function.inputs {
                    let start = inputs.len();
                    match made {
                        TestedInput::Given(numbers) => inputs.extend(numbers.iter().map(|x| *x as T)),
                        TestedInput::Drawn { ranges, quaternions } => {
                            let pairs = &test.ranges[*ranges].pairs;
                            for k in 0..port.len() {
                                let [least, width] = pairs[k % pairs.len()].map(|x| x as T);
                                inputs.push(least + width * next());
                            }
                            for k in quaternions.iter().map(|k| start + k) {
                                let [x, y, z] = [inputs[k], inputs[k + 1], inputs[k + 2]];
                                let s = x * x + y * y + z * z;
                                let scale = 1.0 / (1.0 + s);
                                let values = [2.0 * x * scale, 2.0 * y * scale, 2.0 * z * scale, (1.0 - s) * scale];
                                inputs[k..k + 4].copy_from_slice(&values);
                            }
                        }
                    }
                }
                for x in evaluate(graph, &inputs) {
                    let bits = if x.is_nan() { T::NAN.to_bits() } else { x.to_bits() };
                    for byte in 0..size_of::<T>() {
                        hash = (hash ^ u64::from((bits >> (8 * byte)) as u8)).wrapping_mul(0x0100_0000_01b3);
                    }
                }
            }
            hash
        })
    }
}

/// What all runners call.
const HELPERS: [(&str, &str); 4] = [
    (
        "next",
        "fn next(random: &mut u32) -> {s} {
            *random = random.wrapping_mul(1664525).wrapping_add(1013904223);
            (*random >> 8) as {s} / 16777216.0
        }",
    ),
    (
        "draw",
        "fn draw(random: &mut u32, ranges: &[[{s}; 2]], numbers: &mut [{s}]) {
            for (number, [least, width]) in numbers.iter_mut().zip(ranges.iter().cycle()) {
                *number = least + width * next(random);
            }
        }",
    ),
    (
        "quaternion",
        "fn quaternion(x: {s}, y: {s}, z: {s}) -> [{s}; 4] {
            let s = x * x + y * y + z * z;
            let scale = 1.0 / (1.0 + s);
            [2.0 * x * scale, 2.0 * y * scale, 2.0 * z * scale, (1.0 - s) * scale]
        }",
    ),
    (
        "hashed",
        "fn hashed(mut hash: u64, numbers: &[{s}]) -> u64 {
            for number in numbers {
                let mut bits = if number.is_nan() { {s}::NAN } else { *number }.to_bits();
                for _ in 0..{bytes} {
                    hash = (hash ^ (bits & 0xff) as u64).wrapping_mul(0x100000001b3);
                    bits >>= 8;
                }
            }
            hash
        }",
    ),
];
