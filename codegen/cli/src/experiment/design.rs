//! Numbers of a robot file as run-time parameters of generated programs: inverse dynamics and joint forces for any values of them, and the
//! gradient with respect to them, traced and simplified once for a whole sweep or optimisation.
//!
//! A link's mass scales the link's share of the ten linear parameters of every body that the link is part of; the numbers of joints stand
//! in the equations as they are. What the scene leaves out stays out.

use super::parameter;
use straightline_codegen::description::{Description, JointDrive, Noted};
use straightline_codegen::diagnostic::Diagnostic;
use straightline_core::algorithms::{inverse_dynamics, joint_wrenches};
use straightline_core::model::{Coulomb, JointEffects, Load, Model};
use straightline_core::{Dd, Real};
use straightline_graph::expr::{gradient, Port, RuleSet};
use straightline_graph::pass::dead_code;
use straightline_graph::trace::{trace, Expr};
use straightline_jit::LoadedFunction;

/// The programs of a robot with some of its numbers as inputs, as machine code.
#[derive(Debug)]
pub struct Design {
    /// q, q̇, q̈, p to tau.
    torques: LoadedFunction<f64>,
    /// q, q̇, q̈, p to the wrenches of the joints, forces before moments.
    wrenches: LoadedFunction<f64>,
    /// q, q̇, q̈, p and a λ per joint to λᵀ ∂tau/∂p.
    gradient: LoadedFunction<f64>,
}

/// What is said of arrays whose lengths are those of the robot.
const FITTING: &str = "arrays are as long as the robot has joints and parameters";

/// What of the robot follows a parameter.
enum DesignChange {
    /// The link's share of each body, at the value `whole`.
    Mass { whole: f64, shares: Vec<(usize, Load<Dd>)> },
    /// An effect of the joint of a body.
    Effect { body: usize, key: String, drive: Box<JointDrive> },
    /// Nothing: the scene leaves it out.
    Nothing,
}

impl Design {
    /// The programs of the robot that `build` makes of a description, with the numbers of these paths as inputs.
    ///
    /// # Errors
    /// A path that the robot file does not have, or a robot that cannot be built.
    pub fn new(
        description: &Description,
        build: &dyn Fn(&Description) -> Option<Model<Dd>>,
        paths: &[&str],
    ) -> Result<Design, Box<Diagnostic>> {
        let unbuilt = |path: &str| Box::new(super::messages::unknown_parameter(path, "no robot comes of it"));
        let model = build(description).ok_or_else(|| unbuilt(paths.first().unwrap_or(&"")))?;
        let mut changes = Vec::new();
        for (i, path) in paths.iter().enumerate() {
            if paths[..i].contains(path) {
                return Err(Box::new(super::messages::unknown_parameter(path, "it is given twice")));
            }
            changes.push(change(description, &model, build, path)?.ok_or_else(|| unbuilt(path))?);
        }
        let n = model.nv();
        let ports = || {
            let of_joints = ["q", "qd", "qdd"].map(|name| Port::new(name, &[n]));
            of_joints.into_iter().chain([Port::new("p", &[changes.len()])]).collect::<Vec<Port>>()
        };
        let torques = trace(RuleSet::all(), ports(), vec![Port::new("tau", &[n])], |given| {
            inverse_dynamics(&with_inputs(&model, &changes, &given[3]), &given[0], &given[1], &given[2])
        });
        let wrenches = trace(RuleSet::all(), ports(), vec![Port::new("w", &[model.bodies.len(), 6])], |given| {
            let model = with_inputs(&model, &changes, &given[3]);
            let found = joint_wrenches(&model, &given[0], &given[1], &given[2]);
            found.iter().flat_map(|w| [w.force.to_array(), w.moment.to_array()].concat()).collect()
        });
        let gradient = dead_code(&gradient(&torques, "p"));
        Ok(Design {
            torques: LoadedFunction::of_graph("torques", &dead_code(&torques)),
            wrenches: LoadedFunction::of_graph("wrenches", &dead_code(&wrenches)),
            gradient: LoadedFunction::of_graph("gradient", &gradient),
        })
    }

    /// Joint torques or forces tau \[N·m or N\] of a motion for these values of the parameters.
    pub fn torques(&self, q: &[f64], qd: &[f64], qdd: &[f64], p: &[f64]) -> Vec<f64> {
        self.torques.results(&[q, qd, qdd, p]).expect(FITTING)
    }

    /// What every joint exerts on its link, force \[N\] and moment \[N·m\], in the order of the velocity coordinates.
    pub fn wrenches(&self, q: &[f64], qd: &[f64], qdd: &[f64], p: &[f64]) -> Vec<[f64; 6]> {
        let flat = self.wrenches.results(&[q, qd, qdd, p]).expect(FITTING);
        flat.chunks(6).map(|w| std::array::from_fn(|k| w[k])).collect()
    }

