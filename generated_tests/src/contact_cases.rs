//! The contact, impact and environment cases of the reference data, for both authors.

use crate::reference::{description, folder};
use nalgebra::{Matrix3, Vector3};
use serde_json::Value;
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::equations::Robot as Loaded;
use straightline_codegen::model::ModelOptions;
use straightline_codegen::verify::reference_input::centre_of_mass_tree;
use straightline_core::contact::{Contact, Coordinate, Object, Surface};
use straightline_core::reference::{at_rest, CentreOfMassTree, Component, ContactFrames};
use straightline_core::spatial::{Mat3, Transform, Vec3};
use straightline_core::{reference as chapter, Dd};

/// A case with its numbers still as text.
#[derive(Debug)]
pub struct Case {
    /// Such as `contact/panda/07`.
    pub id: String,
    /// Of the data.
    pub robot: String,
    /// `surface`, `peg_in_hole`, …
    pub kind: String,
    /// Name of the frame on the robot.
    pub frame: String,
    /// The constrained coordinates.
    pub components: Vec<Coordinate>,
    data: Value,
}

/// All cases of a file: `contact`, `impact`, `environment` or `environment_impact`.
pub fn cases(kind: &str) -> Vec<Case> {
    let path = folder().join(format!("cases/{kind}.json"));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let file: Value = serde_json::from_str(&text).expect("the cases are JSON");
    let string = |v: &Value| v.as_str().expect("a string").to_string();
    let case = |data: &Value| {
        let constraint = &data["constraint"];
        let components = constraint["components"].as_array().expect("a list").iter().map(|name| {
            let name = string(name);
            Coordinate::ALL.into_iter().find(|c| c.name() == name).expect("a coordinate")
        });
        Case {
            id: string(&data["id"]),
            robot: string(&data["robot"]),
            kind: string(&constraint["kind"]),
            frame: string(&constraint["frame"]),
            components: components.collect(),
            data: data.clone(),
        }
    };
    file["cases"].as_array().expect("a list of cases").iter().map(case).collect()
}

/// A robot of the data for both authors: literal angles, so that the data's 25 digits are met.
///
/// # Panics
/// If its file has errors.
pub fn robot(name: &str) -> (Loaded, CentreOfMassTree<Dd>) {
    let path = description(name);
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let source = Source::new(&path.file_name().expect("a file").to_string_lossy(), text);
    let options = ModelOptions { angle_tolerance: 0.0, ..ModelOptions::default() };
    let loaded = crate::programs::load(&source, &options);
    let mut diagnostics = Diagnostics::new();
    let description = straightline_codegen::description::read(&source, &mut diagnostics);
    assert!(!diagnostics.has_errors(), "{}", diagnostics.render());
    let tree = centre_of_mass_tree(&description.expect("it has no errors"), &options).expect("it is a tree");
    (loaded, tree)
}

impl Case {
    /// Inputs, which are f64 numbers.
    pub fn input(&self, key: &str) -> Vec<f64> {
        list(&self.data[key])
    }

    /// An input of the constraint.
    pub fn of_constraint(&self, key: &str) -> [f64; 3] {
        list(&self.data["constraint"][key]).try_into().expect("a vector")
    }

    /// A parameter.
    pub fn parameter(&self, key: &str) -> f64 {
        self.data["params"][key].as_str().expect("a number").parse().expect("a number")
    }

    /// What is expected, with 25 digits, rows one after the other.
    pub fn expected(&self, key: &str) -> Vec<Dd> {
        numbers(&self.data[key])
    }

    /// Axes X, Y, Z of the object as columns.
    pub fn object_axes(&self) -> Matrix3<Dd> {
        let unit = |v: Vector3<Dd>| v / v.dot(&v).sqrt();
        let z = unit(wide(self.of_constraint("z")));
        let x = wide(self.of_constraint("x"));
        let x = unit(x - z * x.dot(&z));
        Matrix3::from_columns(&[x, z.cross(&x), z])
    }

    /// The tool axis, a unit vector in the frame's axes.
    pub fn axis(&self) -> Vector3<Dd> {
        let a = wide(self.of_constraint("a"));
        a / a.dot(&a).sqrt()
    }

