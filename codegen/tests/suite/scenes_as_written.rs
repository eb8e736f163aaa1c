//! Robots as people and exporters write them, in scenes of any kind: what is compiled is right, and in the form that it was meant to have.
//!
//! Each compilation compares every program (functions, stages, contact modes, limbs, parameters, bounds at a state, mixed precision) with
//! its plain equations, and its text with the program. So a robot in a scene fails here where it is compiled in a plainer form or not at
//! all, or where what is compiled is not what the second author reads from robot file and scene.
//! `ROBOTS=500 SEED=7 STYLES=exported,digits4 cargo test --release -p straightline-codegen --test suite scenes_as_written:: -- --ignored --nocapture`

use crate::written::{decimals, Motion, Random, Shape, Style, Written};
use std::panic::AssertUnwindSafe;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::Mutex;
use straightline_codegen::certify::Effort;
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::options::scene_file;
use straightline_codegen::options::Options;
use straightline_codegen::verify::{bound, verify};
use straightline_codegen::{compile, Scalar};

/// A robot, and a scene for it.
struct Case {
    robot: Written,
    scene: String,
    options: Options,
    is_of_ratios: bool,
}

/// What came of a case.
enum Outcome {
    /// With the first complaint.
    Refused(String),
    Right,
    Wrong(String),
}

impl Case {
    fn new(style: Style, seed: u64, derivatives: Derivatives) -> Case {
        let random = &mut Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x5ce9e);
        let robot = Written::new(style, Shape::any(random, 5), seed);
        // of random numbers of their own: what else is in a scene does not depend on them
        let derivatives = derivatives.functions(&mut Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0xde71));
        let scene = scene_of(&robot, derivatives, random);
        let mut options = Options {
            scalar: random.one_of(&[Scalar::F64, Scalar::F64, Scalar::F32]),
            fma: random.one_in(5),
            ..Options::default()
        };
        if random.one_in(4) {
            options.certify = Some(Effort { companions: true, ..Effort::default() });
        }
        Case { robot, scene, options, is_of_ratios: style == Style::Ratios }
    }

    fn sources(&self) -> [Source; 2] {
        [Source::new(self.robot.file_name(), self.robot.text()), Source::new("scene.toml", self.scene.clone())]
    }

    fn outcome(&self) -> Outcome {
        let [robot, text] = self.sources();
        let mut diagnostics = Diagnostics::new();
        let Some(file) = scene_file::read(&text, &mut diagnostics) else { return Outcome::Wrong(diagnostics.render()) };
        let options = file.into_options(self.options.clone());
        let generated = match compile(&robot, &options) {
            Ok(generated) => generated,
            Err(errors) if errors.iter().any(|d| d.code.starts_with("internal")) => {
                return Outcome::Wrong(errors.render())
            }
            Err(errors) => return Outcome::Refused(errors.lines().swap_remove(0)),
        };
        // where masses are as 1 to 1e±20, the plain equations may have lost all digits themselves
        if !self.is_of_ratios && generated.warnings.iter().any(|d| d.code == "plainer-form") {
            return Outcome::Wrong(generated.warnings.render());
        }
        let verification = match verify(&robot, &generated, &options, (3, 11), || ()) {
            Ok(verification) => verification,
            Err(why) => return Outcome::Wrong(why),
        };
        let most = bound(options.scalar) / 8.0;
        match verification.functions.iter().find(|(_, worst)| worst.error.is_nan() || worst.error >= most) {
            Some((name, worst)) => Outcome::Wrong(format!("{name}: {worst:?}")),
            None => Outcome::Right,
        }
    }
}

/// A number as the scene's author would write it.
fn written(random: &mut Random, most: f64) -> f64 {
    match random.below(6) {
        0 => 0.0,
        1 => random.dust(),
        _ => decimals(random.between(-most, most), 1 + random.below(6)),
    }
}

fn list(random: &mut Random, most: f64) -> String {
    let [x, y, z] = std::array::from_fn(|_| written(random, most));
    format!("[{x:?}, {y:?}, {z:?}]")
}

/// How many scenes have functions more that are made when they are named.
#[derive(Clone, Copy)]
enum Derivatives {
    None,
    Some,
    All,
}

