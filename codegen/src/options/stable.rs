//! A text of what the output depends on beside the robot file, for hashes and keys.
//!
//! It consists of names that are stated here, in the order in which they stand here, and leaves out what is at its default. So a field
//! may be renamed or moved, and an option added, without another hash of files that say nothing of it. A field that is neither named
//! nor left out on purpose does not compile.

use crate::choices::Choice;
use crate::description::drives::{TransmissionStage, WrittenActuator, WrittenDrive, WrittenRating, WrittenThermal};
use crate::description::flexible::{BaseSupport, Bending, Flexible, WrittenSpring};
use crate::description::Noted;
use crate::description::WrittenCoupling;
use crate::function::ContactFunction;
use crate::model::{FrameOption, ModelOptions};
use crate::options::{FormChoices, Optimisations};
use crate::scene::contact::{
    ContactItem, EnvironmentItem, EnvironmentKind, LoopItem, ModeItem, ObjectPose, SceneContacts, SurfaceItem,
    UserSurface,
};
use crate::scene::{
    Base, Budget, CoulombForm, Effects, Gravity, InputRange, JointRanges, MaxError, Parameter, Payload, Ranges,
    ResultPart, Scene, Selection, Zero,
};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::time::Duration;
use straightline_core::base_parameters::JointParameter;
use straightline_core::contact::Coordinate;
use straightline_graph::certify::Effort;
use straightline_graph::schedule::ScheduleLimits;

/// What has such a text.
pub(crate) trait Stable {
    /// Appends it.
    fn say(&self, out: &mut String);

    /// The text.
    fn stable_text(&self) -> String {
        let mut out = String::new();
        self.say(&mut out);
        out
    }
}

/// `name=value;`
pub(super) fn said<T: Stable>(name: &str, value: &T, out: &mut String) {
    out.push_str(name);
    out.push('=');
    value.say(out);
    out.push(';');
}

/// Structures: `=` what differs from the default alone, `:` everything, behind `..` what is not of the output.
macro_rules! fields {
    ($($type:ident $mode:tt { $($name:literal: $field:ident,)* $(.. $($silent:ident),+)? })*) => {$(
        impl $crate::options::stable::Stable for $type {
            fn say(&self, out: &mut String) {
                let $type { $($field,)* $($($silent: _),+)? } = self;
                out.push('{');
                $crate::options::stable::fields!(@ $type $mode out $($name: $field,)*);
                out.push('}');
            }
        }
    )*};
    (@ $type:ident = $out:ident $($name:literal: $field:ident,)*) => {
        let default = $type::default();
        $(if *$field != default.$field {
            $crate::options::stable::said($name, $field, $out);
        })*
    };
    (@ $type:ident : $out:ident $($name:literal: $field:ident,)*) => {
        $($crate::options::stable::said($name, $field, $out);)*
    };
}
pub(super) use fields;

/// Enumerations: the name of the variant, and what is in it.
macro_rules! variants {
    ($($type:ident { $($name:literal: $variant:ident $(($inner:ident))? $({ $($field:ident),* })?,)* })*) => {$(
        impl Stable for $type {
            fn say(&self, out: &mut String) {
                match self {
                    $($type::$variant $(($inner))? $({ $($field),* })? => {
                        out.push_str($name);
                        $($inner.say(out);)?
                        $($(said(stringify!($field), $field, out);)*)?
                    })*
                }
            }
        }
    )*};
}

/// Values that Rust prints one way for ever.
macro_rules! printed {
    ($($type:ty)*) => {$(
        impl Stable for $type {
            fn say(&self, out: &mut String) {
                let _ = write!(out, "{self:?}");
            }
        }
    )*};
}

/// Values with a word of their own.
macro_rules! worded {
    ($($type:ty: $value:ident => $word:expr;)*) => {$(
        impl Stable for $type {
            fn say(&self, out: &mut String) {
                let $value = self;
                out.push_str($word);
            }
        }
    )*};
}

