//! The functions `self_test` and `self_test_hashes`, and the module of what they are made of.

use super::associated::of_self;
use super::{array_type, doc, indented, wrapped};
use crate::emit::{Generated, Style};
use crate::program::self_test::{SelfTest, TestedFunction, TestedInput, BITS, GENERATOR, STATES};
use std::fmt::Write;
use straightline_graph::expr::Port;
use straightline_graph::Scalar;

/// The functions and the module; nothing where nobody asked for them.
pub(super) fn text(generated: &Generated) -> Option<String> {
    let test = generated.programs.self_test.as_ref()?;
    let [of_test, of_hashes] = docs(generated, test);
    let count = test.functions.len();
    let mut out = format!(
        "\n{of_test}pub fn self_test() -> Result<(), &'static str> {{\n    let found = self_test_hashes({STATES});\n    \
         for ((function, hash), expected) in found.iter().zip(&self_tests::EXPECTED) {{\n        if hash != expected {{\n            \
         return Err(function);\n        }}\n    }}\n    Ok(())\n}}\n\n{of_hashes}pub fn self_test_hashes(states: u32) -> {} {{\n    [\n",
        hashes_type(count)
    );
    for function in &test.functions {
        let _ = writeln!(out, "        ({:?}, self_tests::{}(states)),", function.path(), function.runner());
    }
    let _ = write!(
        out,
        "    ]\n}}\n\n/// What [`self_test`] is made of.\n#[allow(dead_code, clippy::all, clippy::pedantic)]\nmod self_tests {{\n{}}}\n",
        indented(&module(test, generated.scalar))
    );
    Some(out)
}

/// Both functions as associated ones of a type.
pub(super) fn associated(generated: &Generated) -> Option<String> {
    let test = generated.programs.self_test.as_ref()?;
    let [of_test, of_hashes] = docs(generated, test).map(|text| of_self(&text));
    let hashes = hashes_type(test.functions.len());
    Some(format!(
        "{of_test}pub fn self_test() -> Result<(), &'static str> {{\n    dynamics::self_test()\n}}\n\
         {of_hashes}pub fn self_test_hashes(states: u32) -> {hashes} {{\n    dynamics::self_test_hashes(states)\n}}\n"
    ))
}

fn hashes_type(count: usize) -> String {
    format!("[(&'static str, u64); {count}]")
}

/// What stands above the functions.
fn docs(generated: &Generated, test: &SelfTest) -> [String; 2] {
    let mut of_test = format!(
        "Runs every function of one state, also of contact modes, at {STATES} states on this machine, and compares the bits of all results with \
         those that the compiler computed without this machine's instructions, libraries and settings.\n\nStates are drawn within the \
         ranges of the inputs. Of the results a hash is kept, so that a function of any size takes 8 bytes: FNV-1a in 64 bits over \
         the bytes of the numbers, least first, in the order of outputs; any NaN is the same. Bits differ where a·b + c is rounded once, where numbers \
         below the normal ones are taken as zero, or where rounding is not to nearest.\n\nNot run: functions over lanes and batches, stages, bounds of \
         errors, and constructors of run-time parameters"
    );
    let parameters = &generated.programs.parameters;
    match parameters.is_empty() {
        true => of_test.push('.'),
        false => {
            let names = parameters.iter().map(|p| format!("`{}`", p.type_name)).collect::<Vec<_>>().join(", ");
            let _ = write!(of_test, "; {names}: numbers of the robot file for a drive, some body for a load.");
        }
    }
    of_test.push_str("\n\n# Errors\nThe name of the first function whose bits differ.");
    let of_hashes = format!(
        "The {} functions of [`self_test`] with the hashes of their results at the first `states` states: to compare machines at as \
         many states as there is time for.",
        test.functions.len()
    );
    [of_test, of_hashes].map(|text| doc(&text))
}

/// The items of the module.
fn module(test: &SelfTest, scalar: Scalar) -> String {
    let hashes: Vec<String> = test.functions.iter().map(|f| format!("{:#018x}", f.hash)).collect();
    let mut out = wrapped(
        &format!("/// The hashes at {STATES} states.\npub const EXPECTED: [u64; {}] = [", hashes.len()),
        &hashes,
        "];",
    );
    for ranges in &test.ranges {
        let pairs: Vec<String> = ranges.pairs.iter().map(|pair| format!("[{}]", literals(pair, scalar))).collect();
        let (name, s) = (&ranges.name, scalar.name());
        let start =
            format!("/// Least value and width of each number.\nconst {name}: [[{s}; 2]; {}] = [", ranges.pairs.len());
        out.push_str(&wrapped(&start, &pairs, "];"));
    }
    out.push_str(&helpers(scalar));
    test.functions.iter().for_each(|function| out.push_str(&runner(test, function, scalar)));
    out
}

fn literals(numbers: &[f64], scalar: Scalar) -> String {
    numbers.iter().map(|x| scalar.literal(*x)).collect::<Vec<_>>().join(", ")
}

