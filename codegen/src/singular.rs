//! Joints that nothing resists: where every form of forward dynamics would divide by zero.
//!
//! A joint has a motion of its own if, with the joints beyond it free, it still feels some inertia: the pivot of its row when
//! the mass matrix is eliminated from the tips to the base (Featherstone 2008, section 6.5), which is also the divisor of the
//! articulated-body algorithm. Whether it vanishes at all configurations, and not at some, is asked at three of them that
//! have nothing in common with right angles. Links without mass, point masses on the joint axis, wrists about a point
//! mass and coaxial joints without an inertia between them are found alike.

use straightline_core::algorithms::mass_matrix;
use straightline_core::model::{BodyId, JointKind, Model};
use straightline_core::Dd;

/// A pivot is zero if so much smaller than the inertia it is what is left of. Double-double has 1e-32; a mass ratio of
/// 1e-12 between neighbours leaves about 1e-12.
const VANISHED: f64 = 1e-22;

/// The golden ratio's fraction: multiples of it, wrapped, are never near each other.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// The bodies whose joints nothing resists at any configuration; of joints that share one lack, the one nearest to the tips.
pub fn singular_joints(model: &Model<Dd>) -> Vec<BodyId> {
    let mut always = vanished_pivots(model, &generic_configuration(model, 1));
    for seed in 2..=3 {
        let here = match always.is_empty() {
            true => return Vec::new(),
            false => vanished_pivots(model, &generic_configuration(model, seed)),
        };
        always.retain(|body| here.contains(body));
    }
    always
}

/// Angles and lengths within ±2; a floating base in the world's place, which its inertia does not depend on.
fn generic_configuration(model: &Model<Dd>, seed: usize) -> Vec<Dd> {
    let mut q: Vec<Dd> =
        (0..model.nq()).map(|i| Dd::from(4.0 * ((i * 3 + seed) as f64 * GOLDEN).fract() - 2.0)).collect();
    for joint in model.bodies.iter().map(|b| &b.joint).filter(|j| j.kind == JointKind::Floating) {
        q[joint.iq..joint.iq + 6].fill(Dd::ZERO);
        q[joint.iq + 6] = Dd::ONE;
    }
    q
}

/// The bodies with a vanished pivot at q: H eliminated from the tips to the base; a row without a pivot is left out, as
/// if its joint were held.
fn vanished_pivots(model: &Model<Dd>, q: &[Dd]) -> Vec<BodyId> {
    let nv = model.nv();
    let mut h = mass_matrix(model, q);
    let diagonal: Vec<f64> = (0..nv).map(|i| h[i * nv + i].to_f64()).collect();
    // the coordinates of a body and of all that carry it, those of the body itself last
    let chain = |body: BodyId| {
        let bodies = std::iter::successors(Some(body), |&b| model.bodies[b].parent);
        let mut coordinates: Vec<usize> = bodies
            .flat_map(|b| {
                let joint = &model.bodies[b].joint;
                (joint.iv..joint.iv + joint.kind.nv()).rev()
            })
            .collect();
        coordinates.reverse();
        coordinates
    };
    let mut found = Vec::new();
    for body in (0..model.bodies.len()).rev() {
        let mut rows = chain(body);
        for _ in 0..model.bodies[body].joint.kind.nv() {
            let k = rows.pop().expect("a body's chain has its own coordinates");
            let pivot = h[k * nv + k];
            if pivot.to_f64().abs() <= VANISHED * diagonal[k].abs() {
                if !found.contains(&body) {
                    found.push(body);
                }
                continue;
            }
            for &i in &rows {
                let factor = h[k * nv + i] / pivot;
                for &j in &rows {
                    h[i * nv + j] = h[i * nv + j] - factor * h[k * nv + j];
                }
            }
        }
    }
    found.sort_unstable();
    found
}
