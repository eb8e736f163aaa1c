//! Accelerations and reactions against the bounds that their residual proves, alone and in contact, with a dense solution in double-double
//! as the truth; in f64 and f32.

use straightline_codegen::certify::residual::acceleration_bound;
use straightline_codegen::certify::search;
use straightline_codegen::compile::compile;
use straightline_codegen::diagnostic::Diagnostics;
use straightline_codegen::equations::Robot;
use straightline_codegen::expr::{evaluate, Graph};
use straightline_codegen::function::ContactFunction;
use straightline_codegen::model::{self, ModelOptions};
use straightline_codegen::options::scene_file;
use straightline_codegen::options::{Optimisations, Options};
use straightline_codegen::program::contact::{self, Mode};
use straightline_codegen::{Scalar, Source};
use straightline_core::Dd;

const BOTH: [Scalar; 2] = [Scalar::F32, Scalar::F64];

/// A robot in a mode of a scene, what is left of its equations, and the program that bounds errors.
struct Case {
    robot: Robot,
    options: Options,
    system: Graph,
    yielding: Vec<bool>,
    bound: Graph,
    n: usize,
    m: usize,
}

fn robot(file: &str, text: Option<String>, options: &Options) -> Robot {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/descriptions").join(file);
    let text =
        text.unwrap_or_else(|| std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display())));
    let (loaded, complaints) = model::load(&Source::new(file, text), &options.model);
    Robot::new(loaded.unwrap_or_else(|| panic!("{}", complaints.render())))
}

fn options(text: &str, floating_base: bool, scalar: Scalar) -> Options {
    let mut diagnostics = Diagnostics::new();
    let file = scene_file::read(&Source::new("scene.toml", text), &mut diagnostics);
    let model = ModelOptions { floating_base, ..ModelOptions::default() };
    let options = Options { model, scalar, ..Options::default() };
    file.unwrap_or_else(|| panic!("{}", diagnostics.render())).into_options(options)
}

/// Of the last mode of a scene; of the robot alone where it has none.
fn case(robot: Robot, options: Options) -> Case {
    // without the search for the cheapest form, which takes long
    let plain = Optimisations { chosen: false, ..options.optimisations() };
    let modes = Mode::all(&options.scene);
    let alone = Mode::alone();
    let mode = modes.last().unwrap_or(&alone);
    let (system, yielding) = contact::system(&robot, &options, mode, plain);
    let bound = acceleration_bound(&system, &yielding, options.scalar).expect("the program is short");
    let (n, m) = (system.outputs[0].len(), system.outputs[1].len());
    Case { robot, options, system, yielding, bound, n, m }
}

/// Numbers that are the same every time, from −1 to 1.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

fn rounded(x: f64, scalar: Scalar) -> f64 {
    if scalar == Scalar::F32 {
        f64::from(x as f32)
    } else {
        x
    }
}

/// Inputs of a system before q̈ and F: angles within 2, q̇ within 1, tau within 20, what else there is near 1.
fn state(case: &Case, random: &mut Numbers) -> Vec<f64> {
    let mut state = Vec::new();
    for port in case.system.inputs.iter().filter(|p| p.name != "qdd" && p.name != "force") {
        let of = |scale: f64, offset: f64, random: &mut Numbers| offset + scale * random.next();
        for k in 0..port.len() {
            state.push(match port.name.as_str() {
                "q" if case.options.model.floating_base && (3..7).contains(&k) => of(1.0, 0.0, random),
                "q" => of(2.0, 0.0, random),
                "tau" => of(20.0, 0.0, random),
                "qd" => of(1.0, 0.0, random),
                _ => of(0.25, 1.0, random),
            });
        }
        if port.name == "q" && case.options.model.floating_base {
            let first = state.len() - port.len() + 3;
            let norm = state[first..first + 4].iter().map(|x| x * x).sum::<f64>().sqrt();
            state[first..first + 4].iter_mut().for_each(|x| *x /= norm);
        }
    }
    state.into_iter().map(|x| rounded(x, case.options.scalar)).collect()
}