    /// The contact of the generic runtime.
    pub fn contact(&self, robot: &Loaded) -> Contact<Dd> {
        let axes = self.object_axes();
        let column = |k: usize| Vec3::new(axes[(0, k)], axes[(1, k)], axes[(2, k)]);
        let pose = Transform {
            rotation: Mat3::from_columns(column(0), column(1), column(2)),
            translation: Vec3::from(self.of_constraint("origin")).map(Dd::from),
        };
        let a = self.axis();
        // any direction across the tool axis
        let b = a.cross(&Vector3::new(Dd::from(0.3), Dd::from(-0.5), Dd::from(0.8)));
        let b = b / b.dot(&b).sqrt();
        Contact {
            name: self.kind.clone(),
            frame: robot.model.frame(&self.frame).expect("the frame of the case").clone(),
            axis: Vec3::new(a.x, a.y, a.z),
            second_axis: Vec3::new(b.x, b.y, b.z),
            object: Object::Fixed(pose),
            surface: Surface::Plane,
            constrained: self.components.clone(),
            free: vec![],
            friction: None,
        }
    }

    /// The frames of the reference, and its names of the components.
    pub fn reference(&self, tree: &CentreOfMassTree<Dd>) -> (ContactFrames<Dd>, Vec<Component>) {
        let component = |c: &Coordinate| match c {
            Coordinate::Px => Component::Position(0),
            Coordinate::Py => Component::Position(1),
            Coordinate::Pz => Component::Position(2),
            Coordinate::Ax => Component::Axis(0),
            Coordinate::Ay => Component::Axis(1),
            Coordinate::Az => Component::SecondAxis(1),
        };
        let frames = ContactFrames {
            frame: tree.frame(&self.frame).expect("the frame of the case").clone(),
            axes: [self.axis(), self.axis()],
            origin: wide(self.of_constraint("origin")),
            object: self.object_axes(),
            motion: at_rest(),
            radius: Dd::ZERO,
        };
        (frames, self.components.iter().map(component).collect())
    }

    /// The largest error of a quantity against its largest component; of what may vanish, against what it is made of.
    pub fn scaled_error(&self, key: &str, computed: &[impl Into<Dd> + Copy]) -> f64 {
        let expected = self.expected(key);
        assert_eq!(computed.len(), expected.len(), "{key} of {}", self.id);
        let own = expected.iter().fold(0.0f64, |m, x| m.max(x.abs().hi()));
        let speed = self.input("qd").iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let least = match key {
            "s" | "J_c" | "J_6" => 1.0,
            "sd" | "dsd6" | "sd_after" => speed,
            "A_c" | "A_6" => speed * speed,
            "F" | "qdd" | "sdd" if self.id.starts_with("environment/") => self.spring_scale(key),
            _ => 0.0,
        };
        let error = computed.iter().zip(&expected).fold(0.0f64, |m, (x, y)| {
            let error = ((*x).into() - *y).abs().hi();
            if error.is_nan() {
                f64::INFINITY
            } else {
                m.max(error)
            }
        });
        if error == 0.0 {
            0.0
        } else {
            error / own.max(least)
        }
    }

    /// What a position or a velocity at its own scale (1 m, q̇) does through spring and damper: k · 1 m + b q̇ as a force, shared
    /// between the mass m_e and the robot, and what that force accelerates.
    fn spring_scale(&self, key: &str) -> f64 {
        let speed = self.input("qd").iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let (tree, jacobian) = (robot(&self.robot).1, self.expected("J_6"));
        let h = chapter::mass_matrix(&tree, &self.input("q").into_iter().map(Dd::from).collect::<Vec<Dd>>());
        let moved = chapter::solve_symmetric(&h, &nalgebra::DVector::from_column_slice(&jacobian));
        let inverse_mass = jacobian.iter().zip(moved.iter()).fold(Dd::ZERO, |sum, (j, x)| sum + *j * *x).hi();
        let force = (self.parameter("k") + self.parameter("b") * speed) / (1.0 + self.parameter("me") * inverse_mass);
        match key {
            "F" => force,
            "sdd" => inverse_mass * force,
            _ => moved.iter().fold(0.0f64, |m, x| m.max(x.abs().hi())) * force,
        }
    }
}

fn wide(v: [f64; 3]) -> Vector3<Dd> {
    let [x, y, z] = v.map(Dd::from);
    Vector3::new(x, y, z)
}

fn list(value: &Value) -> Vec<f64> {
    let parse = |x: &Value| x.as_str().expect("a decimal string").parse().expect("a number");
    value.as_array().expect("a list").iter().map(parse).collect()
}

fn numbers(value: &Value) -> Vec<Dd> {
    match value {
        Value::String(text) => vec![Dd::from_decimal(text).expect("a decimal number")],
        Value::Array(items) => items.iter().flat_map(numbers).collect(),
        other => panic!("numbers of the reference data are strings, not {other}"),
    }
}
