//! Derivatives of the motion that drives make, beside differences of eighth order of that motion in double-double.

use super::driven_physics::{distance, random_drive, source, wide};
use straightline_codegen::diagnostic::Source;
use straightline_codegen::model::ModelOptions;
use straightline_codegen::Function::{DrivenForwardDynamics, DrivenForwardDynamicsDerivatives};
use straightline_core::Dd;
use straightline_generated_tests::drives::{blocks, Driven};
use straightline_generated_tests::random::Random;

/// Of steps of ±1 to ±4: f' h = Σ c_k (f(k h) − f(−k h)), to h⁸.
const WEIGHTS: [(f64, f64); 4] = [(4.0, 5.0), (-1.0, 5.0), (4.0, 105.0), (-1.0, 280.0)];
/// Short enough for what h⁸ leaves, long enough for the digits that differences lose.
const STEP: f64 = 1.0 / 4096.0;
/// h⁸ is 1e-29; stiff springs and fast motors make the ninth derivative that much larger.
const MOST: f64 = 1e-18;

/// Instead of the planar arm's, which has no mass.
const HEAVY_BASE: &str = r#"<link name="base"><inertial><origin xyz="0.02 -0.01 0.03"/><mass value="3.5"/>
    <inertia ixx="0.04" iyy="0.05" izz="0.06" ixy="0.001" ixz="-0.002" iyz="0.003"/></inertial></link>"#;

/// q, q̇, x, u.
type DrivenState = [Vec<Dd>; 4];

/// The state with coordinate `k` of a block moved by `step`; of a floating base along its own axes.
fn moved(at: &DrivenState, block: usize, k: usize, step: Dd, floating: bool) -> DrivenState {
    let mut at = at.clone();
    match (block, floating) {
        (0, true) if k < 3 => {
            let [x, y, z, w] = [3, 4, 5, 6].map(|i| at[0][i]);
            // column k of the rotation of (x, y, z, w)
            let (two, one) = (Dd::from(2.0), Dd::ONE);
            let column = match k {
                0 => [one - two * (y * y + z * z), two * (x * y + w * z), two * (x * z - w * y)],
                1 => [two * (x * y - w * z), one - two * (x * x + z * z), two * (y * z + w * x)],
                _ => [two * (x * z + w * y), two * (y * z - w * x), one - two * (x * x + y * y)],
            };
            (0..3).for_each(|i| at[0][i] += step * column[i]);
        }
        (0, true) if k < 6 => {
            let (s, c) = (step * Dd::from(0.5)).sin_cos();
            let [x, y, z, w] = [3, 4, 5, 6].map(|i| at[0][i]);
            // (x, y, z, w) times a turn by the step about axis k − 3
            let turned = match k {
                3 => [x * c + w * s, y * c + z * s, z * c - y * s, w * c - x * s],
                4 => [x * c - z * s, y * c + w * s, z * c + x * s, w * c - y * s],
                _ => [x * c + y * s, y * c - x * s, z * c + w * s, w * c - z * s],
            };
            at[0][3..7].copy_from_slice(&turned);
        }
        (0, true) => at[0][k + 1] += step,
        _ => at[block][k] += step,
    }
    at
}

fn agree_with_differences(robot: &str, seed: u64, floating_base: bool) {
    let mut random = Random(seed);
    let (mut source, options) = (source(robot), ModelOptions { floating_base, ..ModelOptions::default() });
    if floating_base {
        let text = source.text().replace(r#"<link name="base"/>"#, HEAVY_BASE);
        assert_ne!(text, source.text(), "the base has a mass now, as what floats must have");
        source = Source::new(source.path(), text);
    }
    let plain = Driven::new(&source, &options, "").robot;
    let mut joints: Vec<_> = plain.model.free_joints().filter(|j| j.kind.nv() == 1).collect();
    joints.sort_by_key(|j| j.iv);
    let joints: Vec<String> = joints.iter().map(|j| j.name.clone()).collect();
    let drives: Vec<_> =
        (0..joints.len()).map(|k| random_drive(&mut random, k, &joints, seed.is_multiple_of(2))).collect();
    let text: String = drives.iter().map(|d| d.text.as_str()).collect();
    let driven = Driven::new(&source, &options, &text);
    let (nq, nv) = (plain.model.nq(), plain.model.nv());
    let mut q = random.list(nq, 2.5);
    if floating_base {
        q[3..7].copy_from_slice(&[0.1, -0.5, 0.7, 0.5]);
    }
    let x: Vec<f64> = drives.iter().flat_map(|d| d.state.clone()).collect();
    let at: DrivenState = [wide(&q), wide(&random.list(nv, 2.0)), wide(&x), wide(&random.list(drives.len(), 20.0))];
    let (motion, derivatives) =
        (driven.program(DrivenForwardDynamics), driven.program(DrivenForwardDynamicsDerivatives));
    fn named(at: &DrivenState) -> [(&'static str, &[Dd]); 4] {
        let [q, qd, x, u] = at;
        [("q", q), ("qd", qd), ("x", x), ("u", u)]
    }
    let found = blocks(&derivatives, &named(&at));
    let values = blocks(&motion, &named(&at));
    let said = format!("{robot}, seed {seed}:\n{text}");
    for k in 0..2 {
        assert!(distance(&found[k], &values[k]) < 1e-24, "values {k}: {:e}\n{said}", distance(&found[k], &values[k]));
    }
    for (block, n) in [nv, nv, x.len(), drives.len()].into_iter().enumerate() {
        // a column of ∂q̈ and of ∂ẋ per coordinate
        let columns: Vec<[Vec<Dd>; 2]> = (0..n)
            .map(|k| {
                let step = |times: f64| {
                    let to = moved(&at, block, k, Dd::from(times * STEP), floating_base);
                    blocks(&motion, &named(&to))
                };
                let mut sums = [0, 1].map(|i| vec![Dd::ZERO; values[i].len()]);
                for (steps, (over, under)) in (1..).zip(WEIGHTS) {
                    let weight = Dd::from(over) / Dd::from(under) / Dd::from(STEP);
                    let (ahead, behind) = (step(f64::from(steps)), step(-f64::from(steps)));
                    for i in 0..2 {
                        let differences = ahead[i].iter().zip(&behind[i]).map(|(a, b)| weight * (*a - *b));
                        sums[i].iter_mut().zip(differences).for_each(|(sum, x)| *sum += x);
                    }
                }
                sums
            })
            .collect();
        for i in 0..2 {
            let rows = values[i].len();
            let truth: Vec<Dd> = (0..rows).flat_map(|row| columns.iter().map(move |c| c[i][row])).collect();
            let off = distance(&found[2 + 4 * i + block], &truth);
            assert!(off < MOST, "block {block} of {i}: {off:e}\n{said}");
        }
    }
}

#[test]
fn derivatives_of_driven_motion_are_those_of_differences() {
    for seed in 0..8 {
        agree_with_differences("planar2r", seed, false);
    }
    for seed in 8..12 {
        agree_with_differences("chapter_stanford", seed, false);
    }
    agree_with_differences("planar2r", 12, true);
    agree_with_differences("planar2r", 13, true);
}
