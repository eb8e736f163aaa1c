//! The reference data of `reference/`: eleven robots, 40 states each, values with 25 digits; and of `reference/joints/`: fifteen robots whose joints follow others, are balls,
//! stand several in a body, or close loops.
//!
//! How an error is judged: `scaled = |computed − expected| / scale`, the worst over the components of an output.
//!
//! | output | scale of a component |
//! |---|---|
//! | tau, h, g, C, fd_qdd | the sum of the moduli of its terms, given with the data; the largest component where it is not |
//! | H | √(H_ii H_jj), the Cauchy-Schwarz bound of the component |
//! | T | T, a sum of squares |
//! | V | the largest \|V\| of the robot's states: V itself passes through zero |
//! | wrench | the largest of the six numbers of that joint |
//! | p, R, J, Jdqd | the largest component of that quantity of that frame |
//! | rates of dependent joints, G | the largest component |
//! | accelerations of dependent joints | the largest component, or the square of the largest rate |
//! | q of closed loops | the largest component, or 1 |
//! | gaps of closed loops | 1 m |
//! | velocity and acceleration of a frame | Σ \|J\| \|q̇\|; Σ \|J\| \|q̈\| plus that of Jdqd |

use crate::bounds;
use serde_json::Value;
use std::path::{Path, PathBuf};
use straightline_codegen::function::truth::Chapter;
use straightline_codegen::function::Quantity;
use straightline_codegen::Function;
use straightline_core::reference::CentreOfMassTree;
use straightline_core::Dd;

/// The eleven robots of the data.
pub const ROBOTS: [&str; 11] = [
    "planar2r",
    "chapter_cylindrical",
    "chapter_stanford",
    "chapter_6r",
    "chapter_oblique",
    "puma560",
    "ur5",
    "panda",
    "solo12",
    "hyq",
    "simple_humanoid",
];

/// The robots of `reference/joints/`, each with its file.
pub const JOINTS: [(&str, &str); 15] = [
    ("mimic_gripper", "urdf"),
    ("mimic_chain", "urdf"),
    ("mimic_screw", "urdf"),
    ("mimic_tree", "urdf"),
    ("mimic_float", "urdf"),
    ("ball_pendulum", "xml"),
    ("ball_chain", "xml"),
    ("ball_float", "xml"),
    ("multi_planar", "xml"),
    ("multi_arm", "xml"),
    ("loop_fourbar", "xml"),
    ("loop_palletiser", "xml"),
    ("loop_ankle", "xml"),
    ("loop_ankle_float", "xml"),
    ("loop_leg", "xml"),
];

/// A robot with its states.
#[derive(Debug)]
pub struct Robot {
    /// The stem of its files, `states/NAME.json`.
    pub name: String,
    /// Its description.
    pub file: PathBuf,
    /// Whether its root link is free.
    pub floating: bool,
    /// The frames that are evaluated.
    pub frames: Vec<String>,
    /// Joints in the order of q, qd and tau.
    pub joints: Vec<String>,
    /// Number of velocity coordinates.
    pub nv: usize,
    /// Its states.
    pub states: Vec<State>,
    largest_potential_energy: f64,
    baseline: Value,
    /// What the baseline calls functions and parts of their results.
    key: fn(Function) -> &'static [&'static str],
}

/// A state with all that is expected in it.
#[derive(Debug)]
pub struct State {
    /// Such as `panda/07`.
    pub id: String,
    /// Such as `random` or `at_limits_mixed`.
    pub kind: String,
    /// Configuration; of closed loops, rounded from 25 digits.
    pub q: Vec<f64>,
    /// Of closed loops: a configuration near it, with the same independent coordinates.
    pub start: Option<Vec<f64>>,
    /// Velocities.
    pub qd: Vec<f64>,
    /// Accelerations.
    pub qdd: Vec<f64>,
    /// Drives of the forward dynamics.
    pub fd_tau: Vec<f64>,
    /// Gravity, where it is not the robot's own.
    pub gravity: Option<[f64; 3]>,
    data: Value,
}

/// What an output should be, and against what an error is judged.
#[derive(Clone, Debug)]
pub struct Expected {
    /// One value per component, with 25 digits.
    pub values: Vec<Dd>,
    /// One scale per component.
    pub scales: Vec<f64>,
}

/// The folder of the reference data.
pub fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("reference")
}