    /// λᵀ ∂tau/∂p.
    pub fn gradient(&self, q: &[f64], qd: &[f64], qdd: &[f64], p: &[f64], seed: &[f64]) -> Vec<f64> {
        self.gradient.results(&[q, qd, qdd, p, seed]).expect(FITTING)
    }
}

fn change(
    description: &Description,
    model: &Model<Dd>,
    build: &dyn Fn(&Description) -> Option<Model<Dd>>,
    path: &str,
) -> Result<Option<DesignChange>, Box<Diagnostic>> {
    let (owner, key) = path.rsplit_once('.').unwrap_or((path, ""));
    // the same robot with this number set to two values: what differs follows it
    let at = |value: f64| parameter::with(description, path, value).map(|changed| build(&changed));
    if key == "mass" {
        let (whole, double) = (at(1.0)?, at(2.0)?);
        let Some((whole, double)) = whole.zip(double) else { return Ok(None) };
        let bodies = whole.bodies.iter().zip(&double.bodies).enumerate();
        let shares = bodies.map(|(id, (one, two))| (id, two.total_about_origin() - one.total_about_origin()));
        let shares: Vec<(usize, Load<Dd>)> = shares.filter(|(_, load)| load.mass != Dd::ZERO).collect();
        return Ok(Some(DesignChange::Mass { whole: mass_of(description, owner), shares }));
    }
    let (some, more) = (at(1.0)?, at(2.0)?);
    let Some((some, more)) = some.zip(more) else { return Ok(None) };
    let differs = some.bodies.iter().zip(&more.bodies).any(|(a, b)| a.effects != b.effects);
    let body = model.bodies.iter().position(|body| body.joint.name == owner);
    Ok(Some(match body.filter(|_| differs) {
        Some(body) => {
            DesignChange::Effect { body, key: key.to_string(), drive: Box::new(drive_of(description, owner)) }
        }
        None => DesignChange::Nothing,
    }))
}

fn mass_of(description: &Description, link: &str) -> f64 {
    description.link(link).and_then(|link| link.inertial.as_ref()).map_or(0.0, |inertial| inertial.mass.value)
}

fn drive_of(description: &Description, joint: &str) -> JointDrive {
    description.joint(joint).map(|joint| joint.drive.clone()).unwrap_or_default()
}

/// The robot as the trace sees it.
fn with_inputs(model: &Model<Dd>, changes: &[DesignChange], inputs: &[Expr]) -> Model<Expr> {
    let mut traced: Model<Expr> = model.cast();
    for (change, p) in changes.iter().zip(inputs) {
        match change {
            DesignChange::Nothing => {}
            DesignChange::Mass { whole, shares } => {
                // what the file's value is there already
                let more = *p - Expr::constant(Dd::from(*whole));
                for (id, share) in shares {
                    traced.bodies[*id].carry(share.map(|x| Expr::constant(x) * more));
                }
            }
            DesignChange::Effect { body, key, drive } => {
                // a rotor's inertia and its gear stand in one number
                let given = |wanted: &str| {
                    let of = |(change, p): (&DesignChange, &Expr)| match change {
                        DesignChange::Effect { body: other, key, .. } if other == body && key == wanted => Some(*p),
                        _ => None,
                    };
                    changes.iter().zip(inputs).find_map(of)
                };
                let number =
                    |x: &Option<Noted<f64>>, none: f64| Expr::constant(Dd::from(x.as_ref().map_or(none, |x| x.value)));
                let rotor = given("rotor_inertia").unwrap_or_else(|| number(&drive.rotor_inertia, 0.0));
                let ratio = given("gear_ratio").unwrap_or_else(|| number(&drive.gear_ratio, 1.0));
                let effects = &mut traced.bodies[*body].effects;
                *effects = with_effect(effects, key, *p, rotor * ratio * ratio);
            }
        }
    }
    traced
}