fields! {
    ScheduleLimits = { "operations": operations, }
    ModelOptions = {
        "floating_base": floating_base, "joint_order": joint_order, "angle_tolerance": angle_tolerance,
        "gravity": gravity, "frames": frames, "flexible": flexible, "support": support, "rigid_links": rigid_links,
        "coupling": couplings, "uncoupled": uncoupled, "open_loops": open_loops,
    }
    FrameOption : { "name": name, "link": link, "xyz": xyz, "rpy": rpy, }
    Effort : { "boxes": boxes, "time": time, "state": companions, }
    Optimisations : {
        "folding": folding, "algebraic": algebraic, "reduced": reduced, "sums": sums, "chosen": chosen, "forms": forms,
        "angle_sums": angle_sums, "cheaper": cheaper, "limbs": limbs, "columns": columns,
        "substitutes": substitutes,
    }
    FormChoices : {
        "stays": stays, "origins": origins, "tips": tips, "parameters": parameters, "rotations": rotations,
        "unit": unit,
    }
    Scene = {
        "outputs": outputs, "by_columns": by_columns, "gravity": gravity, "base": base, "locked": locked,
        "payload": payloads, "drive": drives, "coupling": couplings, "flexible": flexible, "support": support, "zero": zero,
        "effects": effects, "parameter": parameters, "contacts": contacts, "staged": staged, "budget": budgets,
        "ranges": ranges, "regressor": regressor, .. places
    }
    Selection = { "joints": joints, "frames": frames, "part": part, "results": results, }
    Payload : { "name": name, "frame": frame, "mass": mass, "com": com, "inertia": inertia, }
    Zero = { "qd": qd, "qdd": qdd, "joints_at_rest": joints_at_rest, }
    Effects = {
        "rotor_inertia": rotor_inertia, "damping": damping, "coulomb": coulomb, "springs": springs,
        "transmission_losses": transmission_losses, "elastic_transmissions": elastic_transmissions,
        "elastic_links": elastic_links, "couplings": couplings, "loops": loops,
    }
    Budget = {
        "max_flops": max_flops, "max_sincos": max_sincos, "max_live": max_live, "max_stack_bytes": max_stack_bytes,
        "max_code_bytes": max_code_bytes, "max_instructions": max_instructions, "max_flash_bytes": max_flash_bytes,
        "max_error": max_error, "mixed_precision": mixed_precision,
    }
    Ranges = { "q": q, "qd": qd, "qdd": qdd, "tau": tau, "gravity": gravity, }
    InputRange : { "lower": lower, "upper": upper, }
    SceneContacts = {
        "contact": contacts, "loop": loops, "mode": modes, "stabilisation": stabilisation, "functions": functions,
    }
    ContactItem : {
        "name": name, "frame": frame, "axis": axis, "object": object, "surface": surface, "constrained": constrained,
        "free": free, "friction": friction, "environment": environment,
    }
    ObjectPose : { "origin": origin, "z": z, "x": x, }
    EnvironmentItem : { "kind": kind, "values": values, }
    LoopItem : { "name": name, "frame": frame, "with": with, "constrained": constrained, }
    ModeItem : { "name": name, "contacts": contacts, "sticking": sticking, }
    WrittenDrive : {
        "name": name, "joints": joints, "actuator": actuator, "stages": stages, "efficiency": efficiency,
        "input_limit": input_limit, "current_limit": current_limit, "rotor": rotor, "rating": rating, .. written
    }
    TransmissionStage : {
        "ratio": ratio, "stiffness": stiffness, "damping": damping, "input_inertia": input_inertia,
        "output_inertia": output_inertia, "efficiency": efficiency,
    }
    WrittenRating = { "speed": speed, "continuous_current": continuous_current, "thermal": thermal, }
    WrittenThermal : {
        "winding_housing": winding_housing, "housing_ambient": housing_ambient, "winding_time": winding_time,
        "housing_time": housing_time, "ambient": ambient, "limit": limit,
    }
    WrittenCoupling : { "joint": joint, "follows": source, "ratio": ratio, "offset": offset, }
    Flexible : {
        "link": link, "from": from, "to": to, "segments": segments, "bending": bending, "torsion": torsion,
        "damping": damping,
    }
    BaseSupport : { "at": at, "directions": directions, .. place }
    WrittenSpring : { "stiffness": stiffness, "damping": damping, "rest": rest, }
}