/// The description of a robot of [`ROBOTS`].
pub fn description(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/descriptions");
    let extension = if name.starts_with("chapter_") { "toml" } else { "urdf" };
    folder.join(format!("{name}.{extension}"))
}

/// A file of the reference data.
pub fn json(path: &Path) -> Value {
    let text = std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    serde_json::from_str(&text).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// All numbers in a JSON value, depth first.
pub fn numbers(value: &Value) -> Vec<Dd> {
    match value {
        Value::String(text) => vec![Dd::from_decimal(text).expect("a decimal number")],
        Value::Array(items) => items.iter().flat_map(numbers).collect(),
        other => panic!("numbers of the reference data are strings, not {other}"),
    }
}

/// Inputs, which are exact f64 values.
pub fn inputs(value: &Value) -> Vec<f64> {
    match value {
        Value::String(text) => vec![text.parse().expect("a number")],
        Value::Array(items) => items.iter().flat_map(inputs).collect(),
        other => panic!("inputs of the reference data are strings, not {other}"),
    }
}

fn strings(value: &Value) -> Vec<String> {
    value.as_array().expect("a list").iter().map(|x| x.as_str().expect("a string").to_string()).collect()
}

fn largest(values: &[Dd]) -> f64 {
    values.iter().fold(0.0, |m: f64, x| m.max(x.to_f64().abs()))
}

impl Robot {
    /// The robot of that name of [`ROBOTS`] with all its states.
    pub fn load(name: &str) -> Robot {
        let baseline = json(&folder().join("baseline_pinocchio.json"));
        Robot::of_folder((&folder(), description(name)), name, &baseline, by_pinocchio)
    }

    /// The robot of that name of [`JOINTS`] with all its states.
    pub fn with_joints(name: &str) -> Robot {
        let folder = folder().join("joints");
        let (_, extension) = JOINTS.iter().find(|robot| robot.0 == name).expect("a robot of the list");
        let file = folder.join("robots").join(format!("{name}.{extension}"));
        Robot::of_folder((&folder, file), name, &json(&folder.join("baseline_float.json")), by_plain_evaluation)
    }

    fn of_folder(
        (folder, description): (&Path, PathBuf),
        name: &str,
        baseline: &Value,
        key: fn(Function) -> &'static [&'static str],
    ) -> Robot {
        let file = json(&folder.join("states").join(format!("{name}.json")));
        let list = json(&folder.join("robots.json"));
        let entry = list.as_array().expect("a list").iter().find(|r| r["name"] == name).expect("a robot of the list");
        let joints = file["joints"].as_array().expect("a list");
        let independent = file.get("independent").filter(|names| !names.is_null()).map(strings);
        let name_of = |k: usize| joints[k]["name"].as_str().expect("a name");
        // joints that loops determine come behind the others, and those that follow others last
        let is_dependent = |k: usize| independent.as_ref().is_some_and(|all| !all.iter().any(|own| own == name_of(k)));
        let follows = |k: usize| joints[k].get("mimic").is_some();
        let mut order: Vec<usize> = (0..joints.len()).collect();
        order.sort_by_key(|k| (follows(*k), is_dependent(*k)));
        let state = |state: &Value| match independent {
            Some(_) => State::new(&on_loops(state, joints, &order), &order),
            None => State::new(state, &order),
        };
        let states: Vec<State> = file["states"].as_array().expect("a list").iter().map(state).collect();
        let potential_energy = |s: &State| largest(&numbers(&s.data["V"]));
        Robot {
            key,
            baseline: baseline["robots"][name].clone(),
            name: name.to_string(),
            file: description,
            floating: entry["floating"].as_bool().expect("true or false"),
            frames: strings(&entry["frames"]),
            joints: joints
                .iter()
                .filter(|joint| joint.get("mimic").is_none())
                .map(|j| j["name"].as_str().expect("a name").to_string())
                .collect(),
            nv: states[0].qd.len(),
            largest_potential_energy: states.iter().map(potential_energy).fold(0.0, f64::max),
            states,
        }
    }

    /// The largest scaled error that a function may have: 20 times that of Pinocchio 4.1 on the same states, of [`JOINTS`] 20 times that of a plain
    /// evaluation in f64, or 1e-14, whichever is larger.
    pub fn bound(&self, function: Function) -> f64 {
        if let members @ [_, ..] = function.spec().members {
            return members.iter().map(|member| self.bound(*member)).fold(0.0, f64::max);
        }
        let error =
            |key: &&str| self.baseline[*key]["scaled"].as_f64().expect("the baseline has every robot and function");
        let baseline = (self.key)(function).iter().map(error).fold(0.0, f64::max);
        (20.0 * baseline).max(bounds::FUNCTION.most)
    }

    /// What a function gives in a state; `None` for what the data do not hold.
    pub fn expected(&self, state: &State, function: Function) -> Option<Expected> {
        if let members @ [_, ..] = function.spec().members {
            let mut all = Expected { values: vec![], scales: vec![] };
            for member in members {
                let Expected { values, scales } = self.expected(state, *member)?;
                all.values.extend(values);
                all.scales.extend(scales);
            }
            return Some(all);
        }
        let data = &state.data;
        // a field that is left out stands there as null
        let field = |what: &str| data.get(what).filter(|value| !value.is_null());
        let scaled = |what: &str, scale: &str| {
            let mut expected = Expected { values: vec![], scales: vec![] };
            expected.append_uniform(numbers(field(what)?));
            if let Some(scales) = field("scale").and_then(|s| s.get(scale)).filter(|s| !s.is_null()) {
                expected.scales = numbers(scales).iter().map(|x| x.to_f64()).collect();
            }
            Some(expected)
        };
        let frames = || self.frames.iter().map(|name| field("frames")?.get(name)).collect::<Option<Vec<_>>>();
        let per_frame = |parts: &[&str]| {
            let mut expected = Expected { values: vec![], scales: vec![] };
            for frame in frames()? {
                for part in parts {
                    expected.append_uniform(numbers(frame.get(part)?));
                }
            }
            Some(expected)
        };
        match function {
            Function::InverseDynamics => scaled("tau", "tau"),
            Function::BiasForce => scaled("h", "h"),
            Function::GravityForce => scaled("g", "g"),
            Function::VelocityForce => scaled("C", "C"),
            Function::ForwardDynamics => scaled("fd_qdd", "fd"),
            Function::MassMatrix => {
                let (values, n) = (numbers(field("H")?), self.nv);
                let diagonal: Vec<f64> = (0..n).map(|i| values[i * n + i].to_f64()).collect();
                let scales = (0..n * n).map(|k| (diagonal[k / n] * diagonal[k % n]).sqrt()).collect();
                Some(Expected { values, scales })
            }
            Function::Energy => {
                let values = vec![numbers(&data["T"])[0], numbers(&data["V"])[0]];
                Some(Expected { scales: vec![values[0].to_f64(), self.largest_potential_energy], values })
            }
            Function::JointWrenches => {
                let mut expected = Expected { values: vec![], scales: vec![] };
                for joint in field("wrench")?.as_array().expect("one per joint") {
                    expected.append_uniform(numbers(joint));
                }
                Some(expected)
            }
            // of some states
            Function::InverseDynamicsDerivatives => {
                let mut expected = Expected { values: vec![], scales: vec![] };
                expected.append_uniform(numbers(field("dtau_dq")?));
                expected.append_uniform(numbers(field("dtau_dqd")?));
                Some(expected)
            }
            Function::CloseLoops => {
                let mut expected = Expected { values: vec![], scales: vec![] };
                expected.append_over(numbers(field("q_closed")?), 1.0);
                // three equations of a loop, or two of a plane one
                let gaps = numbers(field("gaps")?);
                expected.scales.extend(gaps.iter().map(|_| 1.0));
                expected.values.extend(gaps);
                Some(expected)
            }
            Function::LoopJacobian => {
                let mut expected = Expected { values: vec![], scales: vec![] };
                expected.append_uniform(numbers(field("G_dependent")?));
                Some(expected)
            }
            Function::LoopMotion => {
                let mut expected = Expected { values: vec![], scales: vec![] };
                let rates = numbers(field("qd_dependent")?);
                // where a sum of products of velocities is zero, its terms are not
                let products = largest(&rates) * largest(&rates);
                expected.append_uniform(rates);
                expected.append_over(numbers(field("qdd_dependent")?), products);
                Some(expected)
            }
            Function::ForwardKinematics => per_frame(&["p", "R"]),
            Function::Jacobian => per_frame(&["J"]),
            Function::JacobianBias => per_frame(&["Jdqd"]),
            Function::FrameVelocity | Function::FrameAcceleration => {
                let (rate, mut expected) = match function {
                    Function::FrameVelocity => (&state.qd, Expected { values: vec![], scales: vec![] }),
                    _ => (&state.qdd, per_frame(&["Jdqd"])?),
                };
                let first = expected.values.is_empty();
                let jacobians = frames()?.into_iter().map(|f| f.get("J")?.as_array()).collect::<Option<Vec<_>>>()?;
                for (i, row) in jacobians.into_iter().flatten().enumerate() {
                    let row = numbers(row);
                    // J of the data has 25 digits, so has the product
                    let value = row.iter().zip(rate).fold(Dd::ZERO, |sum, (j, x)| sum + *j * Dd::from(*x));
                    let scale: f64 = row.iter().zip(rate).map(|(j, x)| (j.to_f64() * x).abs()).sum();
                    if first {
                        expected.values.push(value);
                        expected.scales.push(scale);
                    } else {
                        expected.values[i] += value;
                        expected.scales[i] += scale;
                    }
                }
                // linear and angular rows of a frame: the largest of three
                for three in expected.scales.chunks_mut(3) {
                    let scale = three.iter().copied().fold(0.0, f64::max);
                    three.fill(scale);
                }
                Some(expected)
            }
            _ => None,
        }
    }
}

