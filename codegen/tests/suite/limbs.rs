//! Identical limbs as lanes of one body: the physics of the second author, bounds of errors, and the bits that rustc makes.

use std::fmt::Write;
use std::path::Path;
use std::process::Command;
use straightline_codegen::certify::{certify, search, Effort};
use straightline_codegen::choices::{Lanes, LimbForm};
use straightline_codegen::compile::compile;
use straightline_codegen::diagnostic::Diagnostics;
use straightline_codegen::emit::fused;
use straightline_codegen::expr::evaluate;
use straightline_codegen::model::limbs::limbs;
use straightline_codegen::model::{load, ModelOptions};
use straightline_codegen::options::scene_file;
use straightline_codegen::options::Options;
use straightline_codegen::program::input_box::input_box;
use straightline_codegen::program::{program, TracedProgram};
use straightline_codegen::scene::{InputRange, JointRanges};
use straightline_codegen::verify::{bound, verify};
use straightline_codegen::{Function, Robot, Scalar, Source};
use straightline_core::trig;

pub const FORCES: [Function; 4] =
    [Function::InverseDynamics, Function::GravityForce, Function::BiasForce, Function::VelocityForce];

/// Numbers from −1 to 1.
pub struct Numbers(pub u64);

impl Numbers {
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        // short literals, and numbers that f32 has as well
        ((self.0 >> 44) as f64 / 524_288.0 - 1.0) as f32 as f64
    }

    fn triple(&mut self, scale: f64) -> [f64; 3] {
        [0; 3].map(|_| self.next() * scale)
    }
}

/// How limbs differ.
#[derive(Clone, Copy, PartialEq)]
pub enum Differ {
    /// Left ones are mirrored right ones.
    Mirrored,
    /// In every number.
    InAll,
}

/// A link with mass and all products of inertia.
pub fn link(name: &str, n: &mut Numbers, sign: f64) -> String {
    let ([x, y, z], [a, b, c]) = (n.triple(0.1), n.triple(0.002));
    format!(
        "<link name=\"{name}\"><inertial><origin xyz=\"{x} {} {z}\"/><mass value=\"{}\"/><inertia ixx=\"0.021\" \
         iyy=\"{}\" izz=\"0.018\" ixy=\"{}\" ixz=\"{b}\" iyz=\"{}\"/></inertial></link>",
        y * sign,
        1.5 + n.next(),
        0.024 + 0.002 * n.next(),
        a * sign,
        c * sign
    )
}

/// Limbs `name0`, `name1`, … on a link, of joints of these kinds about axes that are parallel to none, but every third parallel to
/// the one before it.
pub fn limbs_on(carrier: &str, name: &str, count: usize, kinds: &[&str], differ: Differ, seed: u64) -> String {
    let mut text = String::new();
    for limb in 0..count {
        let mut n = Numbers(if differ == Differ::Mirrored { seed } else { seed + limb as u64 });
        let sign = if differ == Differ::Mirrored && limb % 2 == 1 { -1.0 } else { 1.0 };
        let mut parent = carrier.to_string();
        for (j, kind) in kinds.iter().enumerate() {
            let (own, [x, y, z]) = (format!("{name}{limb}_{j}"), n.triple(0.3));
            let (turn, [u, v, w]) = (n.triple(1.5), n.triple(1.0));
            // where they hang on the carrier differs anyway
            let x = if j == 0 { x + 0.1 * limb as f64 } else { x };
            let (turn, axis) = match j % 3 {
                2 => ([0.0; 3], "0 1 0".to_string()),
                1 => (turn, "0 1 0".to_string()),
                _ => (turn, format!("{u} {} {w}", v * sign)),
            };
            text += &link(&own, &mut n, sign);
            let _ = write!(
                text,
                "<joint name=\"{own}_joint\" type=\"{kind}\"><parent link=\"{parent}\"/><child link=\"{own}\"/>\
                 <origin xyz=\"{x} {} {z}\" rpy=\"{} {} {}\"/><axis xyz=\"{axis}\"/>\
                 <dynamics damping=\"{}\" friction=\"{}\"/>\
                 <limit lower=\"-1\" upper=\"1\" velocity=\"2\" effort=\"50\"/></joint>",
                y * sign,
                turn[0] * sign,
                turn[1],
                turn[2] * sign,
                0.1 + 0.05 * n.next(),
                if j == 0 { 0.3 + 0.1 * n.next() } else { 0.0 },
            );
            parent = own;
        }
    }
    text
}

pub fn robot(links: &[String]) -> Source {
    Source::new("robot.urdf", format!("<robot name=\"limbs\">{}</robot>", links.concat()))
}

