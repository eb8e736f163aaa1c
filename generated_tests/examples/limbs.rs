//! What a single call would gain if the legs of a quadruped were lanes of one body.
//!
//! `cargo run -p straightline-generated-tests --example limbs`; recorded in `record/2026-11-21-limbs.md`.
//!
//! Torques and the mass matrix of HyQ and Solo12 as they are generated, and of the trunk with one leg, generated over lanes and run
//! with the four legs in four of them: inputs put into lanes, results taken out, forces on the trunk added up. A leg's
//! constants are those of the first one in every lane, so the numbers are not the robot's; operations, moves and places in
//! memory are those that code for four legs would have, and the trunk's own part is computed by every lane.

use straightline_codegen::emit::Lanes;
use straightline_codegen::model::ModelOptions;
use straightline_codegen::{compile, Function, Options, Source};
use straightline_generated_tests::standalone::{run, Folder};

/// The file, its name, and how the names of the legs' links and joints begin, the first leg first.
const ROBOTS: [(&str, &str, [&str; 4]); 2] =
    [("hyq.urdf", "HyQ", ["lf_", "lh_", "rf_", "rh_"]), ("solo12.urdf", "Solo12", ["FL_", "FR_", "HL_", "HR_"])];

/// The file without the links and joints whose names begin so.
fn without(text: &str, prefixes: &[&str]) -> String {
    let mut text = text.to_string();
    for element in ["link", "joint"] {
        for prefix in prefixes {
            while let Some(start) = text.find(&format!("<{element} name=\"{prefix}")) {
                let end = format!("</{element}>");
                let length = text[start..].find(&end).expect("the element ends") + end.len();
                text.replace_range(start..start + length, "");
            }
        }
    }
    text
}

fn generated(text: String, fma: bool) -> String {
    let options = Options {
        functions: vec![Function::InverseDynamics, Function::MassMatrix],
        model: ModelOptions { floating_base: true, ..ModelOptions::default() },
        lanes: Some(Lanes::Standalone),
        fma,
        ..Options::default()
    };
    compile(&Source::new("robot.urdf", text), &options).unwrap_or_else(|d| panic!("{}", d.render())).text
}

const PROGRAM: &str = r#"
use std::{hint::black_box, time::Instant};

#[inline(never)]
fn whole_id(q: &[f64; 19], v: &[f64; 18], a: &[f64; 18], tau: &mut [f64; 18]) {
    whole::inverse_dynamics(q, v, a, tau)
}

#[inline(never)]
fn legs_id(q: &[f64; 19], v: &[f64; 18], a: &[f64; 18], tau: &mut [f64; 18]) {
    let (mut ql, mut vl, mut al, mut tl) = ([[0.0; 4]; 10], [[0.0; 4]; 9], [[0.0; 4]; 9], [[0.0; 4]; 9]);
    for c in 0..7 {
        ql[c] = [q[c]; 4];
    }
    for c in 0..6 {
        (vl[c], al[c]) = ([v[c]; 4], [a[c]; 4]);
    }
    for j in 0..3 {
        for l in 0..4 {
            (ql[7 + j][l], vl[6 + j][l], al[6 + j][l]) = (q[7 + 3 * l + j], v[6 + 3 * l + j], a[6 + 3 * l + j]);
        }
    }
    leg::inverse_dynamics_lanes::<4>(&ql, &vl, &al, &mut tl);
    for c in 0..6 {
        tau[c] = (tl[c][0] + tl[c][1]) + (tl[c][2] + tl[c][3]);
    }
    for j in 0..3 {
        for l in 0..4 {
            tau[6 + 3 * l + j] = tl[6 + j][l];
        }
    }
}

#[inline(never)]
fn whole_h(q: &[f64; 19], h: &mut [[f64; 18]; 18]) {
    whole::mass_matrix(q, h)
}