fn with_effect(effects: &JointEffects<Expr>, key: &str, p: Expr, geared: Expr) -> JointEffects<Expr> {
    match key {
        "damping" => JointEffects { damping: p, ..*effects },
        "friction" => {
            let coulomb = match effects.coulomb {
                Coulomb::Smooth { speed, .. } => Coulomb::Smooth { force: p, speed },
                Coulomb::Off | Coulomb::Sign(_) => Coulomb::Sign(p),
            };
            JointEffects { coulomb, ..*effects }
        }
        "rotor_inertia" | "gear_ratio" => JointEffects { rotor_inertia: Some(geared), ..*effects },
        "armature" => JointEffects { rotor_inertia: Some(p), ..*effects },
        "spring_stiffness" => JointEffects { stiffness: p, ..*effects },
        "spring_rest" => JointEffects { spring_rest: p, ..*effects },
        _ => *effects,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use straightline_codegen::description;
    use straightline_codegen::diagnostic::{Diagnostics, Source};
    use straightline_codegen::model::{self, ModelOptions};
    use straightline_core::random::Random;

    const ARM: &str = r#"
[robot]
name = "arm"
[[link]]
name = "base"
[[link]]
name = "upper"
mass = 2.0
com = [0.02, 0.01, 0.2]
inertia = { xx = 0.02, yy = 0.021, zz = 0.004, xy = 0.001 }
flexible = { to = [0.0, 0.0, 0.4], segments = 2, bending = 40.0 }
[[link]]
name = "lower"
mass = 1.0
com = [0.0, 0.02, 0.15]
inertia = [0.008, 0.009, 0.002]
[[link]]
name = "gripper"
mass = 0.4
com = [0.0, 0.0, 0.05]
inertia = [0.001, 0.001, 0.0007]
[[joint]]
name = "shoulder"
kind = "continuous"
parent = "base"
child = "upper"
axis = "y"
damping = 0.2
friction = 0.3
rotor_inertia = 1e-4
gear_ratio = 50.0
[[joint]]
name = "elbow"
kind = "continuous"
parent = "upper"
child = "lower"
axis = "x"
origin = { xyz = [0.0, 0.0, 0.4] }
armature = 0.1
spring = { stiffness = 3.0, rest = 0.2 }
[[joint]]
name = "weld"
kind = "fixed"
parent = "lower"
child = "gripper"
origin = { xyz = [0.0, 0.0, 0.3], rpy_deg = [10, 20, 30] }
"#;

    const PATHS: [&str; 9] = [
        "upper.mass",
        "gripper.mass",
        "shoulder.damping",
        "shoulder.friction",
        "shoulder.rotor_inertia",
        "shoulder.gear_ratio",
        "elbow.armature",
        "elbow.spring_stiffness",
        "elbow.spring_rest",
    ];

    #[test]
    fn a_parameter_does_what_the_number_in_the_file_does() {
        let source = Source::new("arm.toml", ARM);
        let description = description::read(&source, &mut Diagnostics::new()).expect("a robot");
        let build = |d: &Description| model::build(d, &ModelOptions::default(), &mut Diagnostics::new());
        let mut random = Random(5);
        for path in PATHS {
            let design = Design::new(&description, &build, &[path]).expect("the file has it");
            for value in [0.7, 2.5] {
                let changed = parameter::with(&description, path, value).expect("the file has it");
                let model: Model<f64> = build(&changed).expect("a robot").cast();
                let n = model.nv();
                let [q, qd, qdd] = [0; 3].map(|_| (0..n).map(|_| random.symmetric(2.0)).collect::<Vec<f64>>());
                let (tau, expected) =
                    (design.torques(&q, &qd, &qdd, &[value]), inverse_dynamics(&model, &q, &qd, &qdd));
                let size = expected.iter().fold(1.0f64, |m, x| m.max(x.abs()));
                for (a, b) in tau.iter().zip(&expected) {
                    assert!((a - b).abs() < 1e-12 * size, "{path} = {value}: {tau:?} and {expected:?}");
                }
                let carried = joint_wrenches(&model, &q, &qd, &qdd);
                for (found, w) in design.wrenches(&q, &qd, &qdd, &[value]).iter().zip(&carried) {
                    let expected = [w.force.to_array(), w.moment.to_array()].concat();
                    let apart = found.iter().zip(&expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                    assert!(apart < 1e-11 * size, "{path} = {value}: {found:?} and {expected:?}");
                }
            }
        }
    }

    #[test]
    fn the_gradient_is_that_of_differences() {
        let source = Source::new("arm.toml", ARM);
        let description = description::read(&source, &mut Diagnostics::new()).expect("a robot");
        let build = |d: &Description| model::build(d, &ModelOptions::default(), &mut Diagnostics::new());
        let paths = PATHS;
        let design = Design::new(&description, &build, &paths).expect("the file has them");
        let (mut random, n) = (Random(8), build(&description).expect("a robot").nv());
        let [q, qd, qdd, seed] = [0; 4].map(|_| (0..n).map(|_| random.symmetric(2.0)).collect::<Vec<f64>>());
        let p = [2.2, 0.5, 0.1, 0.2, 2e-4, 40.0, 0.2, 5.0, 0.1];
        let found = design.gradient(&q, &qd, &qdd, &p, &seed);
        for i in 0..p.len() {
            let at = |h: f64| {
                let mut p = p;
                p[i] += h;
                design.torques(&q, &qd, &qdd, &p).iter().zip(&seed).map(|(a, b)| a * b).sum::<f64>()
            };
            let (h, size) = (1e-3 * p[i].max(1.0), at(0.0).abs().max(1.0));
            // every parameter stands in it at most as a square: central differences are exact but for rounding
            let expected = (at(h) - at(-h)) / (2.0 * h);
            assert!((found[i] - expected).abs() < 1e-11 * size / h, "{}: {} and {expected}", paths[i], found[i]);
        }
    }
}