/// What the baseline of [`ROBOTS`] calls a function.
fn by_pinocchio(function: Function) -> &'static [&'static str] {
    match function {
        Function::InverseDynamics => &["id"],
        Function::BiasForce => &["nle"],
        Function::GravityForce => &["gravity"],
        Function::VelocityForce => &["coriolis"],
        Function::MassMatrix => &["crba"],
        Function::ForwardDynamics => &["aba"],
        Function::JointWrenches => &["wrench"],
        Function::ForwardKinematics => &["fk"],
        Function::Jacobian => &["jacobian"],
        Function::JacobianBias | Function::FrameVelocity | Function::FrameAcceleration => &["jdqd"],
        // sums over the bodies; of others the data hold nothing
        _ => &["energy"],
    }
}

/// What the baseline of [`JOINTS`] calls it.
fn by_plain_evaluation(function: Function) -> &'static [&'static str] {
    match function {
        Function::JointWrenches => &["wrench"],
        Function::ForwardKinematics => &["frame_position", "frame_rotation"],
        Function::Jacobian => &["frame_jacobian"],
        Function::JacobianBias | Function::FrameVelocity | Function::FrameAcceleration => {
            &["frame_jdqd", "frame_jacobian"]
        }
        Function::InverseDynamics => &["inverse_dynamics"],
        Function::BiasForce => &["bias_force"],
        Function::GravityForce => &["gravity_force"],
        Function::VelocityForce => &["velocity_force"],
        Function::MassMatrix => &["mass_matrix"],
        Function::ForwardDynamics => &["forward_dynamics"],
        Function::CloseLoops => &["close_loops"],
        Function::LoopJacobian => &["close_qd"],
        Function::LoopMotion => &["close_qd", "close_qdd"],
        _ => &["energy"],
    }
}

