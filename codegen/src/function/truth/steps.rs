//! Steps of time, by the second author: accelerations of the chapter's equations, exponentials of matrices, derivatives in dual numbers.

use super::super::steps::{RungeKuttaStep, SemiImplicitStep, StepDerivatives, StepDerivativesRk4};
use super::super::Quantity;
use super::derivatives::{slopes, Direction};
use super::forward_derivatives::MovingJoints;
use super::tangent::{displaced, displaced_maps};
use super::{Chapter, Truth};
use crate::function::by_rows;
use nalgebra::Vector3;
use straightline_core::magnitude::Magnitude;
use straightline_core::reference::{CentreOfMassTree, ReferenceJoint, ReferenceReal};
use straightline_core::{Dd, Dual, Real};

type Moved = Dual<Magnitude, 1>;

impl Truth for SemiImplicitStep {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        let system = MovingJoints::new(at);
        Some(next(at, &system, euler(at, &system.acceleration(at))))
    }
}

impl Truth for RungeKuttaStep {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        let nv = at.qd().len();
        let none = [0; 3].map(|_| vec![Magnitude::zero(); nv]);
        let [u, rates] = runge_kutta(at, &none);
        let [u, rates] = [u, rates].map(|x| x.into_iter().map(|x| x.value).collect::<Vec<_>>());
        Some(next(at, &MovingJoints::new(at), [displaced(at, at.q(), &u), rates]))
    }
}

impl Truth for StepDerivatives {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        let system = MovingJoints::new(at);
        let (qdd, length) = (system.acceleration(at), at.get(Quantity::TimeStep)[0]);
        let by = |direction: &Direction<Magnitude>| {
            let rates = acceleration_rate(at, &system, [at.q(), at.qd(), &qdd], direction);
            direction[1].iter().zip(rates).map(|(own, rate)| *own + length * rate).collect::<Vec<_>>()
        };
        let rates = euler(at, &qdd)[1].clone();
        let u: Vec<Magnitude> = rates.iter().map(|x| *x * length).collect();
        let maps = displaced_maps(at, at.q(), &u);
        let column = |direction: &Direction<Magnitude>| {
            let rates = by(direction);
            let along: Vec<Magnitude> = rates.iter().map(|x| *x * length).collect();
            [carried(&maps, &direction[0], &along), rates]
        };
        Some([next(at, &system, euler(at, &qdd)), blocks(&system, column)].concat())
    }
}

impl Truth for StepDerivativesRk4 {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        let system = MovingJoints::new(at);
        let nv = at.qd().len();
        let [u, _] = runge_kutta(at, &[0; 3].map(|_| vec![Magnitude::zero(); nv]));
        let u: Vec<Magnitude> = u.into_iter().map(|x| x.value).collect();
        let maps = displaced_maps(at, at.q(), &u);
        let column = |direction: &Direction<Magnitude>| {
            let [along, rates] =
                runge_kutta(at, direction).map(|x| x.into_iter().map(|x| x.derivatives[0]).collect::<Vec<_>>());
            [carried(&maps, &direction[0], &along), rates]
        };
        Some([RungeKuttaStep::truth(at)?, blocks(&system, column)].concat())
    }
}

/// q ⊕ h q̇⁺ and q̇⁺ = q̇ + h q̈.
fn euler(at: &Chapter<'_>, qdd: &[Magnitude]) -> [Vec<Magnitude>; 2] {
    let length = at.get(Quantity::TimeStep)[0];
    let rates: Vec<Magnitude> = at.qd().iter().zip(qdd).map(|(qd, qdd)| *qd + length * *qdd).collect();
    let u: Vec<Magnitude> = rates.iter().map(|x| *x * length).collect();
    [displaced(at, at.q(), &u), rates]
}

/// The state after a step, of the joints that move.
fn next(at: &Chapter<'_>, system: &MovingJoints<'_, '_>, [q, qd]: [Vec<Magnitude>; 2]) -> Vec<Magnitude> {
    let mut links: Vec<_> = at.tree.own().filter(|link| system.moving.contains(&link.iv)).collect();
    links.sort_by_key(|link| link.iq);
    let own = links.iter().flat_map(|link| &q[link.iq..link.iq + link.joint.nq()]).copied();
    own.chain(system.of_moving(&qd)).collect()
}

/// A and B, of what the joints that move do where the state and the forces of such joints move in a unit direction.
fn blocks(
    system: &MovingJoints<'_, '_>,
    column: impl Fn(&Direction<Magnitude>) -> [Vec<Magnitude>; 2],
) -> Vec<Magnitude> {
    let column = |block: usize, k: usize| {
        let [q, qd] = column(&super::derivatives::unit(system.all(), block, k));
        [system.of_moving(&q), system.of_moving(&qd)].concat()
    };
    let of = |block: usize| system.moving.iter().map(move |k| (block, *k));
    let columns = |parts: &mut dyn Iterator<Item = (usize, usize)>| {
        by_rows(&parts.map(|(block, k)| column(block, k)).collect::<Vec<_>>())
    };
    [columns(&mut of(0).chain(of(1))), columns(&mut of(2))].concat()
}