variants! {
    Gravity { "of_robot": OfRobot, "constant": Constant(vector), "input": Input, }
    Base { "of_robot": OfRobot, "fixed": Fixed, "floating": Floating, "moving": Moving, }
    CoulombForm { "off": Off, "sign": Sign, "smooth": Smooth(speed), }
    JointRanges { "limits": Limits, "all": All(range), "joints": Joints(ranges), }
    MaxError { "all": All(most), "each": Each(most), "outputs": Outputs(most), }
    SurfaceItem {
        "plane": Plane, "sphere": Sphere { radius, hollow }, "cylinder": Cylinder { radius, hollow },
        "quadric": Quadric { matrix, linear, constant }, "implicit": Implicit(surface),
    }
    Bending { "none": None, "round": Round(stiffness), "about": About(axes), }
}

impl Stable for Parameter {
    fn say(&self, out: &mut String) {
        match self {
            Parameter::Payload { name, frame } => {
                said("payload", name, out);
                said("frame", frame, out);
            }
            Parameter::Link { link } => said("link", link, out),
            // its form is that of the robot file and of the scene
            Parameter::Drive { name, drive, numbers, form: _ } => {
                said("name", name, out);
                said("drive", drive, out);
                said("numbers", numbers, out);
            }
        }
    }
}

impl Stable for WrittenActuator {
    fn say(&self, out: &mut String) {
        match self {
            WrittenActuator::Motor {
                torque_constant,
                emf_constant,
                resistance,
                inductance,
                rotor_inertia,
                friction,
            } => {
                out.push_str("motor");
                [torque_constant, emf_constant, resistance, rotor_inertia, friction].map(f64::clone).say(out);
                inductance.say(out);
            }
            WrittenActuator::Linear { c, f, d, t, position } => {
                out.push_str("linear");
                [&c.value, f, d, t].into_iter().for_each(|matrix| matrix.say(out));
                position.say(out);
            }
        }
    }
}

printed! { bool usize f64 Duration }

worded! {
    String: text => &format!("{text:?}");
    ResultPart: part => &part.word();
    JointParameter: parameter => parameter.word();
    ContactFunction: function => function.name();
    Coordinate: coordinate => coordinate.name();
    EnvironmentKind: kind => EnvironmentKind::WORDS.iter().find(|w| w.1 == *kind).expect("every kind has a word").0;
    UserSurface: surface => &format!("{:?}", surface.name());
}

/// What every front names by words.
impl<T: Choice> Stable for T {
    fn say(&self, out: &mut String) {
        out.push_str(self.word());
    }
}

impl<T: Stable> Stable for Noted<T> {
    fn say(&self, out: &mut String) {
        self.value.say(out);
    }
}

impl<T: Stable> Stable for Option<T> {
    fn say(&self, out: &mut String) {
        match self {
            Some(value) => value.say(out),
            None => out.push('-'),
        }
    }
}

impl<T: Stable> Stable for [T] {
    fn say(&self, out: &mut String) {
        out.push('[');
        for value in self {
            value.say(out);
            out.push(',');
        }
        out.push(']');
    }
}

impl<T: Stable> Stable for Vec<T> {
    fn say(&self, out: &mut String) {
        self[..].say(out);
    }
}

impl<T: Stable, const N: usize> Stable for [T; N] {
    fn say(&self, out: &mut String) {
        self[..].say(out);
    }
}

impl<K: Stable, V: Stable> Stable for BTreeMap<K, V> {
    fn say(&self, out: &mut String) {
        for (key, value) in self {
            key.say(out);
            out.push('=');
            value.say(out);
            out.push(';');
        }
    }
}

macro_rules! tuple {
    ($($name:ident)*; $first:tt $($index:tt)*) => {
        impl<$($name: Stable),*> Stable for ($($name),*) {
            fn say(&self, out: &mut String) {
                out.push('(');
                self.$first.say(out);
                $(out.push(',');
                self.$index.say(out);)*
                out.push(')');
            }
        }
    };
}

tuple!(A B; 0 1);
tuple!(A B C; 0 1 2);

#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod tests {
    use super::*;
    use crate::diagnostic::{Diagnostics, Source};
    use crate::options::{scene_file, Options};

    const SCENE: &str = r#"
