//! One function of one robot: time per evaluation against error, for every way to compute it.

use crate::kernel::{self, Generated};
use serde_json::{json, Value};
use std::io::{Read, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Instant;
use straightline_codegen::certify::{certify, Effort, Interval};
use straightline_codegen::choices::Lanes;
use straightline_codegen::compile::compile;
use straightline_codegen::model::ModelOptions;
use straightline_codegen::options::Options;
use straightline_codegen::program::{program, TracedProgram};
use straightline_codegen::scene::{self, Budget, JointRanges, MaxError};
use straightline_codegen::{expr, ForwardDynamicsMethod, Function, Robot, Scalar, Source};
use straightline_core::model::{Joint, Model};
use straightline_core::{reference as chapter, Dd, Real};
use straightline_generated_tests::programs;
use straightline_generated_tests::random::Random;
use straightline_generated_tests::reference::Robot as Data;
use straightline_generated_tests::search::Ranges;
use straightline_generated_tests::standalone::Folder;

/// Random states of the root mean square, and evaluations of the search, for an arm; of a robot with n velocity coordinates as
/// many less as its equations are longer, n² against 49.
const STATES: usize = 2000;
const SEARCH: usize = 8000;
/// How many of them at least: the kernel is timed over so many.
const LEAST: usize = 512;
/// Of the bound of f32, what a program in mixed precision has to stay within.
const HALVED: f64 = 0.5;
/// A Python with the package `pinocchio`; without the variable there are no peers in the chart.
const PEERS: &str = "STRAIGHTLINE_PEERS_PYTHON";
/// Where a file gives no limit: rad or m, rad/s or m/s; accelerations in any case. Files that state a hundred rad/s state what
/// the motor could: no joint is moved faster than the last.
const RANGE: f64 = std::f64::consts::PI;
const VELOCITY: f64 = 3.0;
const FASTEST: f64 = 3.0;
const ACCELERATION: f64 = 10.0;

/// A way to compute, with its figures; errors over the greatest output of the box.
#[derive(Clone, Debug)]
pub struct Method {
    pub name: String,
    pub group: Group,
    /// Nanoseconds per evaluation: best of the warm runs, their median, and cold.
    pub time: [f64; 3],
    pub rms: f64,
    pub worst: f64,
    /// Certified: no state of the box is worse.
    pub cap: Option<f64>,
}

/// Methods that are drawn alike.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    Double,
    Single,
    Extended,
    Reduced,
    Library,
}

impl Group {
    pub const ALL: [Group; 5] = [Group::Double, Group::Single, Group::Extended, Group::Reduced, Group::Library];

    pub fn name(self) -> &'static str {
        match self {
            Group::Double => "generated, f64",
            Group::Single => "generated, f32",
            Group::Extended => "f32 with help of f64 or compensation",
            Group::Reduced => "terms left out, f64",
            Group::Library => "not generated",
        }
    }
}

/// All that was measured.
pub struct Panel {
    pub robot: String,
    pub function: Function,
    pub methods: Vec<Method>,
    pub notes: Vec<String>,
}

impl Panel {
    pub fn json(&self) -> Value {
        let methods: Vec<Value> = self
            .methods
            .iter()
            .map(|m| {
                json!({"name": m.name, "group": m.group.name(), "ns": m.time[0], "ns_median": m.time[1], "ns_cold": m.time[2],
                       "rms": m.rms, "worst_found": m.worst, "certified": m.cap})
            })
            .collect();
        json!({"robot": self.robot, "function": self.function.name(), "methods": methods, "notes": self.notes})
    }

    /// What [`Panel::json`] wrote.
    pub fn read(value: &Value) -> Panel {
        let text = |v: &Value| v.as_str().expect("a text").to_string();
        let list = |key: &str| value[key].as_array().expect("a list").iter();
        let method = |m: &Value| {
            let number = |key: &str| m[key].as_f64().expect("a number");
            let group = Group::ALL.into_iter().find(|g| m["group"] == g.name()).expect("a group");
            let time = ["ns", "ns_median", "ns_cold"].map(number);
            let (rms, worst, cap) = (number("rms"), number("worst_found"), m["certified"].as_f64());
            Method { name: text(&m["name"]), group, time, rms, worst, cap }
        };
        Panel {
            robot: text(&value["robot"]),
            function: Function::from_name(&text(&value["function"])).expect("a function"),
            methods: list("methods").map(method).collect(),
            notes: list("notes").map(text).collect(),
        }
    }
}