/// q̈, F in double-double: Gauss with exchange of rows on (H, −Ĵᵀ; κ J, σ), from the residual of zero. None of a singular system.
fn truth(case: &Case, state: &[f64]) -> Option<Vec<Dd>> {
    let (n, m) = (case.n, case.m);
    let mut inputs: Vec<Dd> = state.iter().map(|x| Dd::from(*x)).collect();
    inputs.resize(inputs.len() + n + m, Dd::ZERO);
    let all = evaluate::<Dd>(&case.system, &inputs);
    let (residual, rest) = all.split_at(n);
    let (missing, rest) = rest.split_at(m);
    let (h, rest) = rest.split_at(n * n);
    let (j, rest) = rest.split_at(m * n);
    let (applied, mass) = rest.split_at(m * n);
    let size = n + m;
    let mut a: Vec<Vec<Dd>> = (0..size)
        .map(|i| {
            (0..size)
                .map(|k| match (i < n, k < n) {
                    (true, true) => h[i * n + k],
                    (true, false) => -applied[(k - n) * n + i],
                    (false, true) if case.yielding[i - n] => mass[i - n] * j[(i - n) * n + k],
                    (false, true) => j[(i - n) * n + k],
                    (false, false) if i == k && case.yielding[i - n] => Dd::ONE,
                    (false, false) => Dd::ZERO,
                })
                .collect()
        })
        .collect();
    let mut b: Vec<Dd> = residual.iter().chain(missing).copied().collect();
    for k in 0..size {
        let size_of = |x: &Vec<Dd>| x[k].to_f64().abs();
        let pivot = (k..size).max_by(|x, y| size_of(&a[*x]).total_cmp(&size_of(&a[*y])))?;
        if size_of(&a[pivot]) == 0.0 {
            return None;
        }
        a.swap(k, pivot);
        b.swap(k, pivot);
        for i in k + 1..size {
            let factor = a[i][k] / a[k][k];
            let pivot_row = a[k].clone();
            for (x, y) in a[i].iter_mut().zip(&pivot_row).skip(k) {
                *x -= factor * *y;
            }
            b[i] = b[i] - factor * b[k];
        }
    }
    for i in (0..size).rev() {
        let known = (i + 1..size).fold(b[i], |sum, c| sum - a[i][c] * b[c]);
        b[i] = known / a[i][i];
    }
    Some(b)
}

/// What came of some states.
#[derive(Debug, Default)]
struct Outcome {
    proven: usize,
    all: usize,
    /// Logarithms of bound over error of right solutions, rounded.
    looseness: Vec<f64>,
}

/// Candidates are the rounded truth and that with errors; no bound may lie below an error.
fn check(case: &Case, name: &str, states: impl IntoIterator<Item = Vec<f64>>, random: &mut Numbers) -> Outcome {
    let scalar = case.options.scalar;
    let (n, m) = (case.n, case.m);
    let mut outcome = Outcome::default();
    for state in states {
        let Some(truth) = truth(case, &state) else { continue };
        for wrong in [0.0, 1e-6, 1e-2] {
            let candidate: Vec<f64> = truth
                .iter()
                .map(|x| {
                    let x = x.to_f64();
                    rounded(x + wrong * (1.0 + x.abs()) * random.next(), scalar)
                })
                .collect();
            let inputs = [state.clone(), candidate.clone()].concat();
            let bounds = search::computed_at(&case.bound, scalar, &inputs);
            outcome.all += 1;
            let errors: Vec<f64> =
                candidate.iter().zip(&truth).map(|(c, t)| (Dd::from(*c) - *t).to_f64().abs()).collect();
            let what = format!("{name}, {scalar:?}, {wrong:e} wrong, at {inputs:?}");
            for k in 0..n + m {
                // NaN proves nothing
                assert!(bounds[k].is_nan() || errors[k] <= bounds[k], "{what}: {k}, {:e} > {:e}", errors[k], bounds[k]);
            }
            if bounds.iter().any(|b| b.is_nan()) {
                continue;
            }
            outcome.proven += 1;
            if wrong == 1e-2 {
                let ratio = |k: usize| bounds[k] / errors[k];
                let ratios = (0..n + m).map(ratio).fold(f64::INFINITY, f64::min);
                outcome.looseness.push(ratios);
            }
        }
    }
    outcome.looseness.sort_by(f64::total_cmp);
    let middle = outcome.looseness.get(outcome.looseness.len() / 2);
    println!(
        "{name}, {scalar:?}: {} of {} proven, wrong solutions {middle:.1?} times too wide, {} operations",
        outcome.proven,
        outcome.all,
        case.bound.counts().flops()
    );
    outcome
}

