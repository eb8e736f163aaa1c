//! What is said where a program differs from the plain equations.

use super::LOSSES;
use crate::diagnostic::Diagnostic;
use crate::equations::reduce::longest_lever;
use crate::model::singular::weakest_joint;
use std::fmt;
use straightline_core::model::{BodyId, Model};
use straightline_core::Dd;
use straightline_graph::Scalar;

/// A difference of inertias that is so many roundings of them has hardly a digit.
const NO_DIGIT: f64 = 1e3;

/// How a program differs from the plain equations of its robot.
#[derive(Clone, Debug, PartialEq)]
pub struct Disagreement {
    /// The program's name.
    pub program: String,
    /// The result that differs most, such as `tau[2]`.
    pub result: String,
    /// By how much of its natural scale.
    pub difference: f64,
    /// What the plain equations lose to rounding in the same scalar, where that is what the program is compared with.
    pub plain: Option<f64>,
}

impl fmt::Display for Disagreement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Disagreement { program, result, difference, plain } = self;
        if let Some(plain) = plain {
            return write!(
                f,
                "`{program}` loses digits that the plain equations of the robot keep: {result} is off by {difference:.1e}, theirs by {plain:.1e}"
            );
        }
        if !difference.is_finite() {
            return write!(f, "`{program}` differs from the plain equations of the robot: {result} is no number");
        }
        write!(f, "`{program}` differs from the plain equations of the robot: {result} by {difference:.1e} of its natural scale")
    }
}

/// A program in another form than it would have had, as that one did not agree.
#[derive(Clone, Debug, PartialEq)]
pub struct Plainer {
    /// What was wrong.
    pub disagreement: Disagreement,
    /// The optimisation without which it is right.
    pub without: &'static str,
}

impl Plainer {
    /// What the user is told.
    pub fn warning(&self, model: &Model<Dd>) -> Diagnostic {
        let Plainer { disagreement, without } = self;
        Diagnostic::warning("plainer-form", format!("`{}` is written in a plainer form", disagreement.program))
            .detail(format!("{disagreement}; without “{without}” it agrees{}", suspect(model)))
            .help("the code is right, but takes more operations than it might: please report the robot file")
    }
}

impl Disagreement {
    /// Whether the plain equations themselves lose nearly all digits.
    pub(crate) fn is_of_the_robot(&self) -> bool {
        self.plain.is_some_and(|plain| LOSSES * plain >= 1.0)
    }

    /// Whether the plain equations themselves lose nearly all digits in this scalar, as inertias are too far apart: then no form is right.
    /// Which joint feels too little, and which part of what it moves.
    pub fn beyond_digits(&self, model: &Model<Dd>, scalar: Scalar) -> Option<(BodyId, f64)> {
        if !self.is_of_the_robot() {
            return None;
        }
        weakest_joint(model).filter(|(_, part)| *part <= NO_DIGIT * scalar.epsilon())
    }

    /// What the user is told where no form agrees.
    pub fn error(&self, model: &Model<Dd>) -> Diagnostic {
        Diagnostic::error(
            "internal-disagreement",
            format!("no form of `{}` is right: nothing is written", self.program),
        )
        .detail(format!("{self}{}", suspect(model)))
        .help("this is a fault of Straightline: please report it together with the robot file and the scene")
    }
}

/// The number that is probably behind it.
fn suspect(model: &Model<Dd>) -> String {
    let number = out_of_proportion(model);
    number.map_or(String::new(), |number| {
        format!("; of the robot's numbers the one most out of proportion is the {number}")
    })
}

/// The robot's number that is most out of proportion to its others, in words: where something is lost on the way, it is mostly this.
fn out_of_proportion(model: &Model<Dd>) -> Option<String> {
    let lever = longest_lever(model);
    let mass = model.bodies.iter().map(|b| b.inertia.mass.hi()).fold(0.0, f64::max);
    let mut worst: Option<(f64, String)> = None;
    for body in &model.bodies {
        let (p, c, i) = (body.placement.translation, body.inertia.com, body.inertia.inertia_com);
        let rotation = body.placement.rotation.rows.concat();
        let groups = [
            ("origin of joint", body.joint.name.as_str(), "m", p.to_array().to_vec(), lever),
            ("axes of joint", body.joint.name.as_str(), "", rotation, 1.0),
            ("mass of link", body.name.as_str(), "kg", vec![body.inertia.mass], mass),
            ("centre of mass of link", body.name.as_str(), "m", c.to_array().to_vec(), lever),
            (
                "inertia of link",
                body.name.as_str(),
                "kg·m²",
                vec![i.xx, i.xy, i.xz, i.yy, i.yz, i.zz],
                mass * lever * lever,
            ),
        ];
        for (what, name, unit, numbers, scale) in groups {
            for x in numbers.into_iter().map(Dd::hi).filter(|x| *x != 0.0) {
                let off = (x.abs() / scale).log10().abs();
                if off.is_finite() && worst.as_ref().is_none_or(|(most, _)| off > *most) {
                    worst = Some((off, format!("{what} `{name}`: {x:e} {unit}").trim_end().to_string()));
                }
            }
        }
    }
    worst.map(|(_, words)| words)
}
