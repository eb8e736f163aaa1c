//! The functions that packages of other languages have, and what each is to compute.

use super::values::{TextFormat, TextValue, Values};
use crate::emit::Generated;
use crate::program::written::WrittenFunction;
use rustc_hash::FxHashMap;
use straightline_graph::expr::Port;

/// A function of a package, and what it is to compute.
pub(super) struct PackageFunction<'g> {
    /// The name in its package.
    pub name: String,
    pub inputs: &'g [Port],
    pub outputs: &'g [Port],
    pub given: Vec<TextValue>,
    pub results: Vec<TextValue>,
    pub format: TextFormat,
    /// Of a run-time parameter: none but its constructor calls it.
    pub is_private: bool,
    /// Whether it bounds no errors of another one, and makes no parameter.
    pub is_asked_for: bool,
}

/// The functions of a package whose names begin with the prefix.
pub(super) fn of_package<'g>(generated: &'g Generated, prefix: &str, values: &mut Values) -> Vec<PackageFunction<'g>> {
    let mut names = FxHashMap::default();
    let mut wanted = Vec::new();
    let programs = &generated.programs;
    for program in &programs.functions {
        wanted.push(function(program, format!("{prefix}_{}", program.name), values, &mut names));
    }
    for mode in &programs.modes {
        for program in &mode.functions {
            let name = format!("{prefix}_contact_{}_{}", mode.identifier, program.name);
            wanted.push(function(program, name, values, &mut names));
        }
    }
    for parameter in &programs.parameters {
        let name = format!("{prefix}_{}", parameter.program.name);
        let constructor = function(&parameter.program, name, values, &mut names);
        wanted.push(PackageFunction { is_private: true, ..constructor });
    }
    values.close();
    wanted
}

fn function<'g>(
    program: &'g WrittenFunction,
    name: String,
    values: &mut Values,
    names: &mut FxHashMap<&'g str, u32>,
) -> PackageFunction<'g> {
    let format = TextFormat::from(program.scalar);
    let mut given = Vec::new();
    for port in &program.graph.inputs {
        let next = names.len() as u32;
        let name = *names.entry(port.name.as_str()).or_insert(next);
        given.extend((0..port.len()).map(|k| values.input(name, k, format)));
    }
    let results = values.results(&program.graph, &given, format);
    let (inputs, outputs, is_asked_for) = (&program.graph.inputs[..], &program.graph.outputs[..], program.is_asked_for);
    PackageFunction { name, inputs, outputs, given, results, format, is_private: false, is_asked_for }
}
