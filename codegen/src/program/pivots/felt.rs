//! What joints feel at least, and how easily they move at most: from pairs of bodies, for all angles between them.

use super::SLACK;
use straightline_core::model::{Body, Model};
use straightline_core::Dd;
use straightline_graph::certify::Interval;

/// Parts of the angle between two bodies.
const PARTS: usize = 256;

/// What joints feel at least, and how easily they move at most.
pub(super) struct Felt {
    /// Θ.
    pub(super) held: Vec<f64>,
    /// c.
    pub(super) free: Vec<f64>,
}

impl Felt {
    /// None if a joint may feel nothing of the bodies next to it.
    pub(super) fn new(model: &Model<Dd>, q: &[Interval]) -> Option<Felt> {
        let bodies = &model.bodies;
        let mut felt = Felt { held: vec![0.0; model.nv()], free: vec![0.0; model.nv()] };
        for (id, body) in bodies.iter().enumerate() {
            let alone = inertia_of(body)[axis(body)][axis(body)].lo;
            let carried = bodies.iter().filter(|b| b.parent == Some(id));
            let held = carried.map(|child| least(body, child, q, WantedJoints::First)).fold(alone, f64::max);
            let rotor = body.effects.rotor_inertia.map_or(0.0, Dd::to_f64);
            felt.held[body.joint.iv] = (held + rotor) * (1.0 - SLACK);
            let free = match body.parent {
                None => held,
                Some(p) if bodies[p].parent.is_none() => least(&bodies[p], body, q, WantedJoints::SecondOnJoint),
                Some(p) => least(&bodies[p], body, q, WantedJoints::SecondFree),
            };
            let is_positive = felt.held[body.joint.iv] > 0.0 && free + rotor > 0.0;
            is_positive.then_some(())?;
            felt.free[body.joint.iv] = (1.0 + SLACK) / (free + rotor);
        }
        Some(felt)
    }
}

/// Which of two joints, and how the first body moves.
#[derive(Clone, Copy, PartialEq)]
enum WantedJoints {
    /// The first, with the other free.
    First,
    /// The second, with the first free.
    SecondOnJoint,
    /// The second, with the first body free in space.
    SecondFree,
}

type Column = [Interval; 6];
type BodyInertia = [[Interval; 6]; 6];

fn interval(x: Dd) -> Interval {
    Interval::new(x.hi().next_down(), x.hi().next_up())
}

/// The component of a twist (ω, v) that a joint moves.
fn axis(body: &Body<Dd>) -> usize {
    if body.joint.kind.slides() {
        5
    } else {
        2
    }
}

/// The 6 × 6 inertia of a body about the origin of its frame, of twists (ω, v).
fn inertia_of(body: &Body<Dd>) -> BodyInertia {
    let total = body.total_about_origin();
    let (m, s) = (total.first_moment, total.second_moment);
    let trace = s.xx + s.yy + s.zz;
    let j = [[trace - s.xx, -s.xy, -s.xz], [-s.xy, trace - s.yy, -s.yz], [-s.xz, -s.yz, trace - s.zz]];
    // ω · (m c × v)
    let c = [[Dd::ZERO, -m.z, m.y], [m.z, Dd::ZERO, -m.x], [-m.y, m.x, Dd::ZERO]];
    let mut inertia = [[Interval::ZERO; 6]; 6];
    for a in 0..3 {
        for b in 0..3 {
            inertia[a][b] = interval(j[a][b]);
            inertia[a][3 + b] = interval(c[a][b]);
            inertia[3 + b][a] = interval(c[a][b]);
        }
        inertia[3 + a][3 + a] = interval(total.mass);
    }
    inertia
}

/// What a joint feels at least of two bodies, the second carried by the first, for all positions of the second joint.
fn least(first: &Body<Dd>, second: &Body<Dd>, q: &[Interval], wanted: WantedJoints) -> f64 {
    let range = q.get(second.joint.iq).copied().unwrap_or(Interval::ZERO);
    let turn = std::f64::consts::TAU * (1.0 + SLACK);
    let turns = second.joint.kind.turns() && range.width() > turn;
    let range = if turns { Interval::new(0.0, turn) } else { range };
    let inertias = [inertia_of(first), inertia_of(second)];
    let step = (range.hi - range.lo) / PARTS as f64;
    let part = |k: usize| {
        let lo = range.lo + step * k as f64;
        Interval::new(lo, if k + 1 == PARTS { range.hi } else { range.lo + step * (k + 1) as f64 })
    };
    (0..PARTS).map(|k| least_at(first, second, &inertias, part(k), wanted, 8)).fold(f64::INFINITY, f64::min)
}