/// The binary as a calculator: requests in, results out.
struct Server(Child);

impl Server {
    fn start(program: &Path) -> Server {
        let child = Command::new(program).arg("serve").stdin(Stdio::piped()).stdout(Stdio::piped()).spawn();
        Server(child.unwrap_or_else(|e| panic!("{}: {e}", program.display())))
    }

    fn call(&mut self, index: usize, x: &[f64], outputs: usize) -> Vec<f64> {
        let request: Vec<u8> = std::iter::once(&(index as f64)).chain(x).flat_map(|v| v.to_le_bytes()).collect();
        let pipe = self.0.stdin.as_mut().expect("it was asked for");
        pipe.write_all(&request).and_then(|()| pipe.flush()).expect("the program listens");
        let mut answer = vec![0u8; 8 * outputs];
        self.0.stdout.as_mut().expect("it was asked for").read_exact(&mut answer).expect("the program answers");
        answer.chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().expect("eight bytes"))).collect()
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        drop(self.0.stdin.take());
        // it ends with its input
        let _ = self.0.wait();
    }
}

/// A robot, a function, and the box of its states.
struct Case {
    source: Source,
    options: Options,
    robot: Robot,
    program: TracedProgram,
    ranges: Ranges,
    lengths: Vec<usize>,
    floating: bool,
    /// Random states, and evaluations of a search.
    states: usize,
    search: usize,
}

impl Case {
    fn new(data: &Data, function: Function) -> Case {
        let options = Options { functions: vec![function], ..programs::options(data) };
        let source = programs::source(data);
        let robot = programs::load(&source, &options.model);
        let program = program(&robot, &options.frames, function, &options);
        let inputs = function.inputs(&robot.model, 0);
        let ranges = inputs.iter().flat_map(|p| ranges(&robot.model, &p.name, p.len())).collect();
        let lengths = inputs.iter().map(|p| p.len()).collect();
        let fewer = |count: usize| (count * 49 / (robot.model.nv() * robot.model.nv()).max(49)).max(LEAST);
        let (states, search) = (fewer(STATES), fewer(SEARCH));
        Case {
            source,
            options,
            robot,
            program,
            ranges: Ranges(ranges),
            lengths,
            floating: data.floating,
            states,
            search,
        }
    }

    /// A state as f32 holds it, so that its own rounding is no error of f32; a quaternion has length one, nearly.
    fn exact(&self, x: &[f64]) -> Vec<f64> {
        let mut x = x.to_vec();
        if self.floating {
            let norm = x[3..7].iter().map(|v| v * v).sum::<f64>().sqrt();
            x[3..7].iter_mut().for_each(|v| *v = if norm > 0.0 { *v / norm } else { 0.5 });
        }
        x.iter().map(|v| f64::from(*v as f32)).collect()
    }

    /// The box of the states, as a scene states it.
    fn stated_ranges(&self, function: Function) -> scene::Ranges {
        let mut stated = scene::Ranges::default();
        let mut first = 0;
        for (port, len) in function.inputs(&self.robot.model, 0).iter().zip(&self.lengths) {
            let of = |joint: &Joint| {
                let index = first + if port.name == "q" { joint.iq } else { joint.iv };
                let (lower, upper) = self.ranges.0[index];
                (joint.name.clone(), scene::InputRange { lower, upper })
            };
            let joints = JointRanges::Joints(self.robot.model.bodies.iter().map(|b| of(&b.joint)).collect());
            match port.name.as_str() {
                "q" => stated.q = joints,
                "qd" => stated.qd = joints,
                "qdd" => stated.qdd = joints,
                _ => stated.tau = joints,
            }
            first += len;
        }
        stated
    }

