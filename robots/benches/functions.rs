//! Every function of the robots that are compiled at build time: time warm and cold, error, operations and size, in one row.
//!
//! `cargo bench -p straightline-robots --features bench --bench functions [FILTER]` prints criterion's report, then the
//! table. Warm: another one of 1024 states at each call. Cold: caches and branch predictors are filled with other things before
//! each call, as in a control loop with other work; a read of the clock is in that time. Both are the tenth percentile of the
//! samples, which other work on the machine moves less than the median. The error is against the generic runtime
//! over double-double, the worst of the states, relative to the largest component of the result. Code is of this program's
//! instructions, in bytes; on x86-64 they are read: the most bytes of stack that the function or one of its parts sets aside, and
//! how many of its instructions read from and write to the stack: values that do not fit into registers.

mod machine_code;

use criterion::Criterion;
use machine_code::{MachineCode, Spills};
use std::cell::RefCell;
use std::hint::black_box;
use std::path::Path;
use std::rc::Rc;
use std::time::{Duration, Instant};
use straightline_codegen::diagnostic::Source;
use straightline_codegen::function::ForwardDynamicsMethod;
use straightline_codegen::model::{self, ModelOptions};
use straightline_codegen::Function;
use straightline_core::{Dd, Real};

const STATES: usize = 1024;
/// More than a level-2 cache.
const ELSEWHERE: usize = 8 << 20;

/// The inputs of all functions.
struct State {
    q: Vec<f64>,
    qd: Vec<f64>,
    qdd: Vec<f64>,
    tau: Vec<f64>,
}

/// A robot's compiled functions.
struct Subject {
    name: &'static str,
    file: &'static str,
    options: ModelOptions,
    states: Rc<Vec<State>>,
    cases: Vec<Case>,
}

/// A compiled function.
struct Case {
    function: Function,
    /// Multiplications, additions, divisions, pairs of sine and cosine.
    cost: [u32; 4],
    /// Its result in a state.
    value: Box<dyn Fn(usize) -> Vec<f64>>,
    /// The time of so many calls.
    warm: Box<dyn Fn(u64) -> Duration>,
    cold: Box<dyn Fn(u64) -> Duration>,
}

/// Results as a list.
trait Flat: Clone {
    fn flat(&self) -> Vec<f64>;
}

impl<const N: usize> Flat for [f64; N] {
    fn flat(&self) -> Vec<f64> {
        self.to_vec()
    }
}

impl<const N: usize, const M: usize> Flat for [[f64; N]; M] {
    fn flat(&self) -> Vec<f64> {
        self.concat()
    }
}

fn case<S: 'static, Y: Flat + 'static>(
    function: Function,
    cost: [u32; 4],
    states: &Rc<Vec<S>>,
    zero: Y,
    call: impl Fn(&S, &mut Y) + Copy + 'static,
) -> Case {
    let value = {
        let (states, zero) = (states.clone(), zero.clone());
        move |i: usize| {
            let mut y = zero.clone();
            call(&states[i], &mut y);
            y.flat()
        }
    };
    let warm = {
        let (states, zero) = (states.clone(), zero.clone());
        move |calls: u64| {
            let mut y = zero.clone();
            let start = Instant::now();
            for i in 0..calls {
                call(black_box(&states[i as usize % STATES]), &mut y);
                black_box(&y);
            }
            start.elapsed()
        }
    };
    let cold = {
        let states = states.clone();
        let elsewhere = RefCell::new(vec![1u64; ELSEWHERE / 8]);
        move |calls: u64| {
            let mut y = zero.clone();
            let mut time = Duration::ZERO;
            for i in 0..calls {
                elsewhere.borrow_mut().iter_mut().step_by(8).for_each(|x| *x = x.wrapping_mul(3));
                black_box(&elsewhere);
                let start = Instant::now();
                call(black_box(&states[i as usize % STATES]), &mut y);
                black_box(&y);
                time += start.elapsed();
            }
            time
        }
    };
    Case { function, cost, value: Box::new(value), warm: Box::new(warm), cold: Box::new(cold) }
}

fn array<const N: usize>(x: &[f64]) -> [f64; N] {
    x.try_into().expect("a state of the robot's size")
}