/// A state of a robot with closed loops under the names of others, over its independent joints, with configurations in the order of the joints that is given.
fn on_loops(state: &Value, joints: &[Value], order: &[usize]) -> Value {
    let mut data = state.clone();
    for name in ["tau", "h", "g", "C", "fd_qdd", "fd_tau", "H", "qd", "qdd"] {
        data[name] = state[format!("{name}_a")].clone();
    }
    for name in ["tau", "h", "g", "C", "fd"] {
        data["scale"][name] = state["scale"][format!("{name}_a")].clone();
    }
    let number = |joint: usize, key: &str| joints[joint][key].as_u64().expect("an index") as usize;
    let part = |list: &Value, joint: usize, [first, count]: [&str; 2]| {
        let first = number(joint, first);
        list.as_array().expect("a list")[first..first + number(joint, count)].to_vec()
    };
    let of_all =
        |list: &Value| Value::from(order.iter().flat_map(|k| part(list, *k, ["iq", "nq"])).collect::<Vec<_>>());
    for name in ["q", "q_start"] {
        data[name] = of_all(&state[name]);
    }
    data["q_closed"] = data["q"].clone();
    let independent = state["qd_a"].as_array().expect("a list").len();
    let of_dependent = |list: &Value| {
        let all = order.iter().flat_map(|k| part(list, *k, ["iv", "nv"]));
        Value::from(all.skip(independent).collect::<Vec<_>>())
    };
    data["qd_dependent"] = of_dependent(&state["qd"]);
    data["qdd_dependent"] = of_dependent(&state["qdd"]);
    data["G_dependent"] = of_dependent(&state["G"]);
    // as many equations as joints that they determine
    let closed = Value::from("0");
    data["gaps"] = data["qd_dependent"].as_array().expect("a list").iter().map(|_| closed.clone()).collect();
    data
}

