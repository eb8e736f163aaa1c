//! Displacements along the tangent, by the second author: exponentials of matrices, a logarithm by iteration, and dual numbers through both.
//!
//! The second author's powers of matrices say nothing of natural scales. Results have those of the vectors and turns that they belong to: a
//! quaternion and a turn one, a displaced position the lengths of both parts, a derivative by a turn how far the turn carries what is displaced.

use super::super::tangent::{Difference, DifferenceDerivatives, Integrate, IntegrateDerivatives, IntegrateTransport};
use super::super::Quantity;
use super::derivatives::configuration_rates;
use super::{Chapter, Truth};
use crate::function::by_rows;
use straightline_core::magnitude::Magnitude;
use straightline_core::reference::{self, CentreOfMassTree, ReferenceJoint};
use straightline_core::{Dd, Dual};

type Varying = Dual<Dd, 1>;

impl Truth for Integrate {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        Some(displaced(at, at.q(), at.get(Quantity::Displacement)))
    }
}

impl Truth for Difference {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        Some(displacement(at))
    }
}

impl Truth for IntegrateDerivatives {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        let maps = displaced_maps(at, at.q(), at.get(Quantity::Displacement));
        Some(maps.concat())
    }
}

impl Truth for DifferenceDerivatives {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        let v = displacement(at);
        let tree = values_of(at);
        let [q, q1] = [at.q(), at.get(Quantity::SecondConfiguration)].map(values);
        let dual = tree.map(Varying::fixed);
        let back = |q: &[Varying], q1: &[Varying]| rates(&reference::displacement(&dual, q, q1));
        let by = |k: usize| {
            let column = |unit: &[Dd]| match k {
                0 => back(&moving(&tree, &q, unit), &held(&q1)),
                _ => back(&held(&q), &moving(&tree, &q1, unit)),
            };
            sized_map(at, &v, &columns(v.len(), column))
        };
        Some([by(0), by(1)].concat())
    }
}

impl Truth for IntegrateTransport {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        let maps = displaced_maps(at, at.q(), at.get(Quantity::Displacement));
        let direction = at.get(Quantity::ConfigurationDirection);
        let product = |row: &[Magnitude]| {
            let parts = row.iter().zip(direction).map(|(x, y)| *x * *y);
            parts.reduce(|a, b| a + b).expect("robots have joints")
        };
        Some(maps.iter().flat_map(|map| map.chunks(direction.len()).map(product)).collect())
    }
}

/// q ⊕ v.
pub(super) fn displaced(at: &Chapter<'_>, q: &[Magnitude], v: &[Magnitude]) -> Vec<Magnitude> {
    let to = reference::displaced(&values_of(at), &values(q), &values(v));
    let mut sized: Vec<Magnitude> = to.into_iter().map(Magnitude::new).collect();
    for link in &at.tree.links {
        if link.joint == ReferenceJoint::Ball {
            let turn = 1f64.hypot(length(&v[link.iv..link.iv + 3]));
            sized[link.iq..link.iq + 4].iter_mut().for_each(|x| *x = x.of_size(turn));
            continue;
        }
        if link.joint != ReferenceJoint::Free {
            sized[link.iq] = q[link.iq] + v[link.iv];
            continue;
        }
        let way = length(&q[link.iq..link.iq + 3]).hypot(length(&v[link.iv..link.iv + 3]));
        let turn = 1f64.hypot(length(&v[link.iv + 3..link.iv + 6]));
        let own = &mut sized[link.iq..link.iq + 7];
        own.iter_mut().enumerate().for_each(|(k, x)| *x = x.of_size(if k < 3 { way * turn } else { turn }));
    }
    sized
}

/// v of q ⊕ v = q₁ of the state.
fn displacement(at: &Chapter<'_>) -> Vec<Magnitude> {
    let [q, q1] = [at.q(), at.get(Quantity::SecondConfiguration)];
    let v = reference::displacement(&values_of(at), &values(q), &values(q1));
    let mut sized: Vec<Magnitude> = v.into_iter().map(Magnitude::new).collect();
    for link in &at.tree.links {
        if link.joint == ReferenceJoint::Ball {
            sized[link.iv..link.iv + 3].iter_mut().for_each(|x| *x = x.of_size(std::f64::consts::PI));
            continue;
        }
        if link.joint != ReferenceJoint::Free {
            sized[link.iv] = q1[link.iq] - q[link.iq];
            continue;
        }
        let way = [q, q1].map(|q| length(&q[link.iq..link.iq + 3])).into_iter().fold(0.0, f64::hypot);
        let turn = std::f64::consts::PI;
        let own = &mut sized[link.iv..link.iv + 6];
        own.iter_mut().enumerate().for_each(|(k, x)| *x = x.of_size(if k < 3 { way * turn } else { turn }));
    }
    sized
}

