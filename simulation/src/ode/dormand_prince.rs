//! The explicit Runge-Kutta method of order 8 by Dormand and Prince with error estimates of orders 5 and 3 and interpolation of order 7:
//! DOP853 of Hairer, Nørsett and Wanner (Solving Ordinary Differential Equations I, 1993, section II.5), with their test for stiffness.

use super::{AcceptedStep, Piece, Solved, Watch};
use crate::simulate::Failure;
use std::cell::OnceCell;

const STAGES: usize = 12;
/// Nodes cᵢ, of the twelve stages and, from the fourteenth on, of the three that only the interpolation takes.
#[rustfmt::skip]
const C: [f64; 16] = [
    0.0, 0.05260015195876773, 0.0789002279381516, 0.1183503419072274, 0.2816496580927726, 0.3333333333333333, 0.25,
    0.3076923076923077, 0.6512820512820513, 0.6, 0.8571428571428571, 1.0, 1.0, 0.1, 0.2, 0.7777777777777778,
];
/// aᵢⱼ: per stage the stages that it takes, with their weights. The thirteenth is the derivative at the end of the step.
#[rustfmt::skip]
const A: [&[(usize, f64)]; 16] = [
    &[],
    &[(0, 0.05260015195876773)],
    &[(0, 0.0197250569845379), (1, 0.0591751709536137)],
    &[(0, 0.02958758547680685), (2, 0.08876275643042054)],
    &[(0, 0.2413651341592667), (2, -0.8845494793282861), (3, 0.924834003261792)],
    &[(0, 0.037037037037037035), (3, 0.17082860872947386), (4, 0.12546768756682242)],
    &[(0, 0.037109375), (3, 0.17025221101954405), (4, 0.06021653898045596), (5, -0.017578125)],
    &[(0, 0.03709200011850479), (3, 0.17038392571223998), (4, 0.10726203044637328), (5, -0.015319437748624402),
      (6, 0.008273789163814023)],
    &[(0, 0.6241109587160757), (3, -3.3608926294469414), (4, -0.868219346841726), (5, 27.59209969944671),
      (6, 20.154067550477894), (7, -43.48988418106996)],
    &[(0, 0.47766253643826434), (3, -2.4881146199716677), (4, -0.590290826836843), (5, 21.230051448181193),
      (6, 15.279233632882423), (7, -33.28821096898486), (8, -0.020331201708508627)],
    &[(0, -0.9371424300859873), (3, 5.186372428844064), (4, 1.0914373489967295), (5, -8.149787010746927),
      (6, -18.52006565999696), (7, 22.739487099350505), (8, 2.4936055526796523), (9, -3.0467644718982196)],
    &[(0, 2.273310147516538), (3, -10.53449546673725), (4, -2.0008720582248625), (5, -17.9589318631188),
      (6, 27.94888452941996), (7, -2.8589982771350235), (8, -8.87285693353063), (9, 12.360567175794303),
      (10, 0.6433927460157636)],
    &[],
    &[(0, 0.056167502283047954), (6, 0.25350021021662483), (7, -0.2462390374708025), (8, -0.12419142326381637),
      (9, 0.15329179827876568), (10, 0.00820105229563469), (11, 0.007567897660545699), (12, -0.008298)],
    &[(0, 0.03183464816350214), (5, 0.028300909672366776), (6, 0.053541988307438566), (7, -0.05492374857139099),
      (10, -0.00010834732869724932), (11, 0.0003825710908356584), (12, -0.00034046500868740456),
      (13, 0.1413124436746325)],
    &[(0, -0.42889630158379194), (5, -4.697621415361164), (6, 7.683421196062599), (7, 4.06898981839711),
      (8, 0.3567271874552811), (12, -0.0013990241651590145), (13, 2.9475147891527724), (14, -9.15095847217987)],
];
/// Weights of the result, order 8.
#[rustfmt::skip]
const B: &[(usize, f64)] = &[
    (0, 0.054293734116568765), (5, 4.450312892752409), (6, 1.8915178993145003), (7, -5.801203960010585),
    (8, 0.3111643669578199), (9, -0.1521609496625161), (10, 0.20136540080403034), (11, 0.04471061572777259),
];
/// Weights of the result of order 3 that the error estimate takes.
const B3: &[(usize, f64)] = &[(0, 0.2440944881889764), (8, 0.7338466882816118), (11, 0.022058823529411766)];
/// Weights of the error estimate of order 5.
#[rustfmt::skip]
const E5: &[(usize, f64)] = &[
    (0, 0.01312004499419488), (5, -1.2251564463762044), (6, -0.4957589496572502), (7, 1.6643771824549864),
    (8, -0.35032884874997366), (9, 0.3341791187130175), (10, 0.08192320648511571), (11, -0.022355307863886294),
];
/// Weights of the last four coefficients of the interpolation.
#[rustfmt::skip]
const D: [&[(usize, f64)]; 4] = [
    &[(0, -8.428938276109013), (5, 0.5667149535193777), (6, -3.0689499459498917), (7, 2.38466765651207),
      (8, 2.117034582445028), (9, -0.871391583777973), (10, 2.2404374302607883), (11, 0.6315787787694688),
      (12, -0.08899033645133331), (13, 18.148505520854727), (14, -9.194632392478356), (15, -4.436036387594894)],
    &[(0, 10.427508642579134), (5, 242.28349177525817), (6, 165.20045171727028), (7, -374.5467547226902),
      (8, -22.113666853125306), (9, 7.733432668472264), (10, -30.674084731089398), (11, -9.332130526430229),
      (12, 15.697238121770845), (13, -31.139403219565178), (14, -9.35292435884448), (15, 35.81684148639408)],
    &[(0, 19.985053242002433), (5, -387.0373087493518), (6, -189.17813819516758), (7, 527.8081592054236),
      (8, -11.57390253995963), (9, 6.8812326946963), (10, -1.0006050966910838), (11, 0.7777137798053443),
      (12, -2.778205752353508), (13, -60.19669523126412), (14, 84.32040550667716), (15, 11.99229113618279)],
    &[(0, -25.69393346270375), (5, -154.18974869023643), (6, -231.5293791760455), (7, 357.6391179106141),
      (8, 93.40532418362432), (9, -37.45832313645163), (10, 104.0996495089623), (11, 29.8402934266605),
      (12, -43.53345659001114), (13, 96.32455395918828), (14, -39.17726167561544), (15, -149.72683625798564)],
];