/// The same for positions in a range, which is cut so often if nothing is known of the whole.
fn least_at(
    first: &Body<Dd>,
    second: &Body<Dd>,
    inertias: &[BodyInertia; 2],
    q: Interval,
    wanted: WantedJoints,
    cuts: usize,
) -> f64 {
    let unit = |k: usize| std::array::from_fn(|i| if i == k { Interval::ONE } else { Interval::ZERO });
    let moves: Vec<Column> = match wanted {
        // shifts first: what is left then is about centres of mass
        WantedJoints::SecondFree => [3, 4, 5, 0, 1, 2].map(unit).to_vec(),
        _ => vec![unit(axis(first))],
    };
    let pose = BodyPose::of(second, q);
    // motions of the first body, and of the second on it, as twists of both; the wanted one last
    let mut twists: Vec<[Column; 2]> = moves.iter().map(|v| [*v, pose.carried(v)]).collect();
    twists.push([[Interval::ZERO; 6], unit(axis(second))]);
    if wanted == WantedJoints::First {
        twists.reverse();
    }
    let n = twists.len();
    let mut h = vec![vec![Interval::ZERO; n]; n];
    for (i, a) in twists.iter().enumerate() {
        for (j, b) in twists.iter().enumerate() {
            for body in 0..2 {
                for (r, row) in inertias[body].iter().enumerate() {
                    for (c, m) in row.iter().enumerate() {
                        h[i][j] = h[i][j] + a[body][r] * (*m * b[body][c]);
                    }
                }
            }
        }
    }
    for k in 0..n - 1 {
        let pivot = h[k][k];
        if pivot.lo <= 0.0 {
            return cut(first, second, inertias, q, wanted, cuts);
        }
        for i in k + 1..n {
            for j in k + 1..=i {
                let taken = match i == j {
                    true => h[i][k].square().over(pivot),
                    false => (h[i][k] * h[j][k]).over(pivot),
                };
                h[i][j] = h[i][j] - taken;
                h[j][i] = h[i][j];
            }
        }
    }
    match h[n - 1][n - 1] {
        // not to lose much
        last if last.lo > 0.6 * last.hi || cuts == 0 => last.lo.max(0.0),
        _ => cut(first, second, inertias, q, wanted, cuts),
    }
}

fn cut(
    first: &Body<Dd>,
    second: &Body<Dd>,
    inertias: &[BodyInertia; 2],
    q: Interval,
    wanted: WantedJoints,
    cuts: usize,
) -> f64 {
    if cuts == 0 {
        return 0.0;
    }
    let middle = 0.5 * (q.lo + q.hi);
    let of = |part| least_at(first, second, inertias, part, wanted, cuts - 1);
    of(Interval::new(q.lo, middle)).min(of(Interval::new(middle, q.hi)))
}

/// Pose of a body's frame in that of the one before it.
struct BodyPose {
    rotation: [[Interval; 3]; 3],
    translation: [Interval; 3],
}

impl BodyPose {
    fn of(body: &Body<Dd>, q: Interval) -> BodyPose {
        let r = body.placement.rotation.rows.map(|row| row.map(interval));
        let p = body.placement.translation.to_array().map(interval);
        if body.joint.kind.slides() {
            return BodyPose { rotation: r, translation: [0, 1, 2].map(|i| p[i] + r[i][2] * q) };
        }
        let (s, c) = q.sin_cos();
        // R R_z(q)
        BodyPose { rotation: r.map(|[x, y, z]| [x * c + y * s, y * c - x * s, z]), translation: p }
    }

    /// The twist of a frame that is fixed to a body of that twist.
    fn carried(&self, twist: &Column) -> Column {
        let [wx, wy, wz, vx, vy, vz] = *twist;
        let [x, y, z] = self.translation;
        let v = [vx + (wy * z - wz * y), vy + (wz * x - wx * z), vz + (wx * y - wy * x)];
        let turned = |u: [Interval; 3], i: usize| {
            self.rotation[0][i] * u[0] + self.rotation[1][i] * u[1] + self.rotation[2][i] * u[2]
        };
        std::array::from_fn(|i| if i < 3 { turned([wx, wy, wz], i) } else { turned(v, i - 3) })
    }
}