fn random_states(nq: usize, nv: usize) -> Vec<State> {
    let mut bits = 0x9e37_79b9_7f4a_7c15_u64;
    let mut list = |n: usize, size: f64| -> Vec<f64> {
        let mut uniform = || {
            bits ^= bits << 13;
            bits ^= bits >> 7;
            bits ^= bits << 17;
            (bits >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        };
        (0..n).map(|_| size * uniform()).collect()
    };
    let state = |_| {
        let mut q = list(nq, 3.0);
        if nq > nv {
            let norm = q[3..7].iter().map(|x| x * x).sum::<f64>().sqrt();
            q[3..7].iter_mut().for_each(|x| *x /= norm);
        }
        State { q, qd: list(nv, 2.0), qdd: list(nv, 5.0), tau: list(nv, 20.0) }
    };
    (0..STATES).map(state).collect()
}

macro_rules! subject {
    ($module:ident, $file:literal, $options:expr) => {{
        use straightline_robots::$module as robot;
        const NV: usize = robot::NV;
        let states = Rc::new(random_states(robot::NQ, NV));
        let arrays =
            |s: &State| (array::<{ robot::NQ }>(&s.q), array::<NV>(&s.qd), array::<NV>(&s.qdd), array::<NV>(&s.tau));
        let typed = Rc::new(states.iter().map(arrays).collect::<Vec<_>>());
        let cost = |c: robot::Cost| [c.mul, c.add, c.div, c.sin_cos];
        let cases = vec![
            case(Function::InverseDynamics, cost(robot::INVERSE_DYNAMICS_COST), &typed, [0.0; NV], |s, y| {
                robot::inverse_dynamics(&s.0, &s.1, &s.2, y)
            }),
            case(Function::GravityForce, cost(robot::GRAVITY_FORCE_COST), &typed, [0.0; NV], |s, y| {
                robot::gravity_force(&s.0, y)
            }),
            case(Function::BiasForce, cost(robot::BIAS_FORCE_COST), &typed, [0.0; NV], |s, y| {
                robot::bias_force(&s.0, &s.1, y)
            }),
            case(Function::MassMatrix, cost(robot::MASS_MATRIX_COST), &typed, [[0.0; NV]; NV], |s, y| {
                robot::mass_matrix(&s.0, y)
            }),
            case(Function::ForwardDynamics, cost(robot::FORWARD_DYNAMICS_COST), &typed, [0.0; NV], |s, y| {
                robot::forward_dynamics(&s.0, &s.1, &s.3, y)
            }),
            case(Function::Energy, cost(robot::ENERGY_COST), &typed, [0.0; 2], |s, y| robot::energy(&s.0, &s.1, y)),
        ];
        Subject { name: stringify!($module), file: $file, options: $options, states, cases }
    }};
}

impl State {
    fn inputs(&self, function: Function) -> Vec<Vec<f64>> {
        use Function::*;
        let all: &[&Vec<f64>] = match function {
            InverseDynamics => &[&self.q, &self.qd, &self.qdd],
            ForwardDynamics => &[&self.q, &self.qd, &self.tau],
            BiasForce | Energy => &[&self.q, &self.qd],
            _ => &[&self.q],
        };
        all.iter().map(|x| x.to_vec()).collect()
    }
}

impl Subject {
    /// The worst relative error of a function over some of the states.
    fn error(&self, case: &Case) -> f64 {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("descriptions").join(self.file);
        let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let model = model::load(&Source::new(self.file, text), &self.options).0.expect("the build read the same file");
        let of_state = |i: usize| {
            let wide = |x: Vec<f64>| x.into_iter().map(|x| Dd::constant(Dd::from(x))).collect();
            let inputs: Vec<Vec<Dd>> = self.states[i].inputs(case.function).into_iter().map(wide).collect();
            let truth = case.function.evaluate(&model, &[], ForwardDynamicsMethod::ArticulatedBody, &inputs);
            let largest = truth.iter().map(|x| x.to_f64().abs()).fold(0.0, f64::max);
            let value = (case.value)(i);
            value.iter().zip(&truth).map(|(x, t)| (Dd::from(*x) - *t).to_f64().abs() / largest).fold(0.0, f64::max)
        };
        (0..STATES).step_by(16).map(of_state).fold(0.0, f64::max)
    }
}

fn main() {
    let right_angles = ModelOptions { angle_tolerance: 1e-11, ..ModelOptions::default() };
    let floating = ModelOptions { floating_base: true, ..ModelOptions::default() };
    let subjects = [
        subject!(puma560, "puma560.urdf", ModelOptions::default()),
        subject!(ur5, "ur5.urdf", right_angles),
        subject!(panda, "panda.urdf", ModelOptions::default()),
        subject!(solo12, "solo12.urdf", floating),
    ];
    let mut criterion = Criterion::default()
        .sample_size(20)
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_millis(600))
        .configure_from_args();
    let own = std::fs::read(std::env::current_exe().expect("a program has a path")).expect("it can be read");
    let program = object::File::parse(&*own).expect("a program has a known format");
    let mut table = String::new();
    for subject in &subjects {
        for case in &subject.cases {
            let name = case.function.name();
            let mut group = criterion.benchmark_group(format!("{}/{name}", subject.name));
            let mut time_of = |what: &str, time: &dyn Fn(u64) -> Duration| {
                let samples = RefCell::new(Vec::new());
                group.bench_function(what, |bencher| {
                    bencher.iter_custom(|calls| {
                        let time = time(calls);
                        samples.borrow_mut().push(time.as_nanos() as f64 / calls as f64);
                        time
                    });
                });
                let mut samples = samples.into_inner();
                samples.sort_by(f64::total_cmp);
                samples.get(samples.len() / 10).copied()
            };
            let times = (time_of("warm", &case.warm), time_of("cold", &case.cold));
            group.finish();
            // those that the command line leaves out have no time
            let (Some(warm), Some(cold)) = times else { continue };
            let [mul, add, div, sin_cos] = case.cost;
            let code = MachineCode::of(&program, subject.name, name);
            let spills = code.spills.map_or("- | - | -".to_string(), |Spills { frame, reads, writes }| {
                format!("{frame} | {reads} | {writes}")
            });
            table.push_str(&format!(
                "| {} | {name} | {warm:.1} | {cold:.0} | {:.1e} | {mul} / {add}{}, {sin_cos} | {} | {spills} |\n",
                subject.name,
                subject.error(case),
                if div > 0 { format!(" + {div} div") } else { String::new() },
                code.bytes,
            ));
        }
    }
    println!(
        "\n| robot | function | warm [ns] | cold [ns] | error | mul / add, sincos | code [bytes] | stack [bytes] | reads | writes |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|\n{table}");
    criterion.final_summary();
}