    fn truth(&self, x: &[f64]) -> Vec<Dd> {
        expr::evaluate(&self.program.graph, &x.iter().map(|v| Dd::from(*v)).collect::<Vec<_>>())
    }

    fn groups(&self, x: &[f64]) -> Vec<Vec<f64>> {
        let mut rest = x;
        let mut take = |n: &usize| {
            let (group, after) = rest.split_at(*n);
            rest = after;
            group.to_vec()
        };
        self.lengths.iter().map(&mut take).collect()
    }
}

fn ranges(model: &Model<Dd>, port: &str, len: usize) -> Vec<(f64, f64)> {
    let mut ranges = vec![(-1.0, 1.0); len];
    for joint in model.free_joints().filter(|j| j.kind.is_single()) {
        let or = |limit: f64, other: f64| if limit.is_finite() { limit } else { other };
        let speed = or(joint.limits.velocity, VELOCITY).min(FASTEST);
        match port {
            "q" => ranges[joint.iq] = (or(joint.limits.lower, -RANGE), or(joint.limits.upper, RANGE)),
            "qd" => ranges[joint.iv] = (-speed, speed),
            "tau" => ranges[joint.iv] = (-50.0, 50.0),
            _ => ranges[joint.iv] = (-ACCELERATION, ACCELERATION),
        }
    }
    ranges
}

fn error(computed: &[f64], truth: &[Dd]) -> f64 {
    let error = computed.iter().zip(truth).map(|(a, b)| (Dd::from(*a) - *b).to_f64().abs());
    error.fold(0.0, |m, e| if e.is_finite() { m.max(e) } else { f64::INFINITY })
}

/// A generated function as text, for inputs of which some may be left out.
fn generated(module: &'static str, case: &Case, options: &Options, function: Function) -> Generated {
    let made = compile(&case.source, options).unwrap_or_else(|d| panic!("{d}"));
    let item = &made.items[0];
    let places = function.inputs(&case.robot.model, 0);
    let place = |name: &str| {
        let before: usize = places.iter().take_while(|p| p.name != name).map(|p| p.len()).sum();
        (before, places.iter().find(|p| p.name == name).map_or(0, |p| p.len()))
    };
    Generated {
        module,
        function: function.name().to_string(),
        scalar: options.scalar.name(),
        inputs: item.inputs().iter().map(|p| place(&p.name)).collect(),
        output: item.outputs()[0].shape.clone(),
        lanes: None,
        text: made.text,
    }
}