impl State {
    /// From its data, which has wrenches in another order of the joints.
    fn new(data: &Value, order: &[usize]) -> State {
        let mut data = data.clone();
        if let Some(wrenches) = data.get("wrench").and_then(Value::as_array).cloned() {
            data["wrench"] = order.iter().map(|k| wrenches[*k].clone()).collect();
        }
        let data = &data;
        let text = |key: &str| data[key].as_str().expect("a string").to_string();
        let three = |v: Vec<f64>| <[f64; 3]>::try_from(v).expect("three components");
        State {
            id: text("id"),
            kind: text("kind"),
            q: inputs(&data["q"]),
            start: data.get("q_start").map(inputs),
            qd: inputs(&data["qd"]),
            qdd: inputs(&data["qdd"]),
            fd_tau: inputs(&data["fd_tau"]),
            gravity: data.get("gravity").map(|g| three(inputs(g))),
            data: data.clone(),
        }
    }

    /// The inputs of a function, in the order of its ports.
    pub fn inputs(&self, function: Function) -> Vec<Vec<f64>> {
        let of = |quantity: &Quantity| match quantity {
            Quantity::Configuration if function == Function::CloseLoops => {
                self.start.clone().expect("its robot has loops")
            }
            Quantity::Configuration => self.q.clone(),
            Quantity::Velocity => self.qd.clone(),
            Quantity::Acceleration => self.qdd.clone(),
            Quantity::Force => self.fd_tau.clone(),
            other => panic!("{}: the data hold no {other:?}", function.name()),
        };
        function.spec().inputs.iter().map(of).collect()
    }

    /// The inputs as Rust, ready to paste into a test.
    pub fn ready_to_paste(&self) -> String {
        let gravity = self.gravity.map_or(String::new(), |g| format!("let gravity = {g:?};\n"));
        format!(
            "// {} ({})\nlet q = {:?};\nlet qd = {:?};\nlet qdd = {:?};\nlet fd_tau = {:?};\n{gravity}",
            self.id, self.kind, self.q, self.qd, self.qdd, self.fd_tau
        )
    }
}

impl Expected {
    /// What the second author says of a function at these inputs, in the order of the function's own, with natural scales.
    ///
    /// # Panics
    /// If the reference has no frame of a name asked for, or no formulation of the function.
    pub fn by_the_second_author(
        tree: &CentreOfMassTree<Dd>,
        frames: &[String],
        function: Function,
        inputs: &[Vec<Dd>],
    ) -> Expected {
        let state = function.spec().inputs.iter().copied().zip(inputs.iter().cloned()).collect();
        let chapter = Chapter::new(tree, &[], state).with_frames(frames).unwrap_or_else(|why| panic!("{why}"));
        let truth = function.truth(&chapter).expect("drives have their own test");
        Expected { scales: function.scales(&truth), values: truth.iter().map(|x| x.value).collect() }
    }

    /// Components that share the largest of them as their scale.
    pub fn append_uniform(&mut self, values: Vec<Dd>) {
        self.append_over(values, 0.0);
    }

    /// The same, with a scale that is no smaller than that.
    pub fn append_over(&mut self, values: Vec<Dd>, least: f64) {
        let scale = largest(&values).max(least);
        self.scales.extend(values.iter().map(|_| scale));
        self.values.extend(values);
    }

    /// The worst scaled error of these results, and its component. Infinite for what is no number.
    pub fn worst<T: Into<Dd> + Copy>(&self, computed: &[T]) -> (f64, usize) {
        assert_eq!(computed.len(), self.values.len(), "as many results as are expected");
        let scaled = |i: usize| {
            let computed: Dd = computed[i].into();
            let error = (computed - self.values[i]).abs().to_f64();
            match error {
                0.0 => 0.0,
                _ if error.is_finite() => error / self.scales[i],
                _ => f64::INFINITY,
            }
        };
        (0..computed.len()).map(|i| (scaled(i), i)).fold((0.0, 0), |a, b| if b.0 > a.0 { b } else { a })
    }
}