/// A body with three legs of two joints: for many scenes.
pub fn stool() -> Source {
    let base = link("base", &mut Numbers(13), 1.0);
    robot(&[base, limbs_on("base", "leg", 3, &["revolute"; 2], Differ::InAll, 17)])
}

/// A body with four mirrored legs.
pub fn quadruped() -> Source {
    let base = link("base", &mut Numbers(3), 1.0);
    robot(&[base, limbs_on("base", "leg", 4, &["revolute"; 3], Differ::Mirrored, 5)])
}

/// An arm with a hand of three fingers that differ in all numbers and slide, too, beside one of another kind.
pub fn hand() -> Source {
    let base = "<link name=\"base\"/>".to_string();
    let arm = limbs_on("base", "arm", 1, &["revolute", "prismatic", "revolute"], Differ::InAll, 7);
    let fingers =
        limbs_on("arm0_2", "finger", 3, &["revolute", "revolute", "revolute", "prismatic"], Differ::InAll, 11);
    robot(&[base, arm, fingers, limbs_on("arm0_2", "thumb", 1, &["prismatic", "revolute"], Differ::InAll, 23)])
}

/// Two kinds of limbs on one body, five and two.
pub fn crab() -> Source {
    let base = link("base", &mut Numbers(29), 1.0);
    let legs = limbs_on("base", "leg", 5, &["revolute", "revolute"], Differ::InAll, 31);
    robot(&[base, legs, limbs_on("base", "claw", 2, &["revolute", "prismatic", "revolute"], Differ::Mirrored, 41)])
}

/// Limbs on the world.
pub fn table() -> Source {
    robot(&["<link name=\"base\"/>".to_string(), limbs_on("base", "arm", 3, &["revolute"; 3], Differ::InAll, 53)])
}

pub fn options(floating_base: bool) -> Options {
    Options {
        functions: FORCES.to_vec(),
        limbs: LimbForm::Lanes,
        model: ModelOptions { floating_base, ..ModelOptions::default() },
        ..Options::default()
    }
}

fn in_lanes(source: &Source, function: Function, options: &Options) -> (Robot, TracedProgram) {
    let (model, complaints) = load(source, &options.model);
    let robot = Robot::new(model.unwrap_or_else(|| panic!("{}", complaints.render())));
    let program = program(&robot, &[], function, options);
    assert!(!program.graph.alike.is_empty());
    (robot, program)
}

#[track_caller]
pub fn agrees(source: &Source, options: &Options) {
    let generated = compile(source, options).unwrap_or_else(|errors| panic!("{errors}"));
    let verification = verify(source, &generated, options, (10, 7), || ()).expect("the reference reads the file");
    assert_eq!(verification.functions.len(), generated.items.len());
    for (name, worst) in &verification.functions {
        assert!(worst.error < bound(options.scalar), "{name}: {worst:?}");
    }
}

#[test]
fn limbs_are_found_by_what_they_are_like() {
    let found = |source: &Source, floating_base| {
        let model = load(source, &ModelOptions { floating_base, ..ModelOptions::default() }).0.expect("a sound file");
        limbs(&model).into_iter().map(|l| (l.carrier, l.bodies)).collect::<Vec<_>>()
    };
    let legs = vec![vec![1, 2, 3], vec![4, 5, 6], vec![7, 8, 9], vec![10, 11, 12]];
    assert_eq!(found(&quadruped(), true), [(Some(0), legs)]);
    let arms = vec![vec![0, 1, 2], vec![3, 4, 5], vec![6, 7, 8]];
    assert_eq!(found(&table(), false), [(None, arms)]);
    assert_eq!(
        found(&crab(), true).iter().map(|(c, b)| (*c, b.len())).collect::<Vec<_>>(),
        [(Some(0), 5), (Some(0), 2)]
    );
    assert_eq!(found(&hand(), false).iter().map(|(c, b)| (*c, b.len())).collect::<Vec<_>>(), [(Some(2), 3)]);
}

#[test]
fn lanes_are_what_the_second_author_says() {
    for (source, floating) in [(quadruped(), true), (hand(), false), (crab(), true), (table(), false)] {
        agrees(&source, &options(floating));
    }
    let torques = vec![Function::InverseDynamics];
    agrees(&hand(), &Options { scalar: Scalar::F32, functions: torques.clone(), ..options(false) });
    agrees(&crab(), &Options { fma: true, functions: torques, ..options(true) });
}