impl Derivatives {
    fn functions(self, random: &mut Random) -> &'static str {
        let is_wanted = match self {
            Derivatives::None => false,
            Derivatives::Some => random.one_in(3),
            Derivatives::All => true,
        };
        let of = [
            ", \"inverse_dynamics_derivatives\"",
            ", \"forward_dynamics_derivatives\"",
            ", \"inverse_dynamics_jvp\", \"inverse_dynamics_vjp\"",
            ", \"forward_dynamics_jvp\", \"forward_dynamics_vjp\"",
        ];
        if is_wanted {
            random.one_of(&of)
        } else {
            ""
        }
    }
}

/// Any scene that says something of every part, or nothing of it; with these functions more.
fn scene_of(robot: &Written, functions: &str, random: &mut Random) -> String {
    let tip = random.one_of(&robot.tips().iter().map(String::as_str).collect::<Vec<_>>()).to_string();
    let moving: Vec<usize> = (1..robot.links.len()).filter(|i| robot.links[*i].motion != Motion::Fixed).collect();
    let joint = |i: usize| format!("j{i}");
    let mut text = String::from("[outputs]\n");
    let others = random.one_of(&[
        "\"inverse_dynamics\", \"mass_matrix\"",
        "\"inverse_dynamics\", \"forward_dynamics\", \"jacobian\"",
        "\"forward_dynamics\", \"gravity_force\", \"joint_wrenches\"",
        "\"bias_force\", \"forward_kinematics\", \"mass_matrix\"",
    ]);
    text += &format!("functions = [{others}{functions}]\n");
    if random.one_in(3) {
        text += "staged = true\n";
    }
    let touches = random.one_in(4);
    if touches {
        text += "contact = [\"constrained_coordinates\", \"forward_dynamics\", \"inverse_dynamics\", \"impact\", \"projection\", \
                 \"forward_dynamics_derivatives\", \"impact_derivatives\"]\n";
    }
    let zero = random.one_of(&["", "", "", "qd = true\n", "qdd = true\n"]);
    if !zero.is_empty() && !touches {
        text += &format!("[zero]\n{zero}");
    }
    text += "[hold]\n";
    text += random.one_of(&["", "", "gravity = \"zero\"\n", "gravity = \"input\"\n", "gravity = [0.0, 0.3, -9.8]\n"]);
    text += random.one_of(&["", "", "", "base = \"floating\"\n", "base = \"fixed\"\n"]);
    if moving.len() > 1 && random.one_in(3) {
        let held = random.one_of(&moving);
        let [lower, upper] = robot.links[held].limits.map_or([-1.0, 1.0], |limits| [limits[0], limits[1]]);
        let at = match random.below(3) {
            0 => 0.0,
            1 => random.right_angle(),
            _ => decimals(random.between(lower, upper), 3),
        };
        text += &format!("joints = {{ {} = {:?} }}\n", joint(held), at.clamp(lower, upper));
    }
    if random.one_in(3) {
        let mass = random.one_of(&[1.0, 0.25, 2.5, 1e-4]);
        text += &format!("[[payload]]\nname = \"box\"\nframe = \"{tip}\"\nmass = {mass:?}\n");
        text += &format!("com = {}\ninertia = {{ xx = 0.011, yy = 0.009, zz = 0.006 }}\n", list(random, 0.2));
    }
    if random.one_in(3) {
        text += &format!("[[parameter]]\nkind = \"payload\"\nname = \"tool\"\nframe = \"{tip}\"\n");
    }
    if random.one_in(4) {
        text += &format!("[[parameter]]\nkind = \"link\"\nlink = \"l{}\"\n", random.one_of(&moving));
    }
    if random.one_in(4) {
        let driven = random.one_of(&moving);
        let stage = random.one_of(&["", ", stiffness = 7e3, input_inertia = 3e-6, output_inertia = 6e-5"]);
        text += &format!(
            "[[drive]]\njoint = \"{}\"\nmotor = {{ torque_constant = 0.0251, resistance = 0.464, rotor_inertia = 1.35e-5 }}\n\
             stages = [{{ ratio = {:?}{stage} }}]\n",
            joint(driven),
            random.one_of(&[100.0, 50.0, 12.5, -81.0])
        );
    }
    if touches {
        // what slides or gives way does so along its normal
        let held = random.one_of(&[
            "\"pz\"]\n",
            "\"px\", \"py\"]\n",
            "\"pz\"]\nenvironment = { kind = \"mass\", mass = 2.0, stiffness = 2e4, damping = 60.0 }\n",
            "\"pz\"]\nfriction = { coefficient = 0.2, speed = 0.005 }\n",
        ]);
        text += &format!(
            "[[contact]]\nname = \"pen\"\nframe = \"{tip}\"\nobject = {{ origin = {}, z = {} }}\nconstrained = [{held}",
            list(random, 0.5),
            random.one_of(&["[0.0, 0.0, 1.0]", "[-1.0, 0.0, 0.0]", "[0.6, 0.0, 0.8]"]),
        );
    }
    text + random.one_of(&["", "", "[numbers]\nangle_tolerance = 1e-4\n", "[numbers]\nangle_tolerance = 0.0\n"])
}

