//! Whatever is chosen among the reduced forms of a robot, its torques and its mass matrix are those of the full robot.

use straightline_codegen::diagnostic::Source;
use straightline_codegen::model::{load, ModelOptions};
use straightline_codegen::reduce::{lengths, reduce, Choice};
use straightline_core::algorithms as alg;
use straightline_core::model::Model;
use straightline_core::Dd;

/// Arms with parallel and right-angled joints, and a robot with a floating base and four legs.
const ROBOTS: [(&str, bool); 4] = [("ur5", false), ("panda", false), ("puma560", false), ("solo12", true)];

fn robot(name: &str, floating_base: bool) -> Model<Dd> {
    let path = format!("{}/../robots/descriptions/{name}.urdf", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(path).unwrap();
    let options = ModelOptions { floating_base, ..ModelOptions::default() };
    load(&Source::new(name, text), &options).0.unwrap()
}

/// Numbers between −1.5 and 1.5 from a seed.
struct Random(u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        self.0 >> 33
    }

    fn numbers(&mut self, n: usize) -> Vec<Dd> {
        (0..n).map(|_| Dd::from(self.bits() as f64 / f64::from(1u32 << 31) * 3.0 - 1.5)).collect()
    }

    fn flags(&mut self, n: usize) -> Vec<bool> {
        (0..n).map(|_| self.bits().is_multiple_of(2)).collect()
    }

    /// Components of a vector, or none.
    fn components(&mut self, n: usize) -> Vec<Option<usize>> {
        (0..n).map(|_| Some((self.bits() % 4) as usize).filter(|k| *k < 3)).collect()
    }
}

#[track_caller]
fn assert_equal(got: &[Dd], expected: &[Dd], what: &str) {
    let scale = expected.iter().map(|x| x.abs().hi()).fold(0.0, f64::max);
    for (i, (a, b)) in got.iter().zip(expected).enumerate() {
        let error = (*a - *b).abs().hi() / scale;
        // double-double has 31 digits; a hundred operations and parameters that cancel take a few
        assert!(error < 1e-27, "{what}, component {i}: {error:e} of scale");
    }
}

#[test]
fn every_choice_gives_the_torques_and_the_mass_matrix_of_the_full_robot() {
    let mut random = Random(11);
    for (name, floating) in ROBOTS {
        let model = robot(name, floating);
        let (n, nv) = (model.bodies.len(), model.nv());
        for trial in 0..30 {
            let (plain, _) = reduce(&model, &Choice::plain(&model));
            let units = lengths(&plain);
            let choice = Choice {
                stays: random.flags(n),
                by_axis_acceleration: random.flags(n),
                by_accelerations: [random.flags(n), random.flags(n)],
                regrouped: random.flags(n),
                doubled: [random.flags(n), random.flags(n)],
                vanish_at_parent: [0; 3].map(|_| random.components(n)),
                turned_tips: [0; 3].map(|_| random.flags(n)),
                shifted_tips: [0; 2].map(|_| random.flags(n)),
                origin_at_parent: random.flags(n),
                adds_angles: trial % 3 > 0,
                unit: if trial % 2 == 0 { Dd::ONE } else { units[trial % units.len()] },
            };
            let (reduced, _) = reduce(&model, &choice);
            let mut q = random.numbers(model.nq());
            if floating {
                let norm = q[3..7].iter().fold(Dd::ZERO, |sum, x| sum + *x * *x).sqrt();
                let unit: Vec<Dd> = q[3..7].iter().map(|x| *x / norm).collect();
                q[3..7].copy_from_slice(&unit);
            }
            let (qd, qdd) = (random.numbers(nv), random.numbers(nv));
            let what = format!("{name}, {choice:?}");
            // rotors are no part of the reduced robot
            let rotors = alg::rotor_inertias(&model);
            let passive = alg::passive_force(&model, &q, &qd);
            let full = alg::inverse_dynamics(&model, &q, &qd, &qdd);
            let rigid: Vec<Dd> = (0..nv).map(|i| full[i] - rotors[i] * qdd[i] - passive[i]).collect();
            assert_equal(&alg::reduced_inverse_dynamics(&reduced, &q, &qd, &qdd), &rigid, &what);
            assert_equal(&alg::reduced_gravity_force(&reduced, &q), &alg::gravity_force(&model, &q), &what);
            let h = alg::reduced_mass_matrix(&reduced, &q).into_iter().enumerate();
            let h: Vec<Dd> = h.map(|(k, x)| if k % (nv + 1) == 0 { x + rotors[k / nv] } else { x }).collect();
            assert_equal(&h, &alg::mass_matrix(&model, &q), &what);
        }
    }
}

#[test]
fn the_length_that_is_the_unit_is_exactly_one() {
    let model = robot("ur5", false);
    let (plain, _) = reduce(&model, &Choice::plain(&model));
    let unit = lengths(&plain)[0];
    let (reduced, _) = reduce(&model, &Choice { unit, ..Choice::plain(&model) });
    assert!(reduced.bodies.iter().any(|b| b.translation.to_array().iter().any(|x| x.abs() == Dd::ONE)));
}

#[test]
fn only_what_turns_and_carries_parallel_joints_may_stay() {
    let model = robot("ur5", false);
    let (plain, _) = reduce(&model, &Choice::plain(&model));
    let may: Vec<bool> = (0..6).map(|i| plain.may_stay(i)).collect();
    // shoulder lift and elbow carry parallel joints, the last wrist carries nothing
    assert_eq!(may, [false, true, true, false, false, true]);
}