/// Blocks of a limb with itself and with what carries it are lanes; between limbs is nothing. Rolled, with parts of the results, with friction.
#[test]
fn derivatives_in_lanes_are_what_the_second_author_says() {
    let functions = vec![Function::InverseDynamicsDerivatives];
    for (source, form) in [(hand(), LimbForm::Rolled), (table(), LimbForm::Lanes)] {
        agrees(&source, &Options { limbs: form, functions: functions.clone(), ..options(false) });
    }
    let scene = "[outputs]\ninverse_dynamics_derivatives = { results = [\"dtau_dq\", \"h\"] }\n\
                 [effects]\ncoulomb = \"smooth\"\ncoulomb_speed = 0.2\n";
    let mut diagnostics = Diagnostics::new();
    let file = scene_file::read(&Source::new("scene.toml", scene), &mut diagnostics);
    let file = file.unwrap_or_else(|| panic!("{diagnostics}"));
    agrees(&stool(), &file.into_options(Options { functions, scalar: Scalar::F32, ..options(true) }));
}

#[test]
#[ignore = "slow proof: the second author's derivatives of two robots with many legs"]
fn slow_proof_that_derivatives_of_legs_in_lanes_are_what_the_second_author_says() {
    let functions = vec![Function::InverseDynamicsDerivatives];
    for (source, form) in [(quadruped(), LimbForm::Lanes), (crab(), LimbForm::Rolled)] {
        agrees(&source, &Options { limbs: form, functions: functions.clone(), ..options(true) });
    }
}

/// The same robot as an exporter writes it: places and axes of so many digits, every third number dust or nothing, turns by right
/// angles that are cut anywhere.
fn exported(source: &Source, seed: u64, digits: usize) -> Source {
    let random = &mut crate::written::Random(seed);
    let mut text = String::new();
    for (k, part) in source.text().split('"').enumerate() {
        let key = text.trim_end_matches(['=', '"']).rsplit(' ').next().unwrap_or_default().to_string();
        let number = |x: &str, random: &mut crate::written::Random| -> String {
            let x: f64 = x.parse().expect("a number");
            let x = match &key[..] {
                "rpy" => crate::written::cut(random.right_angle(), 1 + random.below(16)),
                _ if random.one_in(6) => 0.0,
                _ if random.one_in(5) => random.dust(),
                _ => crate::written::decimals(x, digits),
            };
            format!("{x:?}")
        };
        match k % 2 == 1 && ["xyz", "rpy"].contains(&&key[..]) {
            true => text += &part.split(' ').map(|x| number(x, random)).collect::<Vec<_>>().join(" "),
            false => text += part,
        }
        text.push('"');
    }
    text.pop();
    // an axis of dust and zeros alone is none
    Source::new("robot.urdf", text.replace("<axis xyz=\"0.0 0.0 0.0\"/>", "<axis xyz=\"0 0 1\"/>"))
}

#[test]
fn lanes_of_robots_as_exporters_write_them_are_what_the_second_author_says() {
    let robots: [(Source, bool, usize, Scalar); 3] =
        [(stool(), true, 1, Scalar::F64), (crab(), true, 3, Scalar::F64), (hand(), false, 9, Scalar::F32)];
    for ((source, floating, digits, scalar), seed) in robots.into_iter().zip([0, 2, 4]) {
        let functions = vec![Function::InverseDynamics, Function::GravityForce];
        agrees(&exported(&source, seed, digits), &Options { functions, scalar, ..options(floating) });
    }
}

/// What a scene holds of one limb and not of the others is a number of that limb.
#[test]
#[ignore = "slow proof: compiles four scenes in all forms"]
fn slow_proof_that_scenes_may_tell_limbs_apart() {
    let scenes = [
        "[hold]\ngravity = \"input\"\n[zero]\njoints_at_rest = [\"leg1_0_joint\", \"leg2_1_joint\"]",
        "[hold]\nbase = \"moving\"\n[zero]\nqdd = true\n[outputs]\nfunctions = [\"inverse_dynamics\"]",
        "[effects]\ncoulomb = \"smooth\"\ncoulomb_speed = 0.2\n[outputs]\nfunctions = [\"bias_force\"]\n\
         inverse_dynamics = { joints = [\"leg2_1_joint\", \"leg0_0_joint\"] }",
        "[[parameter]]\nkind = \"payload\"\nname = \"boot\"\nframe = \"leg2_1\"\n[outputs]\nfunctions = [\"inverse_dynamics\", \"gravity_force\"]",
    ];
    for text in scenes {
        let mut diagnostics = Diagnostics::new();
        let file = scene_file::read(&Source::new("scene.toml", text), &mut diagnostics);
        let file = file.unwrap_or_else(|| panic!("{text}\n{diagnostics}"));
        agrees(&stool(), &file.into_options(options(true)));
    }
}