fn on_random_states(case: &Case, name: &str, count: usize) -> Outcome {
    let mut random = Numbers(11);
    let states: Vec<Vec<f64>> = (0..count).map(|_| state(case, &mut random)).collect();
    check(case, name, states, &mut random)
}

/// `n` equal links, axes turned by a quarter from each to the next where `turned`.
fn chain(n: usize, turned: bool) -> String {
    let mut text = String::from("<robot name=\"chain\"><link name=\"l0\"/>");
    for k in 1..=n {
        let (axis, parent) = (if turned && k % 2 == 0 { "0 0 1" } else { "0 1 0" }, k - 1);
        text.push_str(&format!(
            "<link name=\"l{k}\"><inertial><origin xyz=\"0.1 0.01 0.02\"/><mass value=\"1\"/><inertia ixx=\"0.001\" iyy=\"0.004\" \
             izz=\"0.004\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link><joint name=\"j{k}\" type=\"continuous\"><parent \
             link=\"l{parent}\"/><child link=\"l{k}\"/><origin xyz=\"0.2 0 0\"/><axis xyz=\"{axis}\"/></joint>"
        ));
    }
    text + "</robot>"
}

#[test]
fn accelerations_of_arms_legs_and_chains_lie_within_their_bounds() {
    for scalar in BOTH {
        for (file, floating, text, least) in [
            ("panda.urdf", false, None, 60),
            ("solo12.urdf", true, None, 60),
            ("hyq.urdf", true, None, 60),
            ("simple_humanoid.urdf", true, None, 60),
            ("chain24.urdf", false, Some(chain(24, true)), 0),
        ] {
            let options = options("", floating, scalar);
            let case = case(robot(file, text, &options), options);
            assert_eq!(case.m, 0);
            let outcome = on_random_states(&case, file, 20);
            assert!(outcome.proven >= least || scalar == Scalar::F32, "{file}: {outcome:?}");
            if scalar == Scalar::F64 {
                assert_eq!(outcome.proven, outcome.all, "{file}");
            }
        }
    }
}

const OBJECT: &str = "object = { origin = [0.5, 0.1, 0.2], z = [0.1, 0.2, 1.0], x = [1.0, 0.0, 0.0] }\n";

fn contact_of(frame: &str, more: &str) -> String {
    format!("[[contact]]\nname = \"{frame}\"\nframe = \"{frame}\"\n{OBJECT}{more}\n")
}

#[test]
fn accelerations_and_reactions_in_contact_lie_within_their_bounds() {
    let peg = "constrained = [\"px\", \"py\", \"ax\", \"ay\"]";
    let sphere = "constrained = [\"pz\"]\nsurface = { kind = \"sphere\", radius = 0.25 }";
    let rough = "constrained = [\"pz\", \"ax\"]\nfriction = { coefficient = 0.4, speed = 0.02 }";
    let soft =
        "constrained = [\"pz\", \"ax\"]\nenvironment = { kind = \"elastic\", stiffness = 500.0, damping = 12.0 }";
    let heavy = "constrained = [\"py\", \"pz\"]\n\
                 environment = { kind = \"two_masses\", mass = 1.5, stiffness = 500.0, damping = 12.0, front_stiffness = 800.0, \
                 front_damping = 7.0, front_mass = 0.25 }";
    let stabilised = "[stabilisation]\nfrequency = 20.0\n";
    let feet: String = ["FL_FOOT", "FR_FOOT", "HL_FOOT", "HR_FOOT"]
        .map(|foot| contact_of(foot, "constrained = [\"px\", \"py\", \"pz\"]"))
        .concat();
    let feet = feet + "[[mode]]\nname = \"all\"\ncontacts = [\"FL_FOOT\", \"FR_FOOT\", \"HL_FOOT\", \"HR_FOOT\"]\n";
    let cases: [(&str, &str, bool, String); 8] = [
        ("plane", "ur5.urdf", false, contact_of("tool0", "constrained = [\"pz\"]") + stabilised),
        ("peg", "panda.urdf", false, contact_of("panda_link8", peg)),
        ("sphere", "ur5.urdf", false, contact_of("tool0", sphere)),
        ("friction", "ur5.urdf", false, contact_of("tool0", rough)),
        ("elastic", "ur5.urdf", false, contact_of("tool0", soft)),
        ("two masses", "ur5.urdf", false, contact_of("tool0", heavy)),
        (
            "weld",
            "panda.urdf",
            false,
            contact_of("panda_link8", "constrained = [\"px\", \"py\", \"pz\", \"ax\", \"ay\", \"az\"]"),
        ),
        ("four feet", "solo12.urdf", true, feet),
    ];
    for scalar in BOTH {
        for (name, file, floating, scene) in &cases {
            let options = options(scene, *floating, scalar);
            let case = case(robot(file, None, &options), options);
            assert!(case.m > 0);
            let outcome = on_random_states(&case, name, 20);
            match scalar {
                Scalar::F64 => assert_eq!(outcome.proven, outcome.all, "{name}"),
                Scalar::F32 => assert!(2 * outcome.proven >= outcome.all, "{name}: {outcome:?}"),
            }
        }
    }
}

