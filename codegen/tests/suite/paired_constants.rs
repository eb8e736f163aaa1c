//! Whether constants would better come from one table, in the order of their use, so that one instruction loads two of them. They would not: LLVM
//! loads pairs into registers that happen to be neighbours alone, and a constant in a table is no longer made again where it is needed.

use crate::cross;
use std::path::Path;
use straightline_codegen::choices::{Memory, TargetMachine};
use straightline_codegen::diagnostic::Source;
use straightline_codegen::machine_code::{machine_code, RustCompiler};
use straightline_codegen::options::Options;
use straightline_codegen::{compile, Function, Scalar};

const MACHINE: TargetMachine = TargetMachine::CORTEX_M4F;

/// The text with the constants of its function, but for those that an instruction holds, in a table; how many they are.
fn with_table(text: &str) -> (String, usize) {
    let start = text.find("pub fn inverse_dynamics(").expect("there is the function");
    let open = start + text[start..].find("{\n").expect("it has a body") + 1;
    let end = open + text[open..].find("\n}\n").expect("the body ends");
    let (mut body, mut table) = (String::new(), Vec::<String>::new());
    let is_of_word = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '.';
    let mut rest = &text[open..end];
    while let Some(first) = rest.find(is_of_word) {
        let word_end = rest[first..].find(|c| !is_of_word(c)).map_or(rest.len(), |n| first + n);
        let mut word = &rest[first..word_end];
        let mut next = word_end;
        // `1.5e-7` goes on behind the sign
        if word.ends_with('e') && word.starts_with(|c: char| c.is_ascii_digit()) && rest[word_end..].starts_with('-') {
            next = word_end + 1 + rest[word_end + 1..].find(|c| !is_of_word(c)).expect("the body goes on");
            word = &rest[first..next];
        }
        body.push_str(&rest[..first]);
        let is_held = |x: f32| [0.0, 0.5, 1.0, 2.0].contains(&x);
        match word.parse::<f32>() {
            Ok(value) if word.contains('.') && !is_held(value) => {
                let at = table.iter().position(|c| c == word).unwrap_or(table.len());
                if at == table.len() {
                    table.push(word.to_string());
                }
                body.push_str(&format!("CONSTANTS[{at}]"));
            }
            _ => body.push_str(word),
        }
        rest = &rest[next..];
    }
    body.push_str(rest);
    let count = table.len();
    let hidden = format!(
        "\n    static TABLE: [f32; {count}] = [{}];\n    let CONSTANTS = core::hint::black_box(&TABLE);",
        table.join(", ")
    );
    (format!("{}{hidden}{body}{}", &text[..open], &text[end..]), count)
}

#[test]
fn a_table_of_constants_takes_no_fewer_instructions() {
    if cross::program("rustc").is_none() {
        return;
    }
    let rustc = RustCompiler::find(Some(&cross::rustc())).expect("it is there");
    for robot in ["panda.urdf", "ur5.urdf", "puma560.urdf"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/descriptions").join(robot);
        let source = Source::new(robot, std::fs::read_to_string(path).expect("the robot is there"));
        let functions = vec![Function::InverseDynamics];
        let mut options = Options { scalar: Scalar::F32, target: Some(MACHINE), functions, ..Options::default() };
        options.model.angle_tolerance = 1e-10;
        let text = compile(&source, &options).unwrap_or_else(|errors| panic!("{errors}")).text;
        let (table, constants) = with_table(&text);
        assert!(constants > 15, "{robot}: {constants} constants");
        let instructions = |text: &str| {
            let text = text.replace("pub fn inverse_dynamics(", "#[no_mangle]\npub fn inverse_dynamics(");
            let text = format!("#![no_std]\n{text}");
            let code = machine_code(&rustc, &text, MACHINE, Memory::Flash).unwrap_or_else(|e| panic!("{e}"));
            let figures = code.figures(&["inverse_dynamics".to_string()], MACHINE, Memory::Flash);
            *figures.expect("it is there")[0].instructions.as_ref().expect("it is known")
        };
        let [own, of_table] = [&text, &table].map(|text| instructions(text));
        println!("{robot}: {own} instructions, {of_table} with a table of {constants} constants");
        assert!(of_table >= own, "{robot}: {of_table} instructions with a table, {own} without");
    }
}