/// Every bit of what a program prints, a line per state, is that of these operations. `main`: the program in Rust, with its name.
pub fn assert_bits(
    folder: &Path,
    (name, main): (&str, String),
    program: &TracedProgram,
    options: &Options,
    states: &[Vec<f64>],
) {
    let (file, binary) = (folder.join(format!("{name}.rs")), folder.join(name));
    std::fs::write(&file, main).expect("the program can be written");
    let mut rustc = Command::new(std::env::var("RUSTC").unwrap_or_else(|_| "rustc".to_string()));
    rustc.args(["--edition", "2021", "-C", "opt-level=3", "-A", "warnings", "-o"]).args([&binary, &file]);
    if options.fma {
        rustc.args(["-C", "target-feature=+avx2,+fma"]);
    }
    let built = rustc.output().expect("rustc runs");
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
    let output = Command::new(&binary).output().expect("the program runs");
    assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
    let printed = String::from_utf8(output.stdout).expect("text");
    assert_eq!(printed.lines().count(), states.len(), "{name}");
    for (state, line) in states.iter().zip(printed.lines()) {
        let compiled: Vec<f64> = line.split_whitespace().map(|x| x.parse().expect("a number")).collect();
        let expected: Vec<f64> = match (options.scalar, options.fma) {
            (Scalar::F64, false) => evaluate(&program.graph, state),
            (Scalar::F64, true) => {
                let sin_cos = |x| trig::sin_cos_of_sum_fused_f64(x, f64::mul_add);
                fused::evaluate((&program.graph, &program.schedule), state, f64::mul_add, sin_cos)
            }
            (Scalar::F32, _) => {
                let state: Vec<f32> = state.iter().map(|x| *x as f32).collect();
                // printed with as many digits as tell f32 apart
                let wide = |x: f32| format!("{x:e}").parse().expect("a number");
                evaluate::<f32>(&program.graph, &state).into_iter().map(wide).collect()
            }
        };
        assert_eq!(compiled, expected, "{name} at {state:?}");
    }
}

/// Every bit of what rustc makes of the loops is that of the program, of one state and of states in lanes.
#[test]
fn compiled_lanes_have_the_bits_of_their_program() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("limbs");
    std::fs::create_dir_all(&folder).expect("a folder for programs");
    let fused = cfg!(target_arch = "x86_64") && std::arch::is_x86_feature_detected!("fma");
    let cases = [
        ("quadruped", quadruped(), options(true)),
        ("crab", crab(), Options { scalar: Scalar::F32, ..options(true) }),
        ("hand", hand(), options(false)),
        ("fused_quadruped", quadruped(), Options { fma: true, ..options(true) }),
        ("rolled_quadruped", quadruped(), Options { limbs: LimbForm::Rolled, ..options(true) }),
        ("rolled_crab", crab(), Options { limbs: LimbForm::Rolled, scalar: Scalar::F32, ..options(true) }),
        ("rolled_fused_hand", hand(), Options { limbs: LimbForm::Rolled, fma: true, ..options(false) }),
    ];
    for (name, source, options) in cases.into_iter().filter(|(_, _, o)| fused || !o.fma) {
        let options = Options { functions: vec![Function::InverseDynamics], lanes: Some(Lanes::Standalone), ..options };
        let (robot, program) = in_lanes(&source, Function::InverseDynamics, &options);
        let (nq, nv, scalar) = (robot.model.nq(), robot.model.nv(), options.scalar.name());
        let mut n = Numbers(61);
        let states: Vec<Vec<f64>> = (0..8).map(|_| (0..nq + 2 * nv).map(|_| 2.0 * n.next()).collect()).collect();
        let text = compile(&source, &options).unwrap_or_else(|errors| panic!("{errors}")).text;
        assert!(text.contains("for limb in "), "{name} is written as a loop");
        let main = format!(
            "mod robot {{\n{text}\n}}\nfn main() {{\n    for x in {states:?} {{\n        let x = x.map(|x: f64| x as {scalar});\n        \
             let (q, qd, qdd) = (&x[..{nq}], &x[{nq}..{}], &x[{}..]);\n        let mut tau = [0.0; {nv}];\n        \
             robot::inverse_dynamics(q.try_into().unwrap(), qd.try_into().unwrap(), qdd.try_into().unwrap(), &mut tau);\n        \
             let wide = |x: &[{scalar}], k: usize| [x[k]; 2];\n        \
             let mut two = [[0.0; 2]; {nv}];\n        \
             robot::inverse_dynamics_lanes::<2>(&std::array::from_fn(|k| wide(q, k)), &std::array::from_fn(|k| wide(qd, k)), \
             &std::array::from_fn(|k| wide(qdd, k)), &mut two);\n        \
             for k in 0..{nv} {{\n            assert!(two[k] == [tau[k]; 2]);\n            print!(\"{{:e}} \", tau[k]);\n        }}\n        \
             println!();\n    }}\n}}\n",
            nq + nv,
            nq + nv
        );
        assert_bits(&folder, (name, main), &program, &options, &states);
    }
}

