//! Names that SDF cannot have, and others in their place.
//!
//! Links, joints and frames of a model have no name twice; `::` stands between the names of models, blanks around a name do not count, and `world`
//! and `__…__` are words of the format.

use crate::description::reader::FreeNames;
use crate::description::{Description, Noted};
use std::collections::{HashMap, HashSet};

/// A name that something cannot have in SDF.
pub struct UnfitName {
    /// What has it: `robot`, `link`, `frame`, `joint` or `loop`.
    pub of: &'static str,
    pub name: Noted<String>,
    /// What it is called instead.
    pub other: String,
}

/// The names that a robot cannot have in SDF. Of a link or frame and a joint with one name the joint gets another one.
pub fn unfit(robot: &Description) -> Vec<UnfitName> {
    let ground = robot.ground().map(|link| link.name.value.as_str());
    let links = robot.links.iter().map(|link| &link.name).filter(|name| Some(name.value.as_str()) != ground);
    let frames = robot.frames.iter().map(|frame| ("frame", &frame.name, Some(frame.link.value.as_str()) == ground));
    let joints = robot.joints.iter().map(|joint| ("joint", &joint.name, false));
    let loops = robot.loops.iter().map(|own| ("loop", &own.name, false));
    let mut names = FreeNames::default();
    let mut taken: HashSet<&str> = HashSet::new();
    let mut left = Vec::new();
    for (of, name, is_in_world) in links.map(|name| ("link", name, false)).chain(frames).chain(joints).chain(loops) {
        // what stands in the world stands beside the model
        let is_free = !(is_in_world && name.value == robot.name.value) && taken.insert(&name.value);
        match is_free && is_fit(&name.value) {
            true => names.take([name.value.clone()]),
            false => left.push((of, name)),
        }
    }
    let of_robot = (!is_fit(&robot.name.value)).then_some(("robot", &robot.name));
    let other = |(of, name): (&'static str, &Noted<String>)| {
        let text = name.value.trim().replace("::", "_");
        let other = match text != name.value && is_fit(&text) {
            true => text,
            false => format!("{text}_{of}"),
        };
        UnfitName { of, name: name.clone(), other: names.made_up(&other) }
    };
    of_robot.into_iter().chain(left).map(other).collect()
}

/// Whether SDF can have a name.
fn is_fit(name: &str) -> bool {
    let is_reserved = name == "world" || (name.len() >= 4 && name.starts_with("__") && name.ends_with("__"));
    !is_reserved && name.trim() == name && !name.contains("::")
}

/// Gives a robot the other names. It has no drives and links that bend any more, and its loops determine the joints that a reader chooses.
pub fn replace_unfit(robot: &mut Description) {
    let unfit = unfit(robot);
    let renamed = |of: &str, names: Vec<&mut Noted<String>>| {
        let others = unfit.iter().filter(|unfit| unfit.of == of);
        let others: HashMap<&str, &str> =
            others.map(|unfit| (unfit.name.value.as_str(), unfit.other.as_str())).collect();
        for name in names {
            if let Some(other) = others.get(name.value.as_str()) {
                name.value = other.to_string();
            }
        }
    };
    renamed("robot", vec![&mut robot.name]);
    let on_joints = robot.joints.iter_mut().flat_map(|joint| [&mut joint.parent, &mut joint.child]);
    let on_frames = robot.frames.iter_mut().map(|frame| &mut frame.link);
    renamed("link", robot.links.iter_mut().map(|link| &mut link.name).chain(on_joints).chain(on_frames).collect());
    renamed("frame", robot.frames.iter_mut().map(|frame| &mut frame.name).collect());
    for of in ["link", "frame"] {
        renamed(of, robot.loops.iter_mut().flat_map(|own| own.points.names_mut()).collect());
    }
    renamed("loop", robot.loops.iter_mut().map(|own| &mut own.name).collect());
    let coupled = robot.couplings.iter_mut().flat_map(|coupling| [&mut coupling.joint, &mut coupling.source]);
    renamed("joint", robot.joints.iter_mut().map(|joint| &mut joint.name).chain(coupled).collect());
}
