//! How torques of reduced robots change, forwards and backwards, against differences of the torques themselves.
//!
//! The robots are no robots: every number and every switch of a [`ReducedModel`] is random, as what a tangent has to follow is the program, whatever it
//! is of. Turns of it go by the rate of their angle (`Real::turned_about`).

use straightline_core::algorithms::reduced_inverse_dynamics;
use straightline_core::random::Random;
use straightline_core::reduced::{Meeting, ReducedBody, ReducedJoint, ReducedModel};
use straightline_core::reverse::{Recorded, Recording};
use straightline_core::spatial::{Mat3, Sym3, Vec3};
use straightline_core::{Dd, Dual};

const BODIES: usize = 6;

fn number(random: &mut Random) -> Dd {
    Dd::from(random.symmetric(1.0))
}

fn vector(random: &mut Random) -> Vec3<Dd> {
    Vec3::new(number(random), number(random), number(random))
}

fn numbers(random: &mut Random, count: usize) -> Vec<Dd> {
    (0..count).map(|_| number(random)).collect()
}

fn by_chance(random: &mut Random) -> bool {
    random.below(2) == 1
}

fn rotation(random: &mut Random) -> Mat3<Dd> {
    let [(s, c), (t, d)] = [0, 1].map(|_| number(random).sin_cos());
    let (o, one) = (Dd::ZERO, Dd::ONE);
    let about_x = Mat3 { rows: [[one, o, o], [o, d, -t], [o, t, d]] };
    Mat3::about_z(s, c) * about_x
}

fn random_reduced(random: &mut Random) -> ReducedModel<Dd> {
    let mut bodies: Vec<ReducedBody<Dd>> = Vec::new();
    let floats = by_chance(random);
    for i in 0..BODIES {
        let kind = match random.below(4) {
            _ if i == 0 && floats => ReducedJoint::Free,
            0 => ReducedJoint::Slide,
            _ => ReducedJoint::Turn,
        };
        let parent = i.checked_sub(1).map(|p| p.saturating_sub(random.below(2)));
        let (iq, iv) = bodies.last().map_or((0, 0), |b| (b.iq + b.kind.nq(), b.iv + b.kind.nv()));
        let turns = kind == ReducedJoint::Turn;
        let goes_on = turns && parent.is_some_and(|p| bodies[p].kind == ReducedJoint::Turn);
        let stays = turns && by_chance(random);
        let (diagonal, rest) = (vector(random), vector(random));
        bodies.push(ReducedBody {
            parent,
            kind,
            iq,
            iv,
            rotation: if kind == ReducedJoint::Free { Mat3::identity() } else { rotation(random) },
            offset: number(random).sin_cos(),
            phase: (turns && by_chance(random)).then(|| number(random)),
            translation: vector(random),
            mass: number(random),
            first_moment: vector(random),
            second_moment: Sym3 { xx: diagonal.x, yy: diagonal.y, zz: diagonal.z, xy: rest.x, xz: rest.y, yz: rest.z },
            shares_axis_field: false,
            permutes: false,
            parallel: goes_on && by_chance(random),
            stays,
            turns_sums: stays && by_chance(random),
            by_axis_acceleration: by_chance(random),
            by_accelerations: [by_chance(random), by_chance(random)],
            doubled: [by_chance(random), by_chance(random)],
        });
    }
    let (gravity, adds_angles) = (vector(random), by_chance(random));
    ReducedModel { bodies, gravity, per_unit: Dd::from(1.7), adds_angles, meeting: Meeting::default() }
}

/// Differences over 2h of a function without far coefficients are off by some h².
#[test]
fn torques_change_along_and_against_the_stream_as_their_differences_say() {
    let step = Dd::from(1e-9);
    for seed in 1..60 {
        let random = &mut Random(seed);
        let model = random_reduced(random);
        let nq = model.bodies.iter().map(|body| body.kind.nq()).sum();
        let mut three = || [nq, model.nv(), model.nv()].map(|count| numbers(random, count));
        let (at, along) = (three(), three());
        let torques = |by: Dd| {
            let moved = |k: usize| at[k].iter().zip(&along[k]).map(|(x, d)| *x + by * *d).collect::<Vec<Dd>>();
            reduced_inverse_dynamics(&model, &moved(0), &moved(1), &moved(2))
        };
        let dual = |k: usize| {
            let pairs = at[k].iter().zip(&along[k]);
            pairs.map(|(value, rate)| Dual { value: *value, derivatives: [*rate] }).collect::<Vec<_>>()
        };
        let forwards = reduced_inverse_dynamics(&model.map(Dual::<Dd, 1>::fixed), &dual(0), &dual(1), &dual(2));
        let rates: Vec<Dd> = forwards.into_iter().map(|torque| torque.derivatives[0]).collect();
        let scale = rates.iter().map(|rate| rate.abs().to_f64()).fold(0.0, f64::max);
        for ((rate, after), before) in rates.iter().zip(torques(step)).zip(torques(-step)) {
            let error = ((after - before) / (step + step) - *rate).abs().to_f64() / scale;
            assert!(
                error < 1e-15,
                "seed {seed}: {rate:?} is off by {error:e} of the greatest\n{model:?}\n{at:?}\n{along:?}"
            );
        }

        let recording = Recording::new();
        let inputs = at.each_ref().map(|x| x.iter().map(|x| recording.variable(*x)).collect::<Vec<_>>());
        let recorded = reduced_inverse_dynamics(&model.map(Recorded::fixed), &inputs[0], &inputs[1], &inputs[2]);
        let multipliers: Vec<Dd> = (0..model.nv()).map(|k| Dd::from(0.5 + k as f64)).collect();
        let weighed: Vec<_> = recorded.into_iter().zip(multipliers.iter().copied()).collect();
        let slopes = recording.gradient(&weighed);
        let sum = |terms: &mut dyn Iterator<Item = Dd>| terms.fold(Dd::ZERO, |sum, term| sum + term);
        let against = sum(&mut inputs.iter().flatten().zip(along.iter().flatten()).map(|(x, d)| slopes.by(*x) * *d));
        let with = sum(&mut rates.iter().zip(&multipliers).map(|(rate, multiplier)| *rate * *multiplier));
        let error = (against - with).abs().to_f64() / scale;
        assert!(error < 1e-27, "seed {seed}: {against:?} is not {with:?}\n{model:?}\n{at:?}\n{along:?}");
    }
}