/// What maps of a displacement make of a direction of the configuration and of one of the displacement.
fn carried(maps: &[Vec<Magnitude>; 2], by_q: &[Magnitude], by_v: &[Magnitude]) -> Vec<Magnitude> {
    let nv = by_q.len();
    let row = |i: usize| {
        let parts = maps.iter().zip([by_q, by_v]);
        let entries = parts.flat_map(|(map, by)| map[i * nv..(i + 1) * nv].iter().zip(by).map(|(x, y)| *x * *y));
        entries.fold(Magnitude::zero(), |sum, x| sum + x)
    };
    (0..nv).map(row).collect()
}

/// How accelerations of a motion change where it and the forces move in a direction.
fn acceleration_rate(
    at: &Chapter<'_>,
    system: &MovingJoints<'_, '_>,
    motion: [&[Magnitude]; 3],
    direction: &Direction<Magnitude>,
) -> Vec<Magnitude> {
    let [q, qd, force] = direction;
    let held = vec![Magnitude::zero(); qd.len()];
    let takes = slopes(at, &at.tree, motion, &[q.clone(), qd.clone(), held]);
    let net: Vec<Magnitude> = force.iter().zip(takes).map(|(force, takes)| *force - takes).collect();
    system.solved(&net)
}

/// u⁺ and q̇⁺ of a step in coordinates of the tangent at q, as they move where the state and the forces move in a direction.
fn runge_kutta(at: &Chapter<'_>, direction: &Direction<Magnitude>) -> [Vec<Moved>; 2] {
    let length = at.get(Quantity::TimeStep)[0];
    let constant = |x: f64| Magnitude::new(Dd::from(x));
    let start: Vec<Moved> = with_rates(at.qd(), &direction[1]);
    let added = |x: &[Moved], k: &[Moved], part: Magnitude| -> Vec<Moved> {
        x.iter().zip(k).map(|(x, k)| *x + *k * Moved::fixed(part)).collect()
    };
    let none = vec![Moved::fixed(Magnitude::zero()); start.len()];
    let mut slopes: Vec<[Vec<Moved>; 2]> = Vec::new();
    for part in [Magnitude::zero(), length * constant(0.5), length * constant(0.5), length] {
        let [u, rates] = match slopes.last() {
            None => [none.clone(), start.clone()],
            Some([by_u, by_rates]) => [added(&none, by_u, part), added(&start, by_rates, part)],
        };
        slopes.push([displacement_rate(&at.tree, &u, &rates), acceleration(at, direction, &u, &rates)]);
    }
    let weights = [1.0, 2.0, 2.0, 1.0].map(|weight| length * constant(weight) / constant(6.0));
    let sum = |start: &[Moved], k: usize| {
        slopes.iter().zip(weights).fold(start.to_vec(), |sum, (slope, weight)| added(&sum, &slope[k], weight))
    };
    [sum(&none, 0), sum(&start, 1)]
}

/// q̈ at q ⊕ u, as it moves.
fn acceleration(at: &Chapter<'_>, direction: &Direction<Magnitude>, u: &[Moved], rates: &[Moved]) -> Vec<Moved> {
    let split = |x: &[Moved]| -> [Vec<Magnitude>; 2] {
        [x.iter().map(|x| x.value).collect(), x.iter().map(|x| x.derivatives[0]).collect()]
    };
    let ([u, by_u], [qd, by_qd]) = (split(u), split(rates));
    let q = displaced(at, at.q(), &u);
    let by_q = carried(&displaced_maps(at, at.q(), &u), &direction[0], &by_u);
    let system = MovingJoints::at(at, &q);
    let qdd = system.acceleration_of(&q, &qd);
    let rate = acceleration_rate(at, &system, [&q, &qd, &qdd], &[by_q, by_qd, direction[2].clone()]);
    with_rates(&qdd, &rate)
}

/// u̇ = q̇ + ½ ad_u q̇ + 1/12 ad_u ad_u q̇ of a free link and of a ball joint, q̇ of others; ad of (ρ, w) makes (w × v + ρ × ω, w × ω) of (v, ω).
fn displacement_rate<T: ReferenceReal>(tree: &CentreOfMassTree<Magnitude>, u: &[T], rates: &[T]) -> Vec<T> {
    let mut all = rates.to_vec();
    let [half, twelfth] = [Dd::HALF, Dd::ONE / Dd::from(12.0)].map(T::constant);
    for link in tree.links.iter().filter(|link| link.joint == ReferenceJoint::Ball) {
        let [w, own] = [u, rates].map(|x| Vector3::from_column_slice(&x[link.iv..link.iv + 3]));
        let once = w.cross(&own);
        let rate = own + once * half + w.cross(&once) * twelfth;
        all[link.iv..link.iv + 3].copy_from_slice(rate.as_slice());
    }
    for link in tree.links.iter().filter(|link| link.joint == ReferenceJoint::Free) {
        let parts = |x: &[T]| [0, 3].map(|k| Vector3::from_column_slice(&x[link.iv + k..link.iv + k + 3]));
        let ([rho, w], own) = (parts(u), parts(rates));
        let ad = |[v, omega]: [Vector3<T>; 2]| [w.cross(&v) + rho.cross(&omega), w.cross(&omega)];
        let once = ad(own);
        let twice = ad(once);
        for k in 0..2 {
            let rate = own[k] + once[k] * half + twice[k] * twelfth;
            all[link.iv + 3 * k..link.iv + 3 * k + 3].copy_from_slice(rate.as_slice());
        }
    }
    all
}

fn with_rates(x: &[Magnitude], rates: &[Magnitude]) -> Vec<Moved> {
    x.iter().zip(rates).map(|(x, rate)| Dual { value: *x, derivatives: [*rate] }).collect()
}
