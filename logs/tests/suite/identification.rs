//! Fits whose errors are right for noise that is not white, and bodies that can be.

use crate::common::Noise;
use nalgebra::{DMatrix, DVector, Matrix4};
use straightline_logs::consistent::{is_body, pseudo_inertia, thickened, ConsistencyProblem, ScalarPrior};
use straightline_logs::fit::LeastSquares;
use straightline_logs::smooth::LowPass;
use straightline_logs::weighted::{FitBlock, FitData};

/// Two outputs of three columns each, of which one is shared; noise passes the low-pass at 10 Hz, as measured forces do, and is thinned to 40 Hz.
fn noisy(random: &mut Noise, wanted: &[f64; 5]) -> FitData {
    let (n, step) = (20_000_usize, 1e-3);
    let times: Vec<f64> = (0..n).map(|i| i as f64 * step).collect();
    let mut block = FitBlock::default();
    let noise: Vec<Vec<f64>> = [0.5, 3.0]
        .iter()
        .map(|size| {
            let white: Vec<f64> = times.iter().map(|_| size * random.normal()).collect();
            LowPass { cutoff: 10.0 }.filtered(&white, step)
        })
        .collect();
    for k in (300..n - 300).step_by(25) {
        let t = times[k];
        let (a, b, c) = ((2.1 * t).sin(), (3.3 * t + 1.0).cos(), (0.7 * t).sin() * (5.1 * t).cos());
        for (j, row) in [[a, b, 1.0, 0.0, 0.0], [b, 0.0, 0.0, c, 1.0]].iter().enumerate() {
            block.rows.extend_from_slice(row);
            block.values.push(row.iter().zip(wanted).map(|(y, x)| y * x).sum::<f64>() + noise[j][k]);
        }
    }
    FitData { columns: 5, outputs: 2, blocks: vec![block] }
}

#[test]
fn intervals_of_95_percent_hold_so_often_where_noise_is_smoothed() {
    let (mut random, wanted, runs) = (Noise(5), [1.0, -2.0, 0.3, 4.0, -0.1], 1000);
    let mut inside = [0; 5];
    let mut white = 0;
    for _ in 0..runs {
        let fit = noisy(&mut random, &wanted).fit(8);
        assert!((fit.noise[0] / 0.5 / (fit.noise[1] / 3.0) - 1.0).abs() < 0.5, "{:?}", fit.noise);
        for (k, wanted) in wanted.iter().enumerate() {
            let off = (fit.fitted.coefficients[k] - wanted).abs();
            inside[k] += usize::from(off < 1.96 * fit.fitted.errors[k]);
            white += usize::from(off < 1.96 * fit.fitted.errors[k] / fit.inflation.sqrt());
        }
    }
    // 1000 runs scatter by 0.7 % about the rate
    for count in inside {
        assert!((0.905..0.985).contains(&(f64::from(count as u32) / f64::from(runs))), "{inside:?}");
    }
    // fits of few independent instants take much of the noise, which their errors make up for
    let mean = inside.iter().sum::<usize>() as f64 / f64::from(5 * runs);
    assert!((0.935..0.965).contains(&mean), "{mean}: {inside:?}");
    // as if noise were white they would not
    assert!(f64::from(white as u32) < 0.88 * f64::from(5 * runs), "{white}");
}

#[test]
fn instants_far_from_all_else_are_left_out() {
    let wanted = [1.0, -2.0, 0.3, 4.0, -0.1];
    let mut data = noisy(&mut Noise(8), &wanted);
    for k in 100..120 {
        data.blocks[0].values[2 * k] += 5.0;
    }
    let fit = data.fit(12);
    assert!((20..60).contains(&fit.far), "{}", fit.far);
    for (k, wanted) in wanted.iter().enumerate() {
        assert!((fit.fitted.coefficients[k] - wanted).abs() < 4.0 * fit.fitted.errors[k], "{k}: {fit:?}");
    }
    // held at zero, the others take what they can
    let held = data.fit_holding(&[1, 4], 12);
    assert_eq!([held.fitted.coefficients[1], held.fitted.errors[1], held.fitted.coefficients[4]], [0.0; 3]);
    assert!(held.noise[0] > 1.5 * fit.noise[0] && (held.fitted.coefficients[3] - 4.0).abs() < 0.5, "{held:?}");
}

/// Boxes with some mass, some way from the origin.
fn block(random: &mut Noise) -> [f64; 10] {
    let m = 0.5 + 3.0 * random.positive();
    let [x, y, z] = [0; 3].map(|_| 0.4 * (random.positive() - 0.5));
    let [a, b, c] = [0; 3].map(|_| m * (0.02 + 0.05 * random.positive()).powi(2));
    let (xx, yy, zz) = (b + c + m * (y * y + z * z), a + c + m * (x * x + z * z), a + b + m * (x * x + y * y));
    [m, m * x, m * y, m * z, xx, -m * x * y, -m * x * z, yy, -m * y * z, zz]
}

