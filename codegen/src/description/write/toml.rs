//! TOML with joint frames.

use super::drives::of_drive;
use super::edits::{TextEdit, TomlEdits};
use super::{losses, number, rotations, word_of, FormatWriter, JointForm, LoopForm};
use crate::description::angle::{self, ROUNDING};
use crate::description::flexible::{Bending, Flexible};
use crate::description::{
    AngleUnit, BaseKind, ClosingJoint, Description, JointDrive, LoopPoints, Noted, Placement, Rotation,
    WrittenInertial, WrittenJoint, WrittenPose,
};
use crate::diagnostic::{Place, Source};
use std::fmt::Write;
use straightline_core::joint::Dialect;
use straightline_core::spatial::Sym3;

/// Writes TOML with joint frames.
pub static WRITER: FormatWriter = FormatWriter {
    word: "toml",
    extensions: &["toml"],
    joints: JointForm::AtFrames,
    rotations: "roll, pitch and yaw: in the unit of IN, or degrees if all are multiples of 30° or 45°, or radians",
    frames_are_links: false,
    loops: LoopForm::Frames,
    losses: &[&losses::CARRIERS, &losses::JOINTS_BESIDE_FRAMES, &losses::SKIPPED],
    floats_by_option: false,
    text,
    edits: Some(number_edits),
};

fn text(robot: &Description) -> String {
    let mut out = format!("[robot]\nname = {}\n", string(&robot.name.value));
    if let Some(gravity) = &robot.gravity {
        _ = writeln!(out, "gravity = {}", array(&gravity.value));
    }
    if let Some(base) = &robot.base {
        let word = if base.value == BaseKind::Floating { "floating" } else { "fixed" };
        _ = writeln!(out, "base = \"{word}\"");
    }
    _ = robot.base_damping.iter().try_for_each(|damping| writeln!(out, "base_damping = {}", number(damping.value)));
    for link in &robot.links {
        _ = writeln!(out, "\n[[link]]\nname = {}", string(&link.name.value));
        if let Some(inertial) = &link.inertial {
            out += &of_inertial(inertial);
        }
        let bends = robot.flexible.iter().filter(|flexible| flexible.link.value == link.name.value);
        bends.for_each(|flexible| _ = writeln!(out, "flexible = {}", of_flexible(flexible)));
    }
    for joint in &robot.joints {
        out += &of_joint(joint);
    }
    for coupling in &robot.couplings {
        let (joint, source) = (string(&coupling.joint.value), string(&coupling.source.value));
        _ = writeln!(out, "\n[[coupling]]\njoint = {joint}\nfollows = {source}");
        _ = writeln!(out, "ratio = {}\noffset = {}", number(coupling.ratio.value), number(coupling.offset.value));
    }
    for own in &robot.loops {
        let LoopPoints::Frames(ends) = &own.points else { unreachable!("loops are closed at frames") };
        let [one, other] = ends.each_ref().map(|end| string(&end.value));
        let determines: Vec<String> = own.determines.iter().map(|joint| string(&joint.value)).collect();
        let name = string(&own.name.value);
        _ = writeln!(out, "\n[[loop]]\nname = {name}\nframe = {one}\nwith = {other}");
        if own.joint != ClosingJoint::Spherical {
            _ = writeln!(out, "kind = {}", string(own.joint.word()));
        }
        if let ClosingJoint::Revolute(axis) = &own.joint {
            _ = writeln!(out, "axis = {:?}", axis.value);
        }
        _ = writeln!(out, "determines = [{}]", determines.join(", "));
        if let Some(assembly) = &own.assembly {
            _ = writeln!(out, "assembly = {}", string(assembly.value.word()));
        }
    }
    for frame in &robot.frames {
        let (name, link) = (string(&frame.name.value), string(&frame.link.value));
        _ = writeln!(out, "\n[[frame]]\nname = {name}\nlink = {link}");
        place(&frame.pose).iter().for_each(|entry| _ = writeln!(out, "{entry}"));
    }
    robot.drives.iter().for_each(|drive| out += &of_drive(drive));
    out
}

/// A string with what TOML escapes.
pub(super) fn string(text: &str) -> String {
    let mut out = "\"".to_string();
    for c in text.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            c if c.is_control() => _ = write!(out, "\\u{:04X}", u32::from(c)),
            c => out.push(c),
        }
    }
    out + "\""
}