/// How q ⊕ v moves, in its own tangent, with q and with v: matrices by rows.
pub(super) fn displaced_maps(at: &Chapter<'_>, q: &[Magnitude], v: &[Magnitude]) -> [Vec<Magnitude>; 2] {
    let tree = values_of(at);
    let dual = tree.map(Varying::fixed);
    let [here, along] = [q, v].map(values);
    [0, 1].map(|k| {
        let column = |unit: &[Dd]| {
            let to = match k {
                0 => reference::displaced(&dual, &moving(&tree, &here, unit), &held(&along)),
                _ => reference::displaced(&dual, &held(&here), &with_rates(&along, unit)),
            };
            let value: Vec<Dd> = to.iter().map(|x| x.value).collect();
            reference::increment(&tree, &value, &rates(&to))
        };
        sized_map(at, v, &columns(v.len(), column))
    })
}

/// A map of the tangent along a displacement, with the scale of its parts: of a free link one where turns are carried to turns and lengths to lengths, the
/// length of the way where turns are carried to lengths, more where the way turns more; of a ball joint as of turns.
fn sized_map(at: &Chapter<'_>, v: &[Magnitude], map: &[Dd]) -> Vec<Magnitude> {
    let nv = v.len();
    let mut sized: Vec<Magnitude> = map.iter().map(|x| Magnitude::new(*x)).collect();
    for link in at.tree.links.iter().filter(|link| link.joint == ReferenceJoint::Ball) {
        let turn = 1f64.hypot(length(&v[link.iv..link.iv + 3]));
        for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
            let entry = &mut sized[(link.iv + i) * nv + link.iv + j];
            *entry = entry.of_size(turn);
        }
    }
    for link in at.tree.links.iter().filter(|link| link.joint == ReferenceJoint::Free) {
        let [linear, angular] = [0, 3].map(|k| length(&v[link.iv + k..link.iv + k + 3]));
        let turn = 1f64.hypot(angular);
        for (i, j) in (0..6).flat_map(|i| (0..6).map(move |j| (i, j))) {
            let size = match (i < 3, j < 3) {
                (true, false) => linear * turn,
                (false, true) => 0.0,
                _ => turn,
            };
            let entry = &mut sized[(link.iv + i) * nv + link.iv + j];
            *entry = entry.of_size(size);
        }
    }
    sized
}

fn values_of(at: &Chapter<'_>) -> CentreOfMassTree<Dd> {
    at.tree.map(|x| x.value)
}

fn values(x: &[Magnitude]) -> Vec<Dd> {
    x.iter().map(|x| x.value).collect()
}

fn rates(x: &[Varying]) -> Vec<Dd> {
    x.iter().map(|x| x.derivatives[0]).collect()
}

fn with_rates(x: &[Dd], rates: &[Dd]) -> Vec<Varying> {
    x.iter().zip(rates).map(|(x, rate)| Dual { value: *x, derivatives: [*rate] }).collect()
}

fn held(x: &[Dd]) -> Vec<Varying> {
    x.iter().map(|x| Dual::fixed(*x)).collect()
}

/// A configuration as it moves along a direction of its tangent.
fn moving(tree: &CentreOfMassTree<Dd>, q: &[Dd], direction: &[Dd]) -> Vec<Varying> {
    with_rates(q, &configuration_rates(tree, q, direction))
}

/// A matrix by rows, from what it makes of unit vectors.
fn columns(nv: usize, column: impl Fn(&[Dd]) -> Vec<Dd>) -> Vec<Dd> {
    let unit = |k: usize| (0..nv).map(|i| if i == k { Dd::ONE } else { Dd::ZERO }).collect::<Vec<_>>();
    let columns: Vec<Vec<Magnitude>> =
        (0..nv).map(|k| column(&unit(k)).into_iter().map(Magnitude::new).collect()).collect();
    by_rows(&columns).into_iter().map(|x| x.value).collect()
}

fn length(x: &[Magnitude]) -> f64 {
    x.iter().map(|x| x.size).fold(0.0, f64::hypot)
}
