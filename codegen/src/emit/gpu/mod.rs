//! Packages for graphics processors, which compute many states at once: a state per thread.
//!
//! Arrays lie in the memory of the device, component by component (`[c * n + s]`), so that neighbouring threads read neighbouring numbers.
//! A run-time parameter is one for all states. OpenCL C is C, and written in its room (`emit/c99/opencl.rs`).

pub mod ptx;

use super::c99::interface::{Exported, Interface};
use super::package::rust_alone;
use super::Generated;
use crate::identifier::comment;
use crate::program::written::WrittenFunction;
use std::collections::BTreeMap;

/// Why there is no package of what only other machines have.
pub(super) fn other_machines(generated: &Generated) -> Option<[&'static str; 2]> {
    rust_alone(generated).or(match () {
        () if generated.lanes.is_some() => Some([
            "a package for GPUs has a state per thread, and no lanes beside them",
            "leave out `lanes`; `--as c-abi` has them",
        ]),
        () if generated.target.is_some() => {
            Some(["a package for GPUs is for no other machine", "leave out `target`; `--as c99` has it"])
        }
        () => None,
    })
}

/// The functions that a package has, each with its program.
pub(super) fn programs<'g>(interface: &Interface<'g>) -> Vec<(Exported, &'g WrittenFunction)> {
    let programs = &interface.generated.programs;
    let of_robot = programs.functions.iter().map(|program| (program.name.clone(), program));
    let of_modes = programs.modes.iter().flat_map(|mode| {
        mode.functions.iter().map(|program| (format!("contact_{}_{}", mode.identifier, program.name), program))
    });
    let mut exported: BTreeMap<String, Exported> =
        interface.all_exported().into_iter().map(|function| (function.c_name.clone(), function)).collect();
    let of = |(name, program): (String, &'g WrittenFunction)| {
        (exported.remove(&name).expect("every program is exported"), program)
    };
    of_robot.chain(of_modes).map(of).collect()
}

/// What a function computes, and what it takes and gives: for a comment, line by line.
pub(super) fn about(function: &Exported) -> Vec<String> {
    let mode = function.mode.iter().map(|mode| format!("In the contact mode {}.", comment(mode)));
    let ports = function.parameters.iter().map(|p| {
        let role = if p.is_output { "gives" } else { "takes" };
        let how_often = if p.is_shared { ", the same for all states" } else { " per state" };
        format!("It {role} `{}`: {} of `{}`{how_often}.", p.name, p.length, function.scalar.c_name())
    });
    [function.summary.to_string()].into_iter().chain(mode).chain(ports).collect()
}
