//! Other forms of the same functions, in states that are hard: lanes and batches, and functions over any scalar.

use super::outcome::{Outcome, Size};
use super::robots::Judged;
use straightline_codegen::verify::reference_input::centre_of_mass_tree;
use straightline_codegen::{description, Function};
use straightline_core::{Dd, Real};
use straightline_generated_tests::compiled;
use straightline_generated_tests::compiled::generic_panda as panda;
use straightline_generated_tests::compiled::lanes_solo12 as solo12;
use straightline_generated_tests::programs;
use straightline_generated_tests::random::Random;
use straightline_generated_tests::reference::Expected;

/// Speeds from those whose squares are subnormal to huge ones, and angles beyond the domain, which give NaN in their state alone.
fn hard_list(n: usize, state: usize, random: &mut Random) -> [Vec<f64>; 3] {
    let (angle, speed, drive) = match state % 5 {
        0 => (3.0, 3.0, 10.0),
        1 => (3.0, 1e-160, 0.0),
        2 => (1e6, 1e3, 10.0),
        3 => (1e-8, 1e-20, 1e-20),
        _ => (1e9, 3.0, 10.0),
    };
    [angle, speed, drive].map(|size| random.list(n, size))
}

fn same(a: f64, b: f64) -> bool {
    a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan()
}

pub fn lanes(size: Size) -> Vec<Outcome> {
    const WIDTH: usize = 8;
    let mut random = Random(22);
    let states = size.pick(37, 20_011);
    let (mut q, mut qd, mut qdd) = (Vec::new(), Vec::new(), Vec::new());
    for state in 0..states {
        let [mut angles, speeds, rates] = hard_list(18, state, &mut random);
        let mut base = random.list(3, 2.0);
        base.extend([0.5, -0.5, 0.1, 0.7]); // length one
        base.extend(angles.drain(6..));
        q.push(<[f64; 19]>::try_from(base).expect("19 coordinates"));
        qd.push(<[f64; 18]>::try_from(speeds).expect("18 speeds"));
        qdd.push(<[f64; 18]>::try_from(rates).expect("18 rates"));
    }
    let mut outcomes = Vec::new();
    macro_rules! compared {
        ($name:literal, $one:path, $lanes:path, $batch:path) => {{
            let alone: Vec<[f64; 18]> = (0..states)
                .map(|s| {
                    let mut y = [0.0; 18];
                    $one(&q[s], &qd[s], &qdd[s], &mut y);
                    y
                })
                .collect();
            let mut other = [0usize; 2];
            for block in 0..states / WIDTH {
                let lane = |l: usize| block * WIDTH + l;
                let (a, b, c) = (
                    std::array::from_fn(|i| std::array::from_fn(|l| q[lane(l)][i])),
                    std::array::from_fn(|i| std::array::from_fn(|l| qd[lane(l)][i])),
                    std::array::from_fn(|i| std::array::from_fn(|l| qdd[lane(l)][i])),
                );
                let mut y = [[0.0; WIDTH]; 18];
                $lanes(&a, &b, &c, &mut y);
                let differs = |(i, l): &(usize, usize)| !same(y[*i][*l], alone[lane(*l)][*i]);
                other[0] += (0..18).flat_map(|i| (0..WIDTH).map(move |l| (i, l))).filter(differs).count();
            }
            let mut y = vec![0.0; 18 * states];
            $batch(states, q.as_flattened(), qd.as_flattened(), qdd.as_flattened(), &mut y).expect("lengths agree");
            other[1] = y.iter().zip(alone.as_flattened()).filter(|(a, b)| !same(**a, **b)).count();
            for (what, other) in [("8 lanes", other[0]), ("a batch by this machine's vectors", other[1])] {
                let what = format!("f64 {}, {what}: results of {states} hard states other than alone", $name);
                outcomes.push(Outcome::new(22, "solo12", what, other as f64, 0.0));
            }
        }};
    }
    compared!(
        "inverse dynamics",
        solo12::inverse_dynamics,
        solo12::inverse_dynamics_lanes,
        solo12::inverse_dynamics_batch_aos
    );
    compared!(
        "forward dynamics",
        solo12::forward_dynamics,
        solo12::forward_dynamics_lanes,
        solo12::forward_dynamics_batch_aos
    );
    outcomes
}

/// Functions over any scalar: at f64 the bits of the plain ones, in double-double the second author's results.
pub fn any_scalar(size: Size) -> Vec<Outcome> {
    let judged = Judged::new("panda");
    let options = programs::options(&judged.robot).model;
    let described = description::read(&programs::source(&judged.robot), &mut Default::default()).expect("a robot file");
    let tree = centre_of_mass_tree(&described, &options).expect("the reference's robots are trees");
    let plain = compiled::robot("panda");
    let mut random = Random(14);
    let (mut other, mut worst) = (0, 0.0f64);
    let states = size.pick(10, 1000);
    for state in 0..states {
        let x = hard_list(7, state, &mut random);
        let array = |k: usize| -> [f64; 7] { x[k].as_slice().try_into().expect("seven joints") };
        let mut tau = [0.0; 7];
        panda::inverse_dynamics(&array(0), &array(1), &array(2), &mut tau);
        let alone = plain.call(Function::InverseDynamics, &x);
        other += tau.iter().zip(&alone).filter(|(a, b)| !same(**a, **b)).count();
        if state % 5 == 4 {
            continue; // beyond the domain of f64's sines, where double-double has another
        }
        let [q, qd, qdd] = [0, 1, 2].map(|k| array(k).map(Dd::from));
        let mut tau = [Dd::zero(); 7];
        panda::inverse_dynamics(&q, &qd, &qdd, &mut tau);
        let inputs = [q.to_vec(), qd.to_vec(), qdd.to_vec()];
        let expected = Expected::by_the_second_author(&tree, &[], Function::InverseDynamics, &inputs);
        worst = worst.max(expected.worst(&tau).0);
    }
    let line = |what: String, value: f64, bound: f64| Outcome::new(14, "panda, generic", what, value, bound);
    vec![
        line(
            format!("f64 inverse dynamics: results of {states} hard states other than of the plain function"),
            other as f64,
            0.0,
        ),
        line("double-double inverse dynamics against the second author, of natural scale".to_string(), worst, 1e-30),
    ]
}