/// Judges so many cases by two threads; how many were refused, and why, by code.
fn all_are_right(count: u64, seed: u64, styles: &[Style], derivatives: Derivatives) -> usize {
    let next = AtomicU64::new(0);
    let found = Mutex::new((Vec::new(), Vec::new()));
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| loop {
                let k = next.fetch_add(1, Ordering::Relaxed);
                if k >= count {
                    break;
                }
                let case = Case::new(styles[k as usize % styles.len()], seed + k, derivatives);
                let outcome = std::panic::catch_unwind(AssertUnwindSafe(|| case.outcome()));
                let mut found = found.lock().expect("no thread panics");
                match outcome {
                    Ok(Outcome::Right) => {}
                    Ok(Outcome::Refused(why)) => found.0.push(why),
                    wrong => {
                        let why = match wrong {
                            Ok(Outcome::Wrong(why)) => why,
                            _ => "a panic".to_string(),
                        };
                        let [robot, scene] = case.sources();
                        let of = (seed + k, case.options.scalar, case.options.fma, case.options.certify.is_some());
                        println!("{of:?}: {why}\n{}\n{}", robot.text(), scene.text());
                        found.1.push(seed + k);
                    }
                }
            });
        }
    });
    let (refused, wrong) = found.into_inner().expect("no thread panics");
    println!("{count} robots in scenes, {} refused, {} wrong", refused.len(), wrong.len());
    refused.iter().take(20).for_each(|why| println!("  {why}"));
    assert!(wrong.is_empty(), "{wrong:?}");
    refused.len()
}

const STYLES: [Style; 4] = [Style::Digits(2), Style::Exported, Style::Round, Style::Digits(4)];

#[test]
fn robots_as_written_are_right_in_every_scene() {
    let refused = all_are_right(10, 5, &STYLES, Derivatives::None);
    assert!(refused < 5, "{refused}");
}

#[test]
fn derivatives_of_robots_as_written_are_right_in_every_scene() {
    let refused = all_are_right(2, 31, &STYLES, Derivatives::All);
    assert_eq!(refused, 0);
}

#[test]
#[ignore = "slow proof: derivatives of many robots in scenes"]
fn slow_proof_that_derivatives_of_many_robots_as_written_are_right_in_every_scene() {
    let refused = all_are_right(40, 100, &STYLES, Derivatives::All);
    assert!(refused < 20, "{refused}");
}

/// Contacts on or along the axis of a joint, whose zeros were judged by no scale; reactions whose bounds were compared with eigenvalues.
#[test]
fn what_was_wrong_once_is_right() {
    for (digits, seed) in [(2, 2), (3, 3), (14, 10013), (16, 184)] {
        all_are_right(1, seed, &[Style::Digits(digits)], Derivatives::None);
    }
}

#[test]
#[ignore = "minutes"]
fn very_many_robots_as_written_are_right_in_every_scene() {
    let asked = |name: &str, otherwise| std::env::var(name).map_or(otherwise, |text| text.parse().expect("a number"));
    let names = std::env::var("STYLES").unwrap_or_default();
    let all = Style::all().into_iter();
    let styles: Vec<Style> =
        all.filter(|style| names.is_empty() || names.split(',').any(|name| name == style.name())).collect();
    assert!(!styles.is_empty(), "no style is called `{names}`");
    let count = asked("ROBOTS", 500);
    let refused = all_are_right(count, asked("SEED", 1000), &styles, Derivatives::Some);
    assert!(refused as u64 * 2 < count, "{refused}");
}
