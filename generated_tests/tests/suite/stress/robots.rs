//! Robots under stress: those of the reference data in their limits, and chains with one property each.

use std::fmt::Write;
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::equations::Robot as Loaded;
use straightline_codegen::model::ModelOptions;
use straightline_codegen::verify::reference_input::centre_of_mass_tree;
use straightline_codegen::{description, Function};
use straightline_core::model::{JointKind, Model};
use straightline_core::reference::CentreOfMassTree;
use straightline_core::{Dd, Real};
use straightline_generated_tests::programs;
use straightline_generated_tests::random::Random;
use straightline_generated_tests::reference::Robot;
use straightline_generated_tests::search::Ranges;

/// A joint without limits is moved so far \[rad or m\].
const RANGE: f64 = std::f64::consts::PI;
/// Joints whose file has no greatest velocity move so fast \[rad/s or m/s\].
const VELOCITY: f64 = 3.0;
/// Accelerations that are tried \[rad/s² or m/s²\].
const ACCELERATION: f64 = 10.0;

/// A robot of the reference data with what is needed to judge it.
pub struct Judged {
    pub robot: Robot,
    pub loaded: Loaded,
    /// For natural scales, in f64: they need no more digits.
    pub tree: CentreOfMassTree<f64>,
}

impl Judged {
    pub fn new(name: &str) -> Judged {
        let robot = Robot::load(name);
        let (source, options) = (programs::source(&robot), programs::options(&robot).model);
        let described = description::read(&source, &mut Diagnostics::new()).expect("the reference's files can be read");
        let tree = centre_of_mass_tree(&described, &options).expect("the reference's robots are trees");
        Judged { loaded: programs::load(&source, &options), robot, tree: tree.map(Dd::to_f64) }
    }

    pub fn model(&self) -> &Model<Dd> {
        &self.loaded.model
    }

    /// The limits of a function's inputs, one after the other; a quaternion has yet to be made one.
    pub fn ranges(&self, function: Function) -> Ranges {
        ranges(self.model(), function)
    }

    /// Flat inputs in groups, the quaternion of length one.
    pub fn groups(&self, function: Function, flat: &[f64]) -> Vec<Vec<f64>> {
        let mut rest = flat;
        let ports = function.inputs(self.model(), 0);
        let mut groups: Vec<Vec<f64>> = ports
            .iter()
            .map(|port| {
                let (group, after) = rest.split_at(port.len());
                rest = after;
                group.to_vec()
            })
            .collect();
        if self.robot.floating {
            let quaternion = &mut groups[0][3..7];
            let norm = quaternion.iter().map(|x| x * x).sum::<f64>().sqrt();
            match norm > 0.0 {
                true => quaternion.iter_mut().for_each(|x| *x /= norm),
                false => quaternion[3] = 1.0,
            }
        }
        groups
    }

    /// A state in the limits, in groups.
    pub fn state(&self, function: Function, random: &mut Random) -> Vec<Vec<f64>> {
        self.groups(function, &self.ranges(function).anywhere(random))
    }
}

/// The limits of a function's inputs, one after the other.
pub fn ranges(model: &Model<Dd>, function: Function) -> Ranges {
    let mut ranges = Vec::new();
    for port in function.inputs(model, 0) {
        let mut group = vec![(0.0, 0.0); port.len()];
        for joint in model.free_joints() {
            let or = |limit: f64, other: f64| if limit.is_finite() { limit } else { other };
            let (first, size) = match port.name.as_str() {
                "q" => (joint.iq, joint.kind.nq()),
                _ => (joint.iv, joint.kind.nv()),
            };
            group[first..first + size].fill(match (port.name.as_str(), joint.kind) {
                (_, JointKind::Floating) => (-1.0, 1.0),
                ("q", _) => (or(joint.limits.lower, -RANGE), or(joint.limits.upper, RANGE)),
                ("qd", _) => (-or(joint.limits.velocity, VELOCITY), or(joint.limits.velocity, VELOCITY)),
                _ => (-ACCELERATION, ACCELERATION),
            });
        }
        ranges.extend(group);
    }
    Ranges(ranges)
}

/// A link of a chain; all numbers exact in f32, so that constants bring no error of their own.
#[derive(Clone, Debug)]
pub struct Link {
    pub offset: [f64; 3],
    pub axis: [f64; 3],
    pub mass: f64,
    pub com: [f64; 3],
    pub moments: [f64; 3],
    /// Further lines of the joint.
    pub joint: &'static str,
}

impl Link {
    /// A rod of 0.5 m along x that turns about z.
    pub fn rod(mass: f64) -> Link {
        let across = mass / 64.0;
        Link {
            offset: [0.5, 0.0, 0.0],
            axis: [0.0, 0.0, 1.0],
            mass,
            com: [0.25, 0.0, 0.0],
            moments: [across / 16.0, across, across],
            joint: "",
        }
    }

    /// The same about another axis.
    pub fn about(self, axis: [f64; 3]) -> Link {
        Link { axis, ..self }
    }

    /// The same, another time larger in mass and inertia.
    pub fn times(self, factor: f64) -> Link {
        Link { mass: self.mass * factor, moments: self.moments.map(|x| x * factor), ..self }
    }
}

/// The x, y and z axes in turn.
pub const AXES: [[f64; 3]; 3] = [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]];

/// A chain as a robot file.
pub fn file(links: &[Link]) -> Source {
    let mut text = String::from("[robot]\nname = \"chain\"\n[[link]]\nname = \"link0\"\n");
    for (i, link) in links.iter().enumerate() {
        let Link { offset, axis, mass, com, moments, joint } = link;
        let child = i + 1;
        let _ = writeln!(
            text,
            "[[link]]\nname = \"link{child}\"\nmass = {mass:?}\ncom = {com:?}\ninertia = {moments:?}\n[[joint]]\n\
             name = \"joint{child}\"\nkind = \"continuous\"\nparent = \"link{i}\"\nchild = \"link{child}\"\n\
             origin = {{ xyz = {offset:?} }}\naxis = {axis:?}\n{joint}"
        );
    }
    Source::new("chain.toml", text)
}

/// A chain as a model.
pub fn chain(links: &[Link]) -> Model<Dd> {
    programs::load(&file(links), &ModelOptions::default()).model
}

/// A model in a scalar, and the same numbers in double-double.
pub fn rounded_model<T: Real + Into<f64>>(model: &Model<Dd>) -> (Model<T>, Model<Dd>) {
    let narrow = model.cast::<T>();
    let wide = narrow.map(|x| Dd::from(x.into()));
    (narrow, wide)
}