/// Numbers in an array.
pub(super) fn array(all: &[f64]) -> String {
    format!("[{}]", all.iter().map(|x| number(*x)).collect::<Vec<_>>().join(", "))
}

/// The entries of a pose that say something.
fn place(pose: &WrittenPose) -> Vec<String> {
    let xyz = (pose.xyz.value != [0.0; 3]).then(|| format!("xyz = {}", array(&pose.xyz.value)));
    xyz.into_iter().chain(rotation("rpy", &pose.rotation)).collect()
}

/// Roll, pitch and yaw in the unit of the file, or in degrees where all of them are multiples of 30° or 45°, or in radians.
fn rotation(key: &str, rotation: &Rotation) -> Option<String> {
    if let Rotation::RollPitchYaw(angles) = rotation {
        let unit = angles.iter().find(|angle| angle.value != 0.0)?.unit;
        let suffix = match unit {
            AngleUnit::Radian => "_rad",
            AngleUnit::Degree => "_deg",
            AngleUnit::QuarterTurn => "_quarter_turns",
            AngleUnit::Turn => "_turns",
        };
        return Some(format!("{key}{suffix} = {}", array(&angles.each_ref().map(|angle| angle.value))));
    }
    let angles = rotations::roll_pitch_yaw(rotation);
    let twelfths = angles.map(|value| angle::read(&rotations::in_radians(value), ROUNDING).special);
    match twelfths {
        [Some(0), Some(0), Some(0)] => None,
        [Some(a), Some(b), Some(c)] => Some(format!("{key}_deg = {}", array(&[a, b, c].map(|m| 15.0 * m as f64)))),
        _ => Some(format!("{key}_rad = {}", array(&angles))),
    }
}

fn of_inertial(inertial: &WrittenInertial) -> String {
    let j = &inertial.inertia.value;
    let mut out = format!("mass = {}\n", number(inertial.mass.value));
    if inertial.com.value != [0.0; 3] {
        _ = writeln!(out, "com = {}", array(&inertial.com.value));
    }
    _ = writeln!(out, "inertia = {}", tensor(j));
    rotation("inertia_rpy", &inertial.rotation).iter().for_each(|entry| _ = writeln!(out, "{entry}"));
    out
}

fn tensor(j: &Sym3<f64>) -> String {
    let products = [("xy", j.xy), ("xz", j.xz), ("yz", j.yz)].into_iter().filter(|(_, x)| *x != 0.0);
    let entries = [("xx", j.xx), ("yy", j.yy), ("zz", j.zz)].into_iter().chain(products);
    let entries: Vec<String> = entries.map(|(key, x)| format!("{key} = {}", number(x))).collect();
    format!("{{ {} }}", entries.join(", "))
}

fn of_joint(joint: &WrittenJoint) -> String {
    let Placement::Frames { origin, axis } = &joint.placement else {
        unreachable!("joints stand at the frames of links");
    };
    let (kind, limits) = (joint.kind.value, &joint.limits);
    let is_ranged = kind.has_range && (limits.lower.is_some() || limits.upper.is_some());
    let word = word_of(kind.between_links(), is_ranged, Dialect::JointFrames).unwrap_or(kind.word);
    let (name, parent, child) = (string(&joint.name.value), string(&joint.parent.value), string(&joint.child.value));
    let mut out = format!("\n[[joint]]\nname = {name}\nkind = \"{word}\"\nparent = {parent}\nchild = {child}\n");
    let pose = place(origin);
    if !pose.is_empty() {
        _ = writeln!(out, "origin = {{ {} }}", pose.join(", "));
    }
    if kind.has_axis() {
        _ = writeln!(out, "axis = {}", of_axis(&axis.value));
    }
    let ends = [("lower", &limits.lower), ("upper", &limits.upper)].into_iter().filter(|_| is_ranged);
    let ends = ends.chain([("velocity", &limits.velocity), ("effort", &limits.effort)]);
    let mut entries: Vec<String> = ends.filter_map(|(key, value)| entry(key, value)).collect();
    // a slide has a range, which may be open
    if !is_ranged && kind.between_links().is_some_and(|kind| kind.slides()) {
        entries.splice(0..0, ["lower = -inf".to_string(), "upper = inf".to_string()]);
    }
    if !entries.is_empty() {
        _ = writeln!(out, "limits = {{ {} }}", entries.join(", "));
    }
    out + &of_effects(&joint.drive)
}