#[test]
fn lanes_need_core_alone() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("limbs");
    std::fs::create_dir_all(&folder).expect("a folder for programs");
    let text = compile(&quadruped(), &options(true)).unwrap_or_else(|errors| panic!("{errors}")).text;
    let file = folder.join("core_alone.rs");
    std::fs::write(&file, format!("#![no_std]\n#![forbid(unsafe_code)]\n#![deny(warnings)]\n{text}")).expect("a file");
    let mut rustc = Command::new(std::env::var("RUSTC").unwrap_or_else(|_| "rustc".to_string()));
    let built = rustc.args(["--edition", "2021", "--crate-type", "lib", "--emit", "metadata", "--out-dir"]);
    let built = built.args([&folder, &file]).output().expect("rustc runs");
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
}

#[test]
fn no_search_finds_an_error_above_its_bound() {
    for scalar in [Scalar::F64, Scalar::F32] {
        for (source, floating) in [(stool(), true), (hand(), false)] {
            for function in [Function::InverseDynamics, Function::GravityForce] {
                let mut options = Options { scalar, ..options(floating) };
                options.scene.ranges.qd = JointRanges::All(InputRange::within(1.0));
                options.scene.ranges.qdd = JointRanges::All(InputRange::within(2.0));
                options.scene.ranges.q = JointRanges::All(InputRange::within(1.0));
                let (robot, program) = in_lanes(&source, function, &options);
                let graph = &program.graph;
                let ranges = input_box(&graph.inputs, &options.scene, &robot.model).expect("every input has a range");
                let certificate = certify(graph, scalar, &ranges, Effort::default()).expect("forces have no division");
                let found = search::worst_found(graph, scalar, &ranges, 200, 1);
                for (k, (found, bound)) in found.iter().zip(&certificate.errors).enumerate() {
                    assert!(bound.is_finite() && found.error <= *bound, "{} {k}: {found:?} {bound:e}", function.name());
                }
            }
        }
    }
}

#[test]
fn auto_takes_what_is_faster() {
    let file = |name: &str| {
        let path = format!("{}/../robots/descriptions/{name}", env!("CARGO_MANIFEST_DIR"));
        Source::new(name, std::fs::read_to_string(path).expect("the file is there"))
    };
    for (name, function, lanes) in [
        ("solo12.urdf", Function::InverseDynamics, true),
        ("solo12.urdf", Function::InverseDynamicsDerivatives, true),
        ("solo12.urdf", Function::GravityForce, false),
        ("solo12.urdf", Function::MassMatrix, false),
        ("simple_humanoid.urdf", Function::GravityForce, false),
        ("simple_humanoid.urdf", Function::InverseDynamics, false),
        ("simple_humanoid.urdf", Function::InverseDynamicsDerivatives, true),
        ("panda.urdf", Function::InverseDynamics, false),
    ] {
        let options = Options { limbs: LimbForm::Auto, ..options(name != "panda.urdf") };
        let robot = Robot::new(load(&file(name), &options.model).0.expect("the file is sound"));
        let auto = program(&robot, &[], function, &options);
        assert_eq!(!auto.graph.alike.is_empty(), lanes, "{name} {}", function.name());
        if lanes {
            let counts = auto.graph.counts();
            // apart: 527, 488 and 647 with fused multiply-add, and 2105, 2055, 2643; an addition more per limb and number that limbs pass on, and
            // what one leg's zeros save that another has not
            let [mul, add, fma] = match (name, function) {
                (_, Function::InverseDynamics) => [559, 500, 663],
                ("solo12.urdf", _) => [2211, 2134, 2742],
                // apart: 9311, 7501, 10434; cut into loops, in which fewer products fuse
                _ => [9334, 7514, 10623],
            };
            assert!(counts.mul <= mul && counts.add <= add && counts.fma <= fma, "{name}: {counts:?}");
        } else {
            let apart = program(&robot, &[], function, &Options { limbs: LimbForm::Apart, ..options.clone() });
            assert_eq!(auto.graph, apart.graph);
        }
    }
}