#[test]
fn bodies_are_what_was_known_where_data_say_nothing_and_what_data_say_where_these_are_sharp() {
    let mut random = Noise(3);
    let known = [block(&mut random), block(&mut random)];
    let made_of: Vec<Vec<f64>> = (0..21).map(|i| (0..21).map(|k| f64::from(u8::from(i == k))).collect()).collect();
    let (scalars, rest) = ([ScalarPrior::Positive(0.2)], [0.0; 21]);
    let solve = |triangle: &DMatrix<f64>, side: &DVector<f64>| {
        let problem = ConsistencyProblem {
            triangle,
            side,
            weight: 1.0,
            made_of: &made_of,
            rest: &rest,
            bodies: &known,
            scalars: &scalars,
        };
        problem.solve().expect("the bodies can be")
    };
    let nothing = solve(&DMatrix::zeros(21, 21), &DVector::zeros(21));
    assert_eq!(nothing.bodies, known);
    assert_eq!((nothing.scalars[0], nothing.steps), (0.2, 0));
    // sharp data of bodies that can be are taken as they are
    let other = [block(&mut random), block(&mut random)];
    let wanted = DVector::from_iterator(21, other.iter().flatten().copied().chain([0.7]));
    let sharp = DMatrix::identity(21, 21) * 1e7;
    let found = solve(&sharp, &(&sharp * &wanted));
    for (found, wanted) in found.bodies.iter().flatten().zip(other.iter().flatten()) {
        assert!((found - wanted).abs() < 1e-9 * (1.0 + wanted.abs()), "{found} {wanted}");
    }
    // of a negative mass a small one is made
    let mut negative = wanted.clone();
    (negative[0], negative[20]) = (-0.3, -0.5);
    let blunt = DMatrix::identity(21, 21) * 100.0;
    let found = solve(&blunt, &(&blunt * &negative));
    assert!(found.bodies.iter().all(is_body) && found.scalars[0] > 0.0 && found.steps < 150, "{found:?}");
    assert!(found.bodies[0][0] < 0.2, "{found:?}");
}

/// At the least, slopes vanish: shifts to all sides lead up, by the same to both.
#[test]
fn what_is_found_is_the_least() {
    let mut random = Noise(11);
    let known = [block(&mut random), block(&mut random), block(&mut random)];
    // combinations of parameters, fewer than these
    let made_of: Vec<Vec<f64>> = (0..12).map(|_| (0..31).map(|_| random.positive() - 0.5).collect()).collect();
    let rest: Vec<f64> = (0..12).map(|_| random.normal()).collect();
    let mut squares = LeastSquares::new(12);
    for _ in 0..40 {
        let row: Vec<f64> = (0..12).map(|_| 10.0 * random.normal()).collect();
        squares.push(&row, 10.0 * random.normal());
    }
    let (triangle, side) = squares.triangle();
    let scalars = [ScalarPrior::Free(2.0)];
    let problem = ConsistencyProblem {
        triangle: &triangle,
        side: &side,
        weight: 0.5,
        made_of: &made_of,
        rest: &rest,
        bodies: &known,
        scalars: &scalars,
    };
    let found = problem.solve().expect("the bodies can be");
    let value = |x: &[f64]| {
        let column = |(row, rest): (&Vec<f64>, &f64)| rest + row.iter().zip(x).map(|(y, x)| y * x).sum::<f64>();
        let off = &triangle * DVector::from_iterator(12, made_of.iter().zip(&rest).map(column)) - &side;
        let divergence = |b: usize| {
            let own: [f64; 10] = std::array::from_fn(|k| x[10 * b + k]);
            let ratio = pseudo_inertia(&known[b]).try_inverse().expect("regular") * pseudo_inertia(&own);
            ratio.trace() - ratio.determinant().ln() - 4.0
        };
        0.25 * off.norm_squared() + (0..3).map(divergence).sum::<f64>() + 0.5 * (x[30] / 2.0).powi(2)
    };
    let x: Vec<f64> = found.bodies.iter().flatten().copied().chain(found.scalars.iter().copied()).collect();
    let least = value(&x);
    let of_pseudo = |p: Matrix4<f64>| -> [f64; 10] {
        let t = p[(0, 0)] + p[(1, 1)] + p[(2, 2)];
        [
            p[(3, 3)],
            p[(0, 3)],
            p[(1, 3)],
            p[(2, 3)],
            t - p[(0, 0)],
            -p[(0, 1)],
            -p[(0, 2)],
            t - p[(1, 1)],
            -p[(1, 2)],
            t - p[(2, 2)],
        ]
    };
    for k in 0..60 {
        // (1 + h S) P (1 + h S)ᵀ stays positive definite
        let turn = Matrix4::from_fn(|_, _| random.uniform());
        let shifted = |h: f64| {
            let mut x = x.clone();
            match k {
                0..3 => x[30] += 0.1 * h * f64::from(k + 1),
                _ => {
                    let (b, by) = ((k % 3) as usize, Matrix4::identity() + turn * h);
                    let own = of_pseudo(by * pseudo_inertia(&found.bodies[b]) * by.transpose());
                    x[10 * b..][..10].copy_from_slice(&own);
                }
            }
            value(&x)
        };
        let (up, down) = (shifted(1e-4) - least, shifted(-1e-4) - least);
        assert!(up > 0.0 && down > 0.0 && (up / down - 1.0).abs() < 0.05, "{k}: {up} {down}");
    }
}

#[test]
fn points_and_rods_become_bodies_and_nothing_stays_nothing() {
    let point = [2.0, 0.2, 0.0, 0.0, 0.0, 0.0, 0.0, 0.02, 0.0, 0.02];
    assert!(!is_body(&point));
    let thick = thickened(&point, 0.01).expect("it has mass");
    assert!(is_body(&thick));
    // about the centre of mass 2/5 … of a ball whose second moments are m r²
    for (k, (was, new)) in point.iter().zip(thick).enumerate() {
        let wanted = if [4, 7, 9].contains(&k) { was + 2.0 * 2.0 * 1e-4 } else { *was };
        assert!((new - wanted).abs() < 1e-12, "{k}: {new} {wanted}");
    }
    assert_eq!(thickened(&[0.0; 10], 0.01), None);
    assert_eq!(thickened(&[f64::NAN; 10], 0.01), None);
    let body = block(&mut Noise(1));
    for (was, new) in body.iter().zip(thickened(&body, 1e-4).expect("a body")) {
        assert!((was - new).abs() < 1e-12, "{was} {new}");
    }
}