/// The same, and over lanes; those are called `lanes` in the binary.
fn generated_with_lanes(
    [module, lanes]: [&'static str; 2],
    case: &Case,
    options: &Options,
    function: Function,
) -> Generated {
    let options = Options { lanes: Some(Lanes::Standalone), ..options.clone() };
    Generated { lanes: Some(lanes), ..generated(module, case, &options, function) }
}

/// The kernel's sines and cosines replaced by the standard library's, one after the other.
fn with_std_trig(mut g: Generated) -> Generated {
    let alone = "pub fn sin_cos_f64(x: f64) -> (f64, f64) {";
    let of_sum = "pub fn sin_cos_of_sum_f64([x, tail]: [f64; 2]) -> (f64, f64) {";
    for (ours, std) in [
        (alone, format!("{alone} return x.sin_cos();")),
        (of_sum, format!("{of_sum} return (x + tail).sin_cos();")),
        // lanes in blocks of one: nothing is computed that is not asked for
        ("sin_cos_lanes_f64, f64, 8,", "sin_cos_lanes_f64, f64, 1,".to_string()),
        ("sin_cos_lanes_of_sums_f64, f64, 8,", "sin_cos_lanes_of_sums_f64, f64, 1,".to_string()),
    ] {
        assert_eq!(g.text.matches(ours).count(), 1, "`{ours}` is in the kernel");
        g.text = g.text.replace(ours, &std);
    }
    Generated { module: "std_trig", ..g }
}

/// The largest certified bound of any result in the box of the states, if there is a certificate.
fn certified(case: &Case, options: &Options, function: Function) -> Option<f64> {
    let program = program(&case.robot, &options.frames, function, options);
    let states: Vec<Interval> = case.ranges.0.iter().map(|&(lo, hi)| Interval { lo, hi }).collect();
    certify(&program.graph, options.scalar, &states, Effort::default()).ok().map(|certificate| certificate.worst())
}

pub fn measure(name: &str, function: Function) -> Panel {
    let data = Data::load(name);
    let case = Case::new(&data, function);
    let mut notes = Vec::new();
    let checked = check_truth(&data, &case, function);
    notes.push(format!("truth against the 25-digit reference values: {checked:.1e} of scale"));

    let single = Options { scalar: Scalar::F32, ..case.options.clone() };
    let [fused, fused_single] = [&case.options, &single].map(|o| Options { fma: true, ..o.clone() });
    let mut texts = vec![
        generated_with_lanes(["double", "lanes_f64"], &case, &case.options, function),
        generated_with_lanes(["single", "lanes_f32"], &case, &single, function),
        generated_with_lanes(["fused_f64", "fused_lanes_f64"], &case, &fused, function),
        generated_with_lanes(["fused_f32", "fused_lanes_f32"], &case, &fused_single, function),
        with_std_trig(generated("double", &case, &case.options, function)),
    ];
    let caps = [&case.options, &single, &fused, &fused_single].map(|options| certified(&case, options, function));
    let mut mixed_cap = None;
    if let Some(cap) = caps[1] {
        let mut mixed = single.clone();
        let halved = HALVED * cap;
        let max_error = Some(MaxError::All(halved));
        mixed.scene.budgets.insert(function, Budget { max_error, mixed_precision: true, ..Budget::default() });
        mixed.scene.ranges = case.stated_ranges(function);
        match compile(&case.source, &mixed) {
            Ok(_) => {
                texts.push(generated("certified_mixed", &case, &mixed, function));
                mixed_cap = Some(halved);
            }
            Err(refused) => {
                notes.push(format!("no mixed precision: {}", refused.iter().next().expect("a reason").title))
            }
        }
    }
    let articulated = function == Function::ForwardDynamics;
    if articulated {
        for (module, method) in [
            ("articulated", ForwardDynamicsMethod::ArticulatedBody),
            ("factorised", ForwardDynamicsMethod::Factorisation),
        ] {
            let options = Options { forward_dynamics: method, ..case.options.clone() };
            texts.push(generated(module, &case, &options, function));
        }
    }
    let reduced = function == Function::InverseDynamics;
    if reduced {
        let mut slow = case.options.clone();
        slow.scene.zero.qd = true;
        texts.push(generated("at_rest", &case, &slow, function));
        for (module, other) in [("gravity", Function::GravityForce), ("bias", Function::BiasForce)] {
            texts.push(generated(module, &case, &Options { functions: vec![other], ..case.options.clone() }, other));
        }
    }
    let total_in: usize = case.lengths.iter().sum();
    let (mut source, calls) = kernel::source(&texts, &case.program.graph, total_in);
    source += &other_code();
    let folder = Folder::new("time-error");
    let program = folder.build("kernel", &source, &["-Ctarget-cpu=native"]).unwrap_or_else(|e| panic!("{e}"));

    let mut random = Random(5);
    let states: Vec<Vec<f64>> = (0..case.states).map(|_| case.exact(&case.ranges.anywhere(&mut random))).collect();
    let truths: Vec<Vec<Dd>> = states.iter().map(|x| case.truth(x)).collect();
    let greatest = truths.iter().flatten().map(|t| t.to_f64().abs()).fold(0.0, f64::max);
    notes.push(format!(
        "greatest output of {} random states: {greatest:.3}; {} evaluations of each search",
        case.states, case.search
    ));
    let file = folder.file("states");
    std::fs::write(&file, states.iter().flatten().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>())
        .expect("the folder can be written");
    let output = Command::new(&program).arg("time").arg(&file).output().expect("the program runs");
    let times: Vec<[f64; 3]> = String::from_utf8_lossy(&output.stdout)
        .lines()
        .map(|l| {
            let figures: Vec<f64> = l.split('\t').skip(1).map(|f| f.parse().expect("a number")).collect();
            figures.try_into().expect("three figures")
        })
        .collect();
    assert_eq!(times.len(), calls.len(), "{}", String::from_utf8_lossy(&output.stderr));

    let mut server = Server::start(&program);
    let outputs = truths[0].len();
    let mut methods = Vec::new();
    let mut gravity_time = None;
    let mut bias_time = None;
    for (index, call) in calls.iter().enumerate() {
        let (name, group, cap) = match call.name.as_str() {
            "double" => ("f64", Group::Double, caps[0]),
            "single" => ("f32", Group::Single, caps[1]),
            "std_trig" => ("f64, sin and cos of std", Group::Double, None),
            "articulated" => ("f64, articulated bodies", Group::Double, None),
            "factorised" => ("f64, factorisation of H", Group::Double, None),
            "fused_f64" => ("f64, fused", Group::Double, caps[2]),
            "fused_f32" => ("f32, fused", Group::Single, caps[3]),
            "lanes_f64" => ("f64 × 8 lanes", Group::Double, caps[0]),
            "lanes_f32" => ("f32 × 16 lanes", Group::Single, caps[1]),
            "fused_lanes_f64" => ("f64 × 8 lanes, fused", Group::Double, caps[2]),
            "fused_lanes_f32" => ("f32 × 16 lanes, fused", Group::Single, caps[3]),
            "compensated_f32" => ("f32, compensated", Group::Extended, None),
            "mixed" => ("products f32, sums f64", Group::Extended, None),
            "certified_mixed" => ("f32, f64 where it counts", Group::Extended, mixed_cap),
            "at_rest" => ("no Coriolis terms", Group::Reduced, None),
            "gravity" => {
                gravity_time = Some((index, times[index]));
                continue;
            }
            "bias" => {
                bias_time = Some(times[index]);
                continue;
            }
            // the same as `double`, to see that the generic form costs nothing
            _ => continue,
        };
        if group == Group::Reduced {
            for fraction in [1.0, 0.3, 0.1, 0.03, 0.01] {
                let (rms, worst) = slowed(&case, &states, fraction, greatest, |x| server.call(index, x, outputs));
                let name = format!("{name}, {:.0} % speed", 100.0 * fraction);
                methods.push(Method { name, group, time: times[index], rms, worst, cap: None });
            }
            continue;
        }
        let mut squares = 0.0;
        for (x, truth) in states.iter().zip(&truths) {
            squares += error(&server.call(index, x, outputs), truth).powi(2);
        }
        let found = case.ranges.climb(&mut Random(6), case.search, |x| {
            let x = case.exact(x);
            error(&server.call(index, &x, outputs), &case.truth(&x))
        });
        methods.push(Method {
            name: name.to_string(),
            group,
            time: times[index],
            rms: (squares / states.len() as f64).sqrt() / greatest,
            worst: found.value / greatest,
            cap: cap.map(|c| c / greatest),
        });
    }
    if let Some((index, time)) = gravity_time {
        for fraction in [1.0, 0.1, 0.01] {
            let (rms, worst) = slowed(&case, &states, fraction, greatest, |x| server.call(index, x, outputs));
            let name = format!("gravity alone, {:.0} % speed", 100.0 * fraction);
            methods.push(Method { name, group: Group::Reduced, time, rms, worst, cap: None });
        }
    }
    if let Some(time) = bias_time {
        methods.extend(held_inertia(&case, &states, greatest, time));
    }
    drop(server);
    methods.extend(libraries(&data, &case, function, &states, greatest));
    match peer(&data, function, &folder, &file, &truths, greatest) {
        Ok(pinocchio) => methods.extend(pinocchio),
        Err(why) => notes.push(why),
    }
    Panel { robot: name.to_string(), function, methods, notes }
}

/// Errors of a form without velocities, at a fraction of the speeds; acceleration falls with the square, as along a slower
/// trajectory.
fn slowed(
    case: &Case,
    states: &[Vec<f64>],
    f: f64,
    greatest: f64,
    mut call: impl FnMut(&[f64]) -> Vec<f64>,
) -> (f64, f64) {
    let n = case.lengths[1];
    let (mut squares, mut worst) = (0.0, 0.0f64);
    for x in states {
        let mut x = x.clone();
        let end = x.len();
        x[end - 2 * n..end - n].iter_mut().for_each(|v| *v = f64::from((*v * f) as f32));
        x[end - n..].iter_mut().for_each(|v| *v = f64::from((*v * f * f) as f32));
        let e = error(&call(&x), &case.truth(&x));
        squares += e * e;
        worst = worst.max(e);
    }
    ((squares / states.len() as f64).sqrt() / greatest, worst / greatest)
}

/// τ = H(q of k ms ago) q̈ + h(q, q̇): the time is that of h and of a product with a matrix.
fn held_inertia(case: &Case, states: &[Vec<f64>], greatest: f64, bias: [f64; 3]) -> Vec<Method> {
    let (model, n) = (&case.robot.model, case.lengths[1]);
    if case.floating {
        return Vec::new();
    }
    let matrix = product_time(n);
    let h = |q: &[f64]| {
        Function::MassMatrix.evaluate(&model.cast::<f64>(), &[], ForwardDynamicsMethod::default(), &[q.to_vec()])
    };
    [1.0, 10.0, 100.0]
        .into_iter()
        .map(|milliseconds| {
            let (mut squares, mut worst) = (0.0, 0.0f64);
            for x in states.iter().take(400) {
                let (q, rest) = x.split_at(n);
                let (qd, qdd) = rest.split_at(n);
                let before: Vec<f64> = q.iter().zip(qd).map(|(q, v)| q - v * milliseconds * 1e-3).collect();
                let (old, new) = (h(&before), h(q));
                let off = (0..n).map(|i| (0..n).map(|j| (old[i * n + j] - new[i * n + j]) * qdd[j]).sum::<f64>().abs());
                let e = off.fold(0.0, f64::max);
                squares += e * e;
                worst = worst.max(e);
            }
            Method {
                name: format!("H held for {milliseconds} ms"),
                group: Group::Reduced,
                time: bias.map(|t| t + matrix),
                rms: (squares / 400.0_f64.min(states.len() as f64)).sqrt() / greatest,
                worst: worst / greatest,
                cap: None,
            }
        })
        .collect()
}

/// Nanoseconds of a product with an n × n matrix.
fn product_time(n: usize) -> f64 {
    let (a, x) = (vec![1.5; n * n], vec![0.5; n]);
    let mut y = vec![0.0; n];
    best_time(|| {
        for (row, y) in a.chunks_exact(n).zip(&mut y) {
            *y = row.iter().zip(std::hint::black_box(&x)).map(|(a, b)| a * b).sum();
        }
        std::hint::black_box(&mut y);
    })
}

/// The generic runtime, the reference formulation, and double-double.
fn libraries(data: &Data, case: &Case, function: Function, states: &[Vec<f64>], greatest: f64) -> Vec<Method> {
    let mut methods = Vec::new();
    let mut add = |name: &str, call: &dyn Fn(&[f64]) -> Vec<f64>, truth: &dyn Fn(&[f64]) -> Vec<Dd>| {
        let mut at = 0;
        let time = best_time(|| {
            at = (at + 1) % states.len();
            std::hint::black_box(call(std::hint::black_box(&states[at])));
        });
        let mut squares = 0.0;
        let mut worst = 0.0f64;
        for x in states.iter().take(500) {
            let e = error(&call(x), &truth(x));
            squares += e * e;
            worst = worst.max(e);
        }
        let found = case.ranges.climb(&mut Random(6), case.search / 4, |x| {
            let x = case.exact(x);
            error(&call(&x), &truth(&x))
        });
        worst = worst.max(found.value);
        let rms = (squares / states.len().min(500) as f64).sqrt() / greatest;
        let (group, worst) = (Group::Library, worst / greatest);
        methods.push(Method { name: name.into(), group, time: [time; 3], rms, worst, cap: None });
    };
    let truth = |x: &[f64]| case.truth(x);
    let of = |x: &[f64]| case.groups(x);
    let model = case.robot.model.cast::<f64>();
    let method = ForwardDynamicsMethod::ArticulatedBody;
    add("generic runtime, f64", &|x| function.evaluate(&model, &[], method, &of(x)), &truth);
    let single = case.robot.model.cast::<f32>();
    add(
        "generic runtime, f32",
        &|x| {
            let groups: Vec<Vec<f32>> = of(x).iter().map(|g| g.iter().map(|v| *v as f32).collect()).collect();
            function.evaluate(&single, &[], method, &groups).into_iter().map(f64::from).collect()
        },
        &truth,
    );
    let options: &ModelOptions = &case.options.model;
    let described =
        straightline_codegen::description::read(&case.source, &mut straightline_codegen::Diagnostics::new());
    let tree =
        described.and_then(|d| straightline_codegen::verify::reference_input::centre_of_mass_tree(&d, options).ok());
    if let Some(tree) = tree.filter(|_| function == Function::InverseDynamics) {
        // its own truth: of a quaternion whose length is one to 1e-8, as f32 has them, both make something else
        let exact = |x: &[f64]| {
            let g: Vec<Vec<Dd>> = of(x).iter().map(|g| g.iter().map(|v| Dd::from(*v)).collect()).collect();
            chapter::inverse_dynamics(&tree, &g[0], &g[1], &g[2]).as_slice().to_vec()
        };
        let tree = tree.map(Dd::to_f64);
        let reference = |x: &[f64]| {
            let g = of(x);
            chapter::inverse_dynamics(&tree, &g[0], &g[1], &g[2]).as_slice().to_vec()
        };
        add("reference formulation, f64", &reference, &exact);
    }
    // its error is that of the truth, found with the 25-digit values of the data
    let wide = &case.robot.model;
    let start = Instant::now();
    let repeats = 20;
    for x in states.iter().take(repeats) {
        let groups: Vec<Vec<Dd>> =
            of(x).iter().map(|g| g.iter().map(|v| Dd::constant(Dd::from(*v))).collect()).collect();
        std::hint::black_box(function.evaluate(wide, &[], method, &groups));
    }
    let time = start.elapsed().as_nanos() as f64 / repeats as f64;
    let exact = check_truth(data, case, function);
    let name = "double-double, generic runtime".to_string();
    methods.push(Method { name, group: Group::Library, time: [time; 3], rms: exact / 3.0, worst: exact, cap: None });
    methods
}

/// What it says: nanoseconds per call; its results, state after state, go to a file.
const PINOCCHIO: &str = r#"
import sys, time
import numpy as np
import pinocchio as pin
file, floating, function, states, results, joints = sys.argv[1:]
root = [pin.JointModelFreeFlyer()] if floating == "true" else []
model = pin.buildModelFromUrdf(file, *root)
data = model.createData()
x = np.fromfile(states).reshape(-1, model.nq + 2 * model.nv)
q, v, u = np.split(x, [model.nq, model.nq + model.nv], axis=1)
# its own order of the joints: where each of ours stands
ids = [model.getJointId(name) for name in joints.split(",")]
base = range(len(root))
iq = [k for _ in base for k in range(7)] + [model.joints[i].idx_q for i in ids if i > len(root)]
iv = [k for _ in base for k in range(6)] + [model.joints[i].idx_v for i in ids if i > len(root)]
def placed(rows, at):
    out = np.empty_like(rows)
    out[:, at] = rows
    return list(out)
q, v, u = placed(q, iq), placed(v, iv), placed(u, iv)
call = {"inverse_dynamics": pin.rnea, "forward_dynamics": pin.aba}[function]
np.array([call(model, data, *s)[iv] for s in zip(q, v, u)]).tofile(results)
best = float("inf")
for _ in range(15):
    start = time.perf_counter_ns()
    for k in range(len(q)): call(model, data, q[k], v[k], u[k])
    best = min(best, (time.perf_counter_ns() - start) / len(q))
print(best)
"#;

/// Pinocchio through Python, where it is installed and the robot is one that it reads.
///
/// # Errors
/// Why it is not in the chart.
fn peer(
    data: &Data,
    function: Function,
    folder: &Folder,
    states: &Path,
    truths: &[Vec<Dd>],
    greatest: f64,
) -> Result<Option<Method>, String> {
    let reads = data.file.extension().is_some_and(|e| e == "urdf");
    if !reads || !matches!(function, Function::InverseDynamics | Function::ForwardDynamics) {
        return Ok(None);
    }
    let python = std::env::var_os(PEERS).ok_or_else(|| format!("no peers: {PEERS} is not set"))?;
    let results = folder.file("pinocchio");
    let floating = data.floating.to_string();
    let output = Command::new(python)
        .args(["-c", PINOCCHIO])
        .arg(&data.file)
        .args([&floating, function.name()])
        .args([states, &results])
        .arg(data.joints.join(","))
        .output()
        .map_err(|e| format!("no peers: {e}"))?;
    let said = String::from_utf8_lossy(&output.stdout);
    let time: f64 =
        said.trim().parse().map_err(|_| format!("no peers: {}", String::from_utf8_lossy(&output.stderr)))?;
    let bytes = std::fs::read(&results).map_err(|e| format!("no peers: {e}"))?;
    let numbers: Vec<f64> =
        bytes.chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().expect("eight bytes"))).collect();
    let (mut squares, mut worst) = (0.0, 0.0f64);
    for (computed, truth) in numbers.chunks_exact(truths[0].len()).zip(truths) {
        let e = error(computed, truth);
        squares += e * e;
        worst = worst.max(e);
    }
    let rms = (squares / truths.len() as f64).sqrt() / greatest;
    let name = "Pinocchio, through Python".to_string();
    Ok(Some(Method { name, group: Group::Library, time: [time; 3], rms, worst: worst / greatest, cap: None }))
}