/// Truth here and the motion that is generated are the same: its regularisation is refined away.
#[test]
fn the_motion_that_is_generated_lies_within_its_bound() {
    let scene = contact_of("tool0", "constrained = [\"pz\", \"ax\"]");
    for scalar in BOTH {
        let options = options(&scene, false, scalar);
        let case = case(robot("ur5.urdf", None, &options), options);
        let modes = Mode::all(&case.options.scene);
        let motion = contact::graph(&case.robot, &case.options, &modes[0], ContactFunction::ForwardDynamics);
        let mut random = Numbers(5);
        for _ in 0..20 {
            let state = state(&case, &mut random);
            let truth = truth(&case, &state).expect("two rows of six joints are independent");
            let computed = search::computed_at(&motion, scalar, &state)[..case.n + case.m].to_vec();
            let bounds = search::computed_at(&case.bound, scalar, &[state.clone(), computed.clone()].concat());
            for k in 0..case.n + case.m {
                let error = (Dd::from(computed[k]) - truth[k]).to_f64().abs();
                assert!(error <= bounds[k] || bounds[k].is_nan(), "{k}: {error:e} > {:e} at {state:?}", bounds[k]);
                let scale = truth.iter().map(|x| x.to_f64().abs()).fold(1.0, f64::max);
                // some thousand roundings
                assert!(scalar == Scalar::F32 || bounds[k] < 1e-9 * scale, "{k}: {:e} at {state:?}", bounds[k]);
            }
        }
    }
}

/// A stretched arm cannot be moved along itself: the reaction grows, its bound with it, and in the end nothing is proven.
#[test]
fn bounds_widen_towards_a_singular_contact_and_end_there() {
    for scalar in BOTH {
        let scene =
            "[[contact]]\nname = \"wall\"\nframe = \"tip\"\nobject = { origin = [0.5, 0.1, 0.2], z = [1.0, 0.0, 0.0], \
                     x = [0.0, 0.0, 1.0] }\nconstrained = [\"pz\"]\n";
        let options = options(scene, false, scalar);
        let case = case(robot("planar2r.urdf", None, &options), options);
        let mut random = Numbers(3);
        let states = |far: f64| -> Vec<Vec<f64>> {
            let stretched = [[0.0, far], [far, -2.0 * far], [far, 0.3 * far]];
            stretched
                .map(|q| [&q[..], &[0.5, -0.25], &[1.0, 2.0]].concat())
                .map(|s| s.into_iter().map(|x| rounded(x, scalar)).collect())
                .into()
        };
        let mut proven = Vec::new();
        for exponent in 1..=16 {
            let far = 10f64.powi(-exponent);
            let outcome = check(&case, &format!("{far:e} from stretched"), states(far), &mut random);
            proven.push(outcome.proven == outcome.all);
        }
        // once too near, always too near
        assert!(proven.windows(2).all(|w| w[0] || !w[1]), "{proven:?}");
        let (some, none) = if scalar == Scalar::F64 { (12, 16) } else { (4, 8) };
        assert!(proven[some - 1] && !proven[none - 1], "{scalar:?}: {proven:?}");
    }
}