#[inline(never)]
fn legs_h(q: &[f64; 19], h: &mut [[f64; 18]; 18]) {
    let (mut ql, mut hl) = ([[0.0; 4]; 10], [[[0.0; 4]; 9]; 9]);
    for c in 0..7 {
        ql[c] = [q[c]; 4];
    }
    for j in 0..3 {
        for l in 0..4 {
            ql[7 + j][l] = q[7 + 3 * l + j];
        }
    }
    leg::mass_matrix_lanes::<4>(&ql, &mut hl);
    *h = [[0.0; 18]; 18];
    for r in 0..6 {
        for c in 0..6 {
            h[r][c] = (hl[r][c][0] + hl[r][c][1]) + (hl[r][c][2] + hl[r][c][3]);
        }
    }
    for j in 0..3 {
        for l in 0..4 {
            let row = 6 + 3 * l + j;
            for c in 0..6 {
                (h[row][c], h[c][row]) = (hl[6 + j][c][l], hl[6 + j][c][l]);
            }
            for k in 0..3 {
                h[row][6 + 3 * l + k] = hl[6 + j][6 + k][l];
            }
        }
    }
}

fn main() {
    const STATES: usize = 1024;
    let mut seed = 1u64;
    let mut next = || {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1);
        (seed >> 40) as f64 / 8388608.0 - 1.0
    };
    let states: Vec<([f64; 19], [f64; 18], [f64; 18])> = (0..STATES)
        .map(|_| (std::array::from_fn(|_| next()), std::array::from_fn(|_| next()), std::array::from_fn(|_| next())))
        .collect();
    let (mut tau, mut h) = ([0.0; 18], [[0.0; 18]; 18]);
    type Id = fn(&[f64; 19], &[f64; 18], &[f64; 18], &mut [f64; 18]);
    type H = fn(&[f64; 19], &mut [[f64; 18]; 18]);
    // warm: calls that may overlap, best of rounds that take turns
    let mut best = [f64::INFINITY; 4];
    for _ in 0..100 {
        for (i, f) in [whole_id as Id, legs_id].into_iter().enumerate() {
            let start = Instant::now();
            states.iter().for_each(|(q, v, a)| {
                f(black_box(q), v, a, &mut tau);
                black_box(&tau);
            });
            best[i] = best[i].min(start.elapsed().as_nanos() as f64 / STATES as f64);
        }
        for (i, f) in [whole_h as H, legs_h].into_iter().enumerate() {
            let start = Instant::now();
            states.iter().for_each(|(q, _, _)| {
                f(black_box(q), &mut h);
                black_box(&h);
            });
            best[2 + i] = best[2 + i].min(start.elapsed().as_nanos() as f64 / STATES as f64);
        }
    }
    // cold: 16 MB of other data touched before each call
    let mut other = vec![1u8; 16 << 20];
    let mut cold = [const { Vec::new() }; 2];
    for (q, v, a) in &states[..400] {
        for (i, f) in [whole_id as Id, legs_id].into_iter().enumerate() {
            other.iter_mut().step_by(64).for_each(|x| *x = x.wrapping_add(1));
            black_box(&other);
            let start = Instant::now();
            f(black_box(q), v, a, &mut tau);
            black_box(&tau);
            cold[i].push(start.elapsed().as_nanos());
        }
    }
    cold.iter_mut().for_each(|times| times.sort_unstable());
    println!("{:.0} {:.0} {:.0} {:.0} {} {}", best[0], best[1], best[2], best[3], cold[0][200], cold[1][200]);
}
"#;

fn main() {
    let folder = Folder::new("limbs");
    let files = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/descriptions");
    println!(
        "| robot | instructions | torques, ns | legs in lanes | cold | legs in lanes | mass matrix | legs in lanes |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for (file, name, legs) in ROBOTS {
        let text = std::fs::read_to_string(files.join(file)).expect("the file is there");
        for (instructions, fma, flags) in [
            ("any x86-64", false, vec![]),
            ("this machine's", false, vec!["-Ctarget-cpu=native"]),
            ("this machine's, fused", true, vec!["-Ctarget-cpu=native"]),
        ] {
            let source = format!(
                "#![allow(warnings)]\nmod whole {{\n{}\n}}\nmod leg {{\n{}\n}}\n{PROGRAM}",
                generated(text.clone(), fma),
                generated(without(&text, &legs[1..]), fma)
            );
            let program = folder.build("limbs", &source, &flags).unwrap_or_else(|e| panic!("{e}"));
            let printed = run(&program, &[]).unwrap_or_else(|e| panic!("{e}"));
            let [id, legs_id, h, legs_h, cold, legs_cold] =
                printed.split_whitespace().collect::<Vec<_>>().try_into().expect("six figures");
            println!("| {name} | {instructions} | {id} | {legs_id} | {cold} | {legs_cold} | {h} | {legs_h} |");
        }
    }
}
