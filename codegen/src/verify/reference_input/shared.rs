//! Joints that follow others, in the reference's terms: they share coordinates.

use crate::description::{Description, WrittenCoupling};
use crate::model::ModelOptions;
use straightline_core::reference::{CentreOfMassTree, SharedCoordinate};
use straightline_core::Dd;

/// Lets joints that follow others share the coordinates of those that follow none; until the coordinates are numbered their `iv` is the link of that joint.
pub(super) fn share_coordinates(
    tree: &mut CentreOfMassTree<Dd>,
    joint_names: &[String],
    (description, options): (&Description, &ModelOptions),
) -> Result<(), String> {
    let couplings: Vec<&WrittenCoupling> = match options.uncoupled {
        true => Vec::new(),
        false => description.couplings.iter().chain(&options.couplings).collect(),
    };
    // a joint's coordinate as a sum of that of a link and a number
    let resolved = |joint: &str| -> Result<(usize, [Dd; 2]), String> {
        let mut name: &str = joint;
        let mut line = [Dd::ONE, Dd::ZERO];
        for _ in 0..=couplings.len() {
            let Some(coupling) = couplings.iter().find(|coupling| coupling.joint.value == name) else {
                let link = joint_names.iter().position(|joint| joint == name);
                return Ok((link.ok_or_else(|| format!("there is no joint `{name}`"))?, line));
            };
            let [a, b] = [coupling.ratio.value, coupling.offset.value].map(Dd::from);
            line = [line[0] * a, line[0] * b + line[1]];
            name = &coupling.source.value;
        }
        Err(format!("joint `{name}` follows itself"))
    };
    for (rank, coupling) in couplings.iter().enumerate() {
        let follower = resolved_link(joint_names, &coupling.joint.value)?;
        let (source, [ratio, offset]) = resolved(&coupling.joint.value)?;
        let link = &mut tree.links[follower];
        (link.iv, link.shared) = (source, Some(SharedCoordinate { ratio, offset, rank }));
    }
    Ok(())
}

fn resolved_link(joint_names: &[String], joint: &str) -> Result<usize, String> {
    joint_names.iter().position(|name| name == joint).ok_or_else(|| format!("there is no joint `{joint}`"))
}