[outputs]
functions = ["inverse_dynamics"]
jacobian = { frames = ["tool"], part = "linear" }
contact = ["impact"]
[hold]
gravity = [0.0, 0.0, -1.62]
joints = { wrist = 0.25 }
[effects]
coulomb = "smooth"
coulomb_speed = 0.01
[numbers]
scalar = "f32"
[numbers.ranges]
qdd = 20.0
[budget.inverse_dynamics]
max_flops = 900
[[payload]]
name = "gripper"
frame = "tool"
mass = 0.35
com = [0.0, 0.0, 0.05]
inertia = { xx = 0.4, yy = 0.3, zz = 0.2 }
[[parameter]]
kind = "link"
link = "forearm"
[[drive]]
joint = "elbow"
motor = { torque_constant = 0.03, resistance = 0.5, rotor_inertia = 1e-5 }
stages = [{ ratio = 100.0, stiffness = 1.6e4 }]
[[contact]]
name = "pen"
frame = "tool"
object = { origin = [0.4, 0.1, 0.1], z = [0.0, 0.0, 1.0] }
constrained = ["pz"]
environment = { kind = "elastic", stiffness = 2e4, damping = 60.0 }
"#;

    fn text_of(scene: &str) -> String {
        let mut complaints = Diagnostics::new();
        let read = scene_file::read(&Source::new("scene.toml", scene), &mut complaints);
        read.unwrap_or_else(|| panic!("{}", complaints.render())).into_options(Options::default()).stable_text()
    }

    /// As generated files hash it: who changes this text changes the hash of every file that says any of it.
    pub fn the_text_is_as_it_was() {
        assert_eq!(Options::default().stable_text(), "{}");
        let text = [
            r#"{functions=[jacobian,inverse_dynamics,];"#,
            r#"scalar=f32;"#,
            r#"scene={outputs=jacobian={frames=["tool",];part=linear;};;"#,
            r#"gravity=constant[0.0,0.0,-1.62,];"#,
            r#"locked=[("wrist",0.25),];"#,
            r#"payload=[{name="gripper";frame="tool";mass=0.35;com=[0.0,0.0,0.05,];inertia=[0.4,0.0,0.0,0.3,0.0,0.2,];},];"#,
            r#"drive=[{name="elbow";joints=[("elbow",1.0),];actuator=motor[0.03,0.03,0.5,1e-5,0.0,]-;"#,
            r#"stages=[{ratio=100.0;stiffness=16000.0;damping=-;input_inertia=0.0;output_inertia=0.0;efficiency=-;},];efficiency=-;input_limit=-;current_limit=-;rotor=-;rating={};},];"#,
            r#"effects={coulomb=smooth0.01;};"#,
            r#"parameter=[link="forearm";,];"#,
            r#"contacts={contact=[{name="pen";frame="tool";axis=[0.0,0.0,1.0,];object={origin=[0.4,0.1,0.1,];z=[0.0,0.0,1.0,];x=[1.0,0.0,0.0,];};"#,
            r#"surface=plane;constrained=[pz,];free=[px,py,ax,ay,az,];friction=-;environment={kind=elastic;values=[20000.0,60.0,];};},];functions=[impact,];};"#,
            r#"budget=inverse_dynamics={max_flops=900;};;"#,
            r#"ranges={qdd=all{lower=-20.0;upper=20.0;};};};}"#,
        ];
        assert_eq!(text_of(SCENE), text.concat());
    }

    pub fn every_number_and_word_of_a_scene_counts() {
        let whole = text_of(SCENE);
        let mut changed = 0;
        for (old, new) in [("0.25", "0.26"), ("tool\"]", "hand\"]"), ("linear", "angular"), ("impact", "projection")] {
            assert_ne!(whole, text_of(&SCENE.replacen(old, new, 1)), "{old}");
            changed += 1;
        }
        for (at, _) in SCENE.match_indices(|c: char| c.is_ascii_digit() && c != '0') {
            let mut other = SCENE.to_string();
            let digit = SCENE[at..=at].parse::<u8>().expect("a digit");
            other.replace_range(at..=at, &(if digit == 9 { 8 } else { digit + 1 }).to_string());
            let is_name = SCENE[..at].ends_with('f') || SCENE[..at].ends_with("f3");
            if !is_name {
                assert_ne!(whole, text_of(&other), "{other}");
                changed += 1;
            }
        }
        assert!(changed > 20);
    }
}