/// Best nanoseconds per call of several runs of a millisecond.
fn best_time(mut call: impl FnMut()) -> f64 {
    let mut repeats = 1usize;
    let mut run = |repeats: usize| {
        let start = Instant::now();
        (0..repeats).for_each(|_| call());
        start.elapsed().as_nanos() as f64
    };
    while run(repeats) < 1e6 {
        repeats *= 2;
    }
    (0..15).map(|_| run(repeats) / repeats as f64).fold(f64::INFINITY, f64::min)
}

/// The truth against values of 25 digits: the worst scaled error of the states of the data.
fn check_truth(data: &Data, case: &Case, function: Function) -> f64 {
    let mut options = case.options.clone();
    // as in the data, angles are as written
    options.model.angle_tolerance = 0.0;
    let program = programs::of_robot(data, function, &options);
    let mut worst = 0.0f64;
    for state in data.states.iter().filter(|s| s.gravity.is_none()) {
        let Some(expected) = data.expected(state, function) else { continue };
        let mut inputs: Vec<Vec<Dd>> = programs::cast(&state.inputs(function));
        if data.floating {
            let norm = inputs[0][3..7].iter().fold(Dd::ZERO, |sum, x| sum + *x * *x).sqrt();
            inputs[0][3..7].iter_mut().for_each(|x| *x /= norm);
        }
        worst = worst.max(expected.worst(&programs::run::<Dd>(&program, &inputs)).0);
    }
    worst
}

/// Straight-line code that fills the instruction cache between cold calls: what a control loop does besides.
fn other_code() -> String {
    let mut text = String::from(
        "mod other {\n    #[inline(never)]\n    pub fn run(k: usize) {\n        let (mut a, mut b) = (k as f64, 0.5f64);\n",
    );
    for i in 0..12_000 {
        text.push_str(&format!("        a = a * {}.5 + b; b = b + a * 1e-{};\n", i % 3, 3 + i % 5));
    }
    text.push_str("        std::hint::black_box((a, b));\n    }\n}\n");
    text
}
