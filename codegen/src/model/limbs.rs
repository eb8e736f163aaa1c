//! Identical limbs of a robot: legs of a quadruped, fingers of a hand.

use straightline_core::model::{BodyId, Coulomb, Model};
use straightline_core::reduced::ReducedJoint;

/// Limbs of one kind.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Limbs {
    /// The body that carries them; `None`: the world.
    pub carrier: Option<BodyId>,
    /// The bodies of each limb, parents first; those at the same place correspond to one another.
    pub bodies: Vec<Vec<BodyId>>,
}

/// All identical limbs of a robot, those nearest to the base where some carry others; none of a robot without a reduced form, or with ball joints.
pub fn limbs<T>(model: &Model<T>) -> Vec<Limbs> {
    let mut found = Vec::new();
    let is_reduced = model
        .bodies
        .iter()
        .all(|body| ReducedJoint::of(body.joint.kind).is_some_and(|joint| joint != ReducedJoint::Ball));
    if !is_reduced || !model.is_tree() {
        return found;
    }
    let mut carriers = vec![None];
    while let Some(carrier) = carriers.pop() {
        let mut kinds: Vec<(String, Vec<Vec<BodyId>>)> = Vec::new();
        for child in children(model, carrier) {
            let (kind, bodies) = kind_of(model, child);
            match kinds.iter_mut().find(|(k, _)| *k == kind) {
                Some((_, limbs)) => limbs.push(bodies),
                None => kinds.push((kind, vec![bodies])),
            }
        }
        for (_, bodies) in kinds.into_iter().rev() {
            match bodies.as_slice() {
                [only] => carriers.push(Some(only[0])),
                _ => found.push(Limbs { carrier, bodies }),
            }
        }
    }
    found.sort_by_key(|l| l.bodies[0][0]);
    found
}

fn children<T>(model: &Model<T>, carrier: Option<BodyId>) -> Vec<BodyId> {
    (0..model.bodies.len()).filter(|i| model.bodies[*i].parent == carrier).collect()
}

/// What a limb is like from its first body on, and its bodies in an order that depends on that alone.
fn kind_of<T>(model: &Model<T>, first: BodyId) -> (String, Vec<BodyId>) {
    let body = &model.bodies[first];
    let friction = match body.effects.coulomb {
        Coulomb::Off => "",
        Coulomb::Sign(_) => " with friction",
        Coulomb::Smooth { .. } => " with smooth friction",
    };
    let joint = body.joint.kind.row().verb;
    let mut carried: Vec<(String, Vec<BodyId>)> =
        children(model, Some(first)).into_iter().map(|c| kind_of(model, c)).collect();
    carried.sort_by(|a, b| a.0.cmp(&b.0));
    let (mut kind, mut bodies) = (format!("{joint}{friction} ("), vec![first]);
    for (k, b) in carried {
        kind.push_str(&k);
        bodies.extend(b);
    }
    (kind + ")", bodies)
}