fn of_axis(axis: &[f64; 3]) -> String {
    let named = super::super::toml::AXES.iter().find(|(_, vector)| vector == axis);
    named.map_or_else(|| array(axis), |(name, _)| format!("\"{name}\""))
}

fn entry(key: &str, value: &Option<Noted<f64>>) -> Option<String> {
    value.as_ref().map(|value| format!("{key} = {}", number(value.value)))
}

fn of_effects(drive: &JointDrive) -> String {
    let keys = [
        ("damping", &drive.damping),
        ("friction", &drive.friction),
        ("rotor_inertia", &drive.rotor_inertia),
        ("gear_ratio", &drive.gear_ratio),
        ("armature", &drive.armature),
    ];
    let mut lines: Vec<String> = keys.into_iter().filter_map(|(key, value)| entry(key, value)).collect();
    let spring = [("stiffness", &drive.spring_stiffness), ("rest", &drive.spring_rest)];
    let spring: Vec<String> = spring.into_iter().filter_map(|(key, value)| entry(key, value)).collect();
    if drive.spring_stiffness.is_some() {
        lines.push(format!("spring = {{ {} }}", spring.join(", ")));
    }
    lines.into_iter().map(|line| line + "\n").collect()
}

fn of_flexible(flexible: &Flexible) -> String {
    let Flexible { from, to, segments, bending, torsion, damping, .. } = flexible;
    let mut entries = vec![
        format!("from = {}", array(from)),
        format!("to = {}", array(&to.value)),
        format!("segments = {}", segments.value),
    ];
    match bending {
        Bending::None => {}
        Bending::Round(stiffness) => entries.push(format!("bending = {}", number(stiffness.value))),
        Bending::About(axes) => {
            let about: Vec<String> =
                ["x", "y", "z"].into_iter().zip(axes).filter_map(|(key, x)| entry(key, x)).collect();
            entries.push(format!("bending = {{ {} }}", about.join(", ")));
        }
    }
    entries.extend(entry("torsion", torsion));
    entries.push(format!("damping = {}", number(damping.value)));
    format!("{{ {} }}", entries.join(", "))
}

/// Numbers of inertials and of what joints lose.
fn number_edits(source: &Source, [was, robot]: [&Description; 2]) -> Vec<TextEdit> {
    let mut edits = TomlEdits::new(source.text());
    let links =
        was.links.iter().zip(&robot.links).filter_map(|(a, b)| Some((a.inertial.as_ref()?, b.inertial.as_ref()?)));
    for (was, new) in links {
        let mass = &was.mass.place;
        // what is left out has the place of the whole link: of a table in braces, or of a head such as `[[link]]`, where a matrix has numbers
        let written = |place: &Place| {
            let is_around = place.span.start <= mass.span.start && mass.span.end <= place.span.end;
            let inside = source.text()[place.span.clone()].trim_start_matches(['[', ' ', '\t', '\r', '\n']);
            !is_around && !inside.starts_with(|c: char| c.is_alphabetic() || ['"', '\'', '_'].contains(&c))
        };
        edits.set_number("mass", Some((was.mass.value, mass)), mass, new.mass.value);
        if was.com.value != new.com.value {
            let place = Some(&was.com.place).filter(|place| written(place));
            edits.set("com", place, mass, array(&new.com.value));
        }
        if was.inertia.value != new.inertia.value {
            let place = Some(&was.inertia.place).filter(|place| written(place));
            edits.set("inertia", place, mass, tensor(&new.inertia.value));
        }
    }
    for (was, new) in was.joints.iter().zip(&robot.joints) {
        let pairs = [
            ("damping", &was.drive.damping, &new.drive.damping),
            ("friction", &was.drive.friction, &new.drive.friction),
            ("rotor_inertia", &was.drive.rotor_inertia, &new.drive.rotor_inertia),
            ("armature", &was.drive.armature, &new.drive.armature),
        ];
        for (key, old, new) in pairs {
            let old = old.as_ref().map(|old| (old.value, &old.place));
            new.iter().for_each(|new| edits.set_number(key, old, &was.name.place, new.value));
        }
    }
    edits.edits
}