/// Steps from one test for stiffness to the next.
const TESTED: usize = 50;
/// h |λ| at the border of the region of stability.
const BORDER: f64 = 6.1;

/// Integrates until the end or until someone who watches stops it. One loop, longer than 80 lines: stages, error, step length and the test
/// for stiffness share their values.
pub(super) fn integrate(
    piece: &Piece,
    watch: &mut dyn Watch,
    state: &[f64],
    rate: Vec<f64>,
) -> Result<Solved, Failure> {
    let (n, tolerance) = (state.len(), piece.settings.tolerance);
    let (mut t, mut y) = (piece.start, state.to_vec());
    let mut k = vec![vec![0.0; n]; STAGES];
    k[0] = rate;
    let mut h = piece.first_step(8.0, tolerance, &y, &k[0]);
    let (mut accepted, mut was_rejected) = (0, false);
    let (mut stiff, mut not_stiff) = (0, 0);
    let (mut stage, mut new, mut rate) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    let mut sums = [0; 3].map(|_| vec![0.0; n]);
    while t < piece.end {
        piece.pace.count(t)?;
        // what is left is one step, or two that are alike
        let left = piece.end - t;
        let is_last = h >= left * (1.0 - 1e-12);
        let h_now = if is_last {
            left
        } else if h > 0.5 * left {
            0.5 * left
        } else {
            h
        };
        if piece.vanishes(h_now) && !is_last {
            if was_rejected {
                return Err(piece.no_step(t));
            }
            h = piece.least();
            was_rejected = true;
            continue;
        }
        let is_finite = (1..STAGES).all(|i| {
            along(&mut stage, &y, h_now, A[i], &k);
            let (_, later) = k.split_at_mut(i);
            piece.rate(t + C[i] * h_now, &stage, &mut later[0])
        });
        along(&mut new, &y, h_now, B, &k);
        let t_new = if is_last { piece.end } else { t + h_now };
        let error = match is_finite && new.iter().all(|x| x.is_finite()) {
            true => error(piece, tolerance, h_now, (&y, &new), &k, &mut sums),
            false => f64::INFINITY,
        };
        let error = if error.is_nan() { f64::INFINITY } else { error };
        if error > 1.0 || !piece.rate(t_new, &new, &mut rate) {
            if is_last && piece.vanishes(h_now) {
                return Err(piece.no_step(t));
            }
            h = h_now * (0.9 * error.powf(-0.125)).clamp(0.1, 0.9);
            was_rejected = true;
            continue;
        }
        accepted += 1;
        piece.check(t_new, &new)?;
        if accepted % TESTED == 0 || stiff > 0 {
            // the last stage and the result stand at one time: h |λ| from what lies between them
            let between = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
            let ratio = between(&rate, &k[STAGES - 1]) / between(&new, &stage);
            match h_now * ratio.sqrt() > BORDER {
                true => (stiff, not_stiff) = (stiff + 1, 0),
                false => not_stiff += 1,
            }
            if not_stiff == 6 {
                stiff = 0;
            }
            piece.pace.finds_stiffness(stiff >= 15);
        }
        let dense = OnceCell::new();
        let within = |at: f64| {
            let coefficients = dense.get_or_init(|| interpolation(piece, (t, h_now), (&y, &new), &k, &rate));
            interpolated(coefficients, &y, (at - t) / h_now)
        };
        let step = AcceptedStep { t_before: t, t: t_new, y_before: &y, y: &new, within: &within };
        if watch.step(&step).is_break() {
            return Ok(piece.solved(new, accepted));
        }
        let growth = (0.9 * error.powf(-0.125)).clamp(0.333, if was_rejected { 1.0 } else { 6.0 });
        // a step that the end has cut says nothing against longer ones
        h = (h_now * growth).max(if h_now < h && !was_rejected { h } else { 0.0 }).min(piece.most());
        was_rejected = false;
        t = t_new;
        std::mem::swap(&mut y, &mut new);
        std::mem::swap(&mut k[0], &mut rate);
    }
    Ok(piece.solved(y, accepted))
}