#[test]
fn of_redundant_contacts_nothing_is_proven_but_the_mass_matrix_is() {
    let twice = contact_of("tool0", "constrained = [\"pz\"]")
        + &contact_of("tool0", "constrained = [\"pz\"]").replace("name = \"tool0\"", "name = \"again\"")
        + "[[mode]]\nname = \"both\"\ncontacts = [\"tool0\", \"again\"]\n";
    for scalar in BOTH {
        let options = options(&twice, false, scalar);
        let case = case(robot("ur5.urdf", None, &options), options);
        let mut random = Numbers(9);
        for _ in 0..5 {
            let inputs = [state(&case, &mut random), vec![0.0; case.n + case.m]].concat();
            let bounds = search::computed_at(&case.bound, scalar, &inputs);
            let (errors, eigenvalues) = bounds.split_at(case.n + case.m);
            assert!(errors.iter().all(|b| !b.is_finite()), "{bounds:?}");
            assert!(eigenvalues[0] > 0.0 && (eigenvalues[1].is_nan() || eigenvalues[1] == 0.0), "{bounds:?}");
        }
    }
}

/// What rustc makes of the text is the program that was analysed, in a module of f64 and one of f32.
#[test]
fn the_text_of_a_bound_computes_its_bits() {
    let scene = contact_of("tool0", "constrained = [\"pz\", \"ax\"]")
        + "[outputs]\nfunctions = [\"forward_dynamics\"]\ncontact = [\"forward_dynamics\"]\n[numbers]\nscalar = [\"f64\", \"f32\"]\n\
           certify_state = true\n";
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/descriptions/ur5.urdf");
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let whole = options(&scene, false, Scalar::F64);
    let generated = compile(&Source::new("ur5.urdf", text), &whole).unwrap_or_else(|e| panic!("{}", e.render()));
    let mut main = String::new();
    let mut expected = Vec::new();
    for (scalar, module) in [(Scalar::F64, ""), (Scalar::F32, "single::")] {
        let options = Options { scalar, also: Vec::new(), ..whole.clone() };
        let robot = robot("ur5.urdf", None, &options);
        let modes = Mode::all(&options.scene);
        let (system, yielding) = contact::system(&robot, &options, &modes[0], options.optimisations());
        let bound = acceleration_bound(&system, &yielding, scalar).expect("the program is short");
        let input: Vec<f64> = (0..26).map(|k| f64::from(((0.3 + 0.17 * f64::from(k)).sin()) as f32)).collect();
        expected.extend(search::computed_at(&bound, scalar, &input));
        let part = |range: std::ops::Range<usize>| format!("{:?}", &input[range]);
        main.push_str(&format!(
            "{{ type T = {}; let (mut a, mut f, mut h, mut c) = ([0.0 as T; 6], [0.0 as T; 2], [0.0 as T], [0.0 as T]);\n\
             {module}contact::tool0::forward_dynamics_error_bound(&{}, &{}, &{}, &{}, &{}, &mut a, &mut f, &mut h, &mut c);\n\
             for x in a.iter().chain(&f).chain(&h).chain(&c) {{ println!(\"{{:e}}\", f64::from(*x)); }} }}\n",
            scalar.name(),
            part(0..6),
            part(6..12),
            part(12..18),
            part(18..24),
            part(24..26)
        ));
    }
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("acceleration_bounds");
    std::fs::create_dir_all(&folder).expect("a folder for the program");
    let (source, binary) = (folder.join("main.rs"), folder.join("main"));
    std::fs::write(&source, format!("{}\nfn main() {{\n{main}}}\n", generated.text)).expect("the program is written");
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let mut command = std::process::Command::new(rustc);
    command.args(["--edition", "2021", "-C", "opt-level=1", "-A", "warnings", "-o"]).arg(&binary).arg(&source);
    let compiled = command.output().expect("rustc runs");
    assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
    let ran = std::process::Command::new(&binary).output().expect("the program runs");
    let found: Vec<f64> = String::from_utf8_lossy(&ran.stdout).lines().map(|l| l.parse().expect("a number")).collect();
    assert_eq!(found, expected);
    assert!(found.iter().all(|x| *x > 0.0), "{found:?}");
}
