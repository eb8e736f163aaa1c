//! Joints that follow others, from names to bodies: chains followed to joints that are left to choose.

use super::ModelOptions;
use crate::description::{messages, Description, WrittenCoupling};
use crate::diagnostic::Diagnostics;
use std::collections::HashMap;
use straightline_core::coupling::Coupling;
use straightline_core::model::{Body, BodyId};
use straightline_core::Dd;

/// The couplings of file and options on these bodies, each to a joint that follows none. Complaints go to `diagnostics`; couplings with errors are left out.
pub(super) fn resolve(
    description: &Description,
    options: &ModelOptions,
    bodies: &[Body<Dd>],
    diagnostics: &mut Diagnostics,
) -> Vec<Coupling<Dd>> {
    let mut written: HashMap<BodyId, (BodyId, &WrittenCoupling)> = HashMap::new();
    let mut order = Vec::new();
    for coupling in all(description, options) {
        let ends = [&coupling.joint, &coupling.source].map(|joint| body_of(&joint.value, bodies));
        for (joint, end) in [&coupling.joint, &coupling.source].into_iter().zip(&ends) {
            if end.is_none() {
                let moving = bodies.iter().filter(|b| b.joint.kind.is_single()).map(|b| b.joint.name.as_str());
                let complaint = messages::coupling_joint(&coupling.joint.value, &joint.value, moving);
                diagnostics.push(complaint.at(&joint.place));
            }
        }
        if coupling.ratio.value == 0.0 {
            diagnostics.push(messages::coupling_ratio_zero(&coupling.joint.value).at(&coupling.ratio.place));
            continue;
        }
        let [Some(body), Some(source)] = ends else { continue };
        if let Some((_, first)) = written.get(&body) {
            let complaint = messages::coupled_twice(&coupling.joint.value, &first.source.value, &coupling.source.value);
            diagnostics.push(complaint.at(&coupling.joint.place).related(&first.joint.place, "the first one"));
            continue;
        }
        written.insert(body, (source, coupling));
        order.push(body);
    }
    let mut found = Vec::new();
    let mut in_cycles: Vec<BodyId> = Vec::new();
    for body in order {
        let (mut source, first) = written[&body];
        let (mut ratio, mut offset) = (Dd::from(first.ratio.value), Dd::from(first.offset.value));
        let mut path = vec![body];
        while let Some((next, coupling)) = written.get(&source).filter(|_| !path.contains(&source)) {
            // a (a' q + b') + b
            let [a, b] = [coupling.ratio.value, coupling.offset.value].map(Dd::from);
            (ratio, offset) = (ratio * a, ratio * b + offset);
            path.push(source);
            source = *next;
        }
        match path.iter().position(|b| *b == source) {
            None => found.push(Coupling { body, source, ratio, offset }),
            // of each cycle once, at the first joint of the file that is on it
            Some(0) if !in_cycles.contains(&body) => {
                let names: Vec<&str> = path.iter().map(|b| bodies[*b].joint.name.as_str()).collect();
                diagnostics.push(messages::coupling_cycle(&names).at(&first.joint.place));
                in_cycles.extend(path);
            }
            Some(_) => {}
        }
    }
    found
}

/// Those of the file, then those of the options; none if couplings are off.
fn all<'a>(description: &'a Description, options: &'a ModelOptions) -> impl Iterator<Item = &'a WrittenCoupling> {
    description.couplings.iter().chain(&options.couplings).filter(|_| !options.uncoupled)
}

fn body_of(joint: &str, bodies: &[Body<Dd>]) -> Option<BodyId> {
    bodies.iter().position(|b| b.joint.name == joint && b.joint.kind.is_single())
}