/// `out` = y + h Σ weights · k.
fn along(out: &mut [f64], y: &[f64], h: f64, weights: &[(usize, f64)], k: &[Vec<f64>]) {
    weighted_sum(out, weights, k);
    out.iter_mut().zip(y).for_each(|(out, y)| *out = y + h * *out);
}

/// `out` = Σ weights · k, in the order of the weights: all entries of a stage one after the other, so that they are summed in vectors.
fn weighted_sum(out: &mut [f64], weights: &[(usize, f64)], k: &[Vec<f64>]) {
    let [(first, weight), others @ ..] = weights else { unreachable!("every sum has a first stage") };
    out.iter_mut().zip(&k[*first]).for_each(|(out, k)| *out = weight * k);
    for (stage, weight) in others {
        out.iter_mut().zip(&k[*stage]).for_each(|(out, k)| *out += weight * k);
    }
}

/// The error of a step by what is allowed: e₅²/√(e₅² + 0.01 e₃²), both by scale (HNW, II.10); `sums` is room for three states.
fn error(
    piece: &Piece,
    tolerance: f64,
    h: f64,
    (y, new): (&[f64], &[f64]),
    k: &[Vec<f64>],
    [e5, b, b3]: &mut [Vec<f64>; 3],
) -> f64 {
    let n = y.len();
    weighted_sum(e5, E5, k);
    weighted_sum(b, B, k);
    weighted_sum(b3, B3, k);
    let (mut fifth, mut third) = (0.0, 0.0);
    for i in 0..n {
        let scale = piece.scale(tolerance, y[i].abs().max(new[i].abs()));
        let (e5, e3) = (e5[i], b[i] - b3[i]);
        fifth += (e5 / scale) * (e5 / scale);
        third += (e3 / scale) * (e3 / scale);
    }
    let below = fifth + 0.01 * third;
    match below > 0.0 {
        true => h * fifth / (below * n as f64).sqrt(),
        false => 0.0,
    }
}

/// The seven coefficients of the interpolation behind y.
fn interpolation(
    piece: &Piece,
    (t, h): (f64, f64),
    (y, new): (&[f64], &[f64]),
    k: &[Vec<f64>],
    rate: &[f64],
) -> [Vec<f64>; 7] {
    let n = y.len();
    let mut k = k.to_vec();
    k.push(rate.to_vec());
    for i in STAGES + 1..16 {
        let (mut stage, mut of_stage) = (vec![0.0; n], vec![0.0; n]);
        along(&mut stage, y, h, A[i], &k);
        if !piece.rate(t + C[i] * h, &stage, &mut of_stage) {
            // the cubic through both ends is left
            of_stage.clone_from(&k[0]);
        }
        k.push(of_stage);
    }
    let of = |f: &dyn Fn(usize) -> f64| (0..n).map(f).collect::<Vec<f64>>();
    let way = of(&|i| new[i] - y[i]);
    let bend = of(&|i| h * k[0][i] - way[i]);
    let rest = of(&|i| way[i] - h * rate[i] - bend[i]);
    let more = |d: &[(usize, f64)]| {
        let mut sum = vec![0.0; n];
        weighted_sum(&mut sum, d, &k);
        sum.iter_mut().for_each(|x| *x *= h);
        sum
    };
    let [a, b, c, d] = D.map(more);
    [way, bend, rest, a, b, c, d]
}

/// y + s (c₀ + s₁ (c₁ + s (c₂ + s₁ (c₃ + s (c₄ + s₁ (c₅ + s c₆)))))), s₁ = 1 − s.
fn interpolated(c: &[Vec<f64>; 7], y: &[f64], s: f64) -> Vec<f64> {
    let s1 = 1.0 - s;
    let at = |i: usize| {
        let inner = c[3][i] + s * (c[4][i] + s1 * (c[5][i] + s * c[6][i]));
        y[i] + s * (c[0][i] + s1 * (c[1][i] + s * (c[2][i] + s1 * inner)))
    };
    (0..y.len()).map(at).collect()
}