/// What all of them call.
fn helpers(scalar: Scalar) -> String {
    let (s, bytes, [factor, increment, _]) = (scalar.name(), scalar.bytes(), GENERATOR);
    let (shift, steps) = (u32::BITS - BITS, 1u32 << BITS);
    format!(
        "
/// The next number in [0, 1), of {BITS} bits: a linear congruential generator.
fn next(random: &mut u32) -> {s} {{
    *random = random.wrapping_mul({factor}).wrapping_add({increment});
    (*random >> {shift}) as {s} / {steps}.0
}}

/// Draws numbers in their ranges.
#[inline(never)]
fn draw(random: &mut u32, ranges: &[[{s}; 2]], numbers: &mut [{s}]) {{
    for (number, [least, width]) in numbers.iter_mut().zip(ranges.iter().cycle()) {{
        *number = least + width * next(random);
    }}
}}

/// A unit quaternion of any three numbers: stereographic projection.
#[inline(never)]
fn quaternion(x: {s}, y: {s}, z: {s}) -> [{s}; 4] {{
    let s = x * x + y * y + z * z;
    let scale = 1.0 / (1.0 + s);
    [2.0 * x * scale, 2.0 * y * scale, 2.0 * z * scale, (1.0 - s) * scale]
}}

/// A hash with these numbers added.
#[inline(never)]
fn hashed(mut hash: u64, numbers: &[{s}]) -> u64 {{
    for number in numbers {{
        let mut bits = if number.is_nan() {{ {s}::NAN }} else {{ *number }}.to_bits();
        for _ in 0..{bytes} {{
            hash = (hash ^ (bits & 0xff) as u64).wrapping_mul(0x100000001b3);
            bits >>= 8;
        }}
    }}
    hash
}}
"
    )
}

/// What runs one function; the compiler of the machine is not told with what, so that it runs the function that others call.
fn runner(test: &SelfTest, function: &TestedFunction, scalar: Scalar) -> String {
    let style = Style::plain(scalar);
    let of_type = |port: &Port, reference: &str| match &port.wrapper {
        Some(wrapper) => format!("{reference}super::{wrapper}"),
        None => format!("{reference}{}", array_type(port, style)),
    };
    let inputs = function.inputs.iter().map(|(port, _)| of_type(port, "&"));
    let parameters: Vec<String> = inputs.chain(function.outputs.iter().map(|p| of_type(p, "&mut "))).collect();
    let (name, path, seed) = (function.runner(), function.path(), GENERATOR[2]);
    let mut out = format!(
        "\npub fn {name}(states: u32) -> u64 {{\n    let function = core::hint::black_box::<fn({})>(super::{path});\n    \
         let mut random = core::hint::black_box({seed});\n    let first = next(&mut random);\n",
        parameters.join(", ")
    );
    let drawn = || function.inputs.iter().filter(|(port, _)| port.wrapper.is_none());
    for port in drawn().map(|(port, _)| port).chain(&function.outputs) {
        let _ = writeln!(out, "    let mut {} = [first; {}];", port.name, port.len());
    }
    out.push_str("    let mut hash = 0xcbf29ce484222325;\n    for _ in 0..states {\n");
    for (port, made) in drawn() {
        let TestedInput::Drawn { ranges, quaternions } = made else { continue };
        let (name, ranges) = (&port.name, &test.ranges[*ranges].name);
        let _ = writeln!(out, "        draw(&mut random, &{ranges}, &mut {name});");
        for k in quaternions {
            let [a, b, c, d] = [0, 1, 2, 3].map(|i| format!("{name}[{}]", k + i));
            let _ = writeln!(out, "        [{a}, {b}, {c}, {d}] = quaternion({a}, {b}, {c});");
        }
    }
    out.push_str(&call(function, scalar));
    for port in &function.outputs {
        let _ = writeln!(out, "        hash = hashed(hash, &{});", port.name);
    }
    out.push_str("    }\n    hash\n}\n");
    out
}

/// The call, with matrices as what they are; in the runner they are lists, as one that is made of arrays is copied by a call where
/// code is to be small.
fn call(function: &TestedFunction, scalar: Scalar) -> String {
    let (mut arguments, mut names, mut views) = (Vec::new(), Vec::new(), Vec::new());
    let mut argument = |port: &Port, suffix: &str, reference: &str| match port.shape.len() {
        1 => arguments.push(format!("{reference}{}", port.name)),
        _ => {
            let chunks = port.shape[1..].iter().rev().map(|n| format!(".as_chunks{suffix}::<{n}>().0"));
            views.push(format!("{}{}.try_into()", port.name, chunks.collect::<String>()));
            names.push(format!("Ok({})", port.name));
            arguments.push(port.name.clone());
        }
    };
    for (port, made) in &function.inputs {
        match (made, &port.wrapper) {
            (TestedInput::Given(numbers), Some(wrapper)) => {
                let given = Port::new(&format!("super::{wrapper}([{}])", literals(numbers, scalar)), &[numbers.len()]);
                argument(&given, "", "&");
            }
            _ => argument(port, "", "&"),
        }
    }
    function.outputs.iter().for_each(|port| argument(port, "_mut", "&mut "));
    let call = format!("function({});\n", arguments.join(", "));
    match views.is_empty() {
        true => format!("        {call}"),
        false => {
            let (names, views) = (names.join(", "), views.join(", "));
            format!("        if let ({names},) = ({views},) {{\n            {call}        }}\n")
        }
    }
}
