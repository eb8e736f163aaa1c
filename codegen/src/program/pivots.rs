//! What mechanics knows of the values of forward dynamics, where intervals know nothing.
//!
//! Forward dynamics by the factorisation H = Lᵀ D L divides by pivots d_k = H_kk − Σ …, and intervals of such differences hold zero. But
//! what a joint feels is the least kinetic energy, twice, of motions with q̇_k = 1, and energies of bodies are not negative: of fewer
//! bodies, or of bodies that move more freely, it is less. So for all q
//!
//! * d_k, which a joint feels while all joints behind it are free and those before it are held, is at least Θ_k: what it feels of its own body
//!   and of one of those that this carries, whatever the angle between them. And d_k ≤ H_kk.
//! * 1/(H⁻¹)_kk, which it feels while all others are free, is at least 1/c_k: what it feels of its own body and the one before it, as if that
//!   were free in space, or on its joint where that stands in the world; of the first joint 1/Θ_k.
//!
//! Let A be what is left of H when the joints behind are eliminated, b = τ − h, Lᵀ y = b. Then, as H and A are definite and elimination only
//! takes from a diagonal,
//!
//! * |A_ij| ≤ √(A_ii A_jj) ≤ √(H_ii H_jj), and |l_ki| = |A_ki|/d_k ≤ √(A_ii/d_k) ≤ √(H_ii/Θ_k);
//! * yᵀ D⁻¹ y = bᵀ H⁻¹ b ≤ β², β = Σ |b_i| √c_i, as |(H⁻¹)_ij| ≤ √(c_i c_j); hence |y_k| ≤ √H_kk β and |q̈_k| ≤ √c_k β.
//!
//! The same for adjoints ∂q̈_k/∂v of values v, in the exact program: (H⁻¹)_kj of b_j and y_j; (L⁻¹)_kj of q̈_j where that is used again, at most
//! √(c_k H_jj) as (H⁻¹)_kk = Σ (L⁻¹)_kj²/d_j; −(H⁻¹)_ki q̈_j − (H⁻¹)_kj q̈_i of A_ij, as the inverse of what is left is a part of H⁻¹; and d_m
//! or d_j² times such products of l_mi and of 1/d_j.
//!
//! Which values of a program these are is not read off it (sums of several entries are shared, and put into other orders), but seen: in
//! double-double at random states, as `pass/substitute` finds values that are the same. All are rational in the inputs, sines and
//! cosines: two that differ anywhere agree at a random state with probability zero.

use crate::function::Quantity;
use crate::program::input_box::input_box;
use crate::scene::Scene;
use straightline_core::algorithms::mass_matrix;
use straightline_core::model::{Body, Model};
use straightline_core::random::Random;
use straightline_core::Dd;
use straightline_graph::certify::{ErrorAnalysis, FloatFormat, Interval, KnownSystem, NoCertificate};
use straightline_graph::expr::{evaluate, Graph, NodeId, Port};
use straightline_graph::rounding::backwards;
use straightline_graph::Scalar;

/// Random states.
const STATES: usize = 3;
/// Two values that agree so well are one.
const EQUAL: f64 = 1e-20;
/// What rounding in double-double and in f64 can take from a bound.
const SLACK: f64 = 1e-9;
/// Parts of the angle between two bodies.
const PARTS: usize = 256;

/// What is known of a box of inputs, by velocity coordinate.
pub struct Sizes {
    /// At least H_kk.
    pub inertia: Vec<f64>,
    /// At least |h_k|.
    pub bias: Vec<f64>,
}

impl Sizes {
    /// From programs of H and of the joint forces of a motion.
    ///
    /// # Errors
    /// If an input has no range.
    pub fn of(mass_matrix: &Graph, torques: &Graph, scene: &Scene, model: &Model<Dd>) -> Result<Sizes, NoCertificate> {
        let magnitudes = |graph: &Graph| {
            let mut ranges = input_box(&graph.inputs, scene, model)?;
            let mut first = 0;
            for port in &graph.inputs {
                if Quantity::of(port) == Some(Quantity::Acceleration) {
                    ranges[first..first + port.len()].fill(Interval::ZERO);
                }
                first += port.len();
            }
            let mut analysis = ErrorAnalysis::new(graph, FloatFormat::of(Scalar::F64));
            analysis.ranges(&ranges)?;
            Ok(graph.results.iter().map(|r| analysis.range(*r).mag()).collect::<Vec<f64>>())
        };
        let n = model.nv();
        let entries = magnitudes(mass_matrix)?;
        Ok(Sizes { inertia: (0..n).map(|k| entries[k * n + k]).collect(), bias: magnitudes(torques)? })
    }
}

/// Joints of the greatest robot that is looked at: beyond, errors add up to more than is left of H, and the search for values is long.
const MOST_JOINTS: usize = 12;

/// Whether something is known of this program: all joints turn or slide, no inertia is an input, and all accelerations of a few
/// joints are results.
pub fn is_arm(model: &Model<Dd>, graph: &Graph) -> bool {
    let turns_or_slides = model.bodies.iter().all(|b| b.joint.kind.elementary().is_some());
    let is_known = |port: &Port| {
        use Quantity::{Configuration, Force, Gravity, Velocity};
        matches!(Quantity::of(port), Some(Configuration | Velocity | Force | Gravity))
    };
    let is_whole = graph.results.len() == model.nv() && model.nv() <= MOST_JOINTS;
    turns_or_slides && is_whole && graph.inputs.iter().all(is_known)
}

/// What is known for inputs in a box. Nothing where it [is no arm](is_arm).
pub fn known(model: &Model<Dd>, graph: &Graph, ranges: &[Interval], sizes: &Sizes) -> KnownSystem {
    if !is_arm(model, graph) {
        return KnownSystem::default();
    }
    let place = |quantity: Quantity| {
        let is_it = |port: &&Port| Quantity::of(port) == Some(quantity);
        let first: usize = graph.inputs.iter().take_while(|port| !is_it(port)).map(Port::len).sum();
        let count = graph.inputs.iter().find(is_it).map_or(0, Port::len);
        first..first + count
    };
    let (q, tau) = (&ranges[place(Quantity::Configuration)], &ranges[place(Quantity::Force)]);
    let Some(felt) = Felt::new(model, q) else { return KnownSystem::default() };
    let sizes_of_b = sizes.bias.iter().enumerate().map(|(k, h)| h + tau.get(k).map_or(0.0, |t| t.mag()));
    let beta = sizes_of_b.zip(&felt.free).map(|(b, c)| b * c.sqrt()).sum::<f64>() * (1.0 + SLACK);
    let bounds = Bounds { felt, inertia: &sizes.inertia, beta };
    let count: usize = graph.inputs.iter().map(Port::len).sum();
    let mut probe = graph.clone();
    probe.results = graph.ids().collect();
    let mut random = Random(11);
    let mut values: Vec<Vec<Dd>> = Vec::new();
    let mut facts: Vec<Facts> = Vec::new();
    for _ in 0..STATES {
        let inputs: Vec<Dd> = (0..count).map(|_| Dd::from(random.symmetric(2.0))).collect();
        let of_nodes = evaluate(&probe, &inputs);
        let qdd: Vec<Dd> = graph.results.iter().map(|r| of_nodes[r.index()]).collect();
        let h = match q.is_empty() {
            true => mass_matrix(model, &vec![Dd::ZERO; model.nq()]),
            false => mass_matrix(model, &inputs[place(Quantity::Configuration)]),
        };
        facts.push(bounds.facts(model, &h, &qdd));
        values.push(of_nodes);
    }
    let mut known = KnownSystem::default();
    let of_values: Vec<&Vec<(Dd, Interval)>> = facts.iter().map(|f| &f.values).collect();
    for (id, fact, negative) in agreements(graph, &values, &of_values) {
        let range = of_values[0][fact].1;
        known.values.push((id, if negative { -range } else { range }));
    }
    for (k, result) in graph.results.iter().enumerate() {
        let adjoints: Vec<Vec<Dd>> = values.iter().map(|v| adjoints(graph, v, *result)).collect();
        let of_result: Vec<&Vec<(Dd, Interval)>> = facts.iter().map(|f| &f.adjoints[k]).collect();
        for (id, fact, _) in agreements(graph, &adjoints, &of_result) {
            known.adjoints.push((*result, id, of_result[0][fact].1.mag()));
        }
    }
    known
}

/// Which nodes have the number of a fact, or its opposite, at all states.
fn agreements(graph: &Graph, of_nodes: &[Vec<Dd>], facts: &[&Vec<(Dd, Interval)>]) -> Vec<(NodeId, usize, bool)> {
    let mut found = Vec::new();
    for id in graph.ids() {
        let v = of_nodes[0][id.index()].to_f64();
        for (k, (w, _)) in facts[0].iter().enumerate() {
            let w = w.to_f64();
            if w == 0.0 || (v.abs() - w.abs()).abs() > 1e-12 * w.abs() {
                continue;
            }
            let negative = (v < 0.0) != (w < 0.0);
            let agrees = of_nodes.iter().zip(facts).all(|(v, facts)| {
                let (v, w) = (v[id.index()], facts[k].0);
                let w = if negative { -w } else { w };
                (v - w).to_f64().abs() <= EQUAL * w.to_f64().abs()
            });
            if agrees {
                found.push((id, k, negative));
            }
        }
    }
    found
}

/// ∂ result/∂ node from the values of all nodes, without what goes through sines.
pub fn adjoints(graph: &Graph, values: &[Dd], result: NodeId) -> Vec<Dd> {
    let mut adjoints = vec![Dd::ZERO; result.index() + 1];
    adjoints[result.index()] = Dd::ONE;
    backwards(graph, values, &mut adjoints, |_, _| ());
    adjoints.resize(graph.ops.len(), Dd::ZERO);
    adjoints
}

/// What is known of all entries.
struct Bounds<'a> {
    felt: Felt,
    inertia: &'a [f64],
    beta: f64,
}

/// Numbers at a state, and their ranges at all of them.
struct Facts {
    values: Vec<(Dd, Interval)>,
    /// Of each result.
    adjoints: Vec<Vec<(Dd, Interval)>>,
}

impl Bounds<'_> {
    /// From H and q̈ at a state. One piece: elimination, inverse and adjoints share all of their values.
    fn facts(&self, model: &Model<Dd>, h: &[Dd], qdd: &[Dd]) -> Facts {
        let (n, held, free, inertia) = (model.nv(), &self.felt.held, &self.felt.free, self.inertia);
        let within = |x: f64| Interval::around_zero(x * (1.0 + SLACK));
        let root = |k: usize| free[k].sqrt();
        let mut a = h.to_vec();
        let mut y: Vec<Dd> = (0..n).map(|i| (0..n).fold(Dd::ZERO, |sum, j| sum + h[i * n + j] * qdd[j])).collect();
        // sums of accelerations about parallel axes are values of their own
        let mut values: Vec<(Dd, Interval)> = Vec::new();
        let runs = || (0..n).flat_map(|i| (i..n).map(move |j| i..=j));
        for run in runs() {
            let sum = run.clone().fold(Dd::ZERO, |sum, j| sum + qdd[j]);
            values.push((sum, within(run.map(|j| root(j) * self.beta).sum())));
        }
        let mut left: Vec<usize> = (0..n).collect();
        let mut pivots = vec![Dd::ZERO; n];
        let mut lower: Vec<Vec<(usize, Dd)>> = vec![Vec::new(); n];
        // no joint stands before the one that carries it
        for body in model.bodies.iter().rev() {
            let k = body.joint.iv;
            for (x, i) in left.iter().enumerate() {
                for j in &left[..x] {
                    values.push((a[i * n + j], within((inertia[*i] * inertia[*j]).sqrt())));
                }
                values.push((a[i * n + i], Interval::new(held[*i], inertia[*i].max(held[*i]))));
            }
            let pivot = a[k * n + k];
            pivots[k] = pivot;
            values.push((Dd::ONE / pivot, Interval::new((1.0 - SLACK) / inertia[k], (1.0 + SLACK) / held[k])));
            values.push((y[k], within(inertia[k].sqrt() * self.beta)));
            left.retain(|i| *i != k);
            for &i in &left {
                let factor = a[i * n + k] / pivot;
                lower[k].push((i, factor));
                values.push((factor, within((inertia[i] / held[k]).sqrt())));
                for &j in &left {
                    let product = factor * a[k * n + j];
                    a[i * n + j] -= product;
                }
                let product = factor * y[k];
                y[i] -= product;
            }
        }
        // rows of L⁻¹ from the base outwards, H⁻¹ = L⁻¹ D⁻¹ L⁻ᵀ
        let mut inverse = vec![vec![Dd::ZERO; n]; n];
        for body in &model.bodies {
            let k = body.joint.iv;
            let mut row = vec![Dd::ZERO; n];
            row[k] = Dd::ONE;
            for (i, l) in &lower[k] {
                (0..n).for_each(|j| row[j] -= *l * inverse[*i][j]);
            }
            inverse[k] = row;
        }
        let of_inverse =
            |k: usize, j: usize| (0..n).fold(Dd::ZERO, |sum, m| sum + inverse[k][m] * inverse[j][m] / pivots[m]);
        let most = |k: usize, j: usize| root(k) * root(j);
        let fastest = |j: usize| root(j) * self.beta;
        let adjoints = (0..n).map(|k| {
            let row: Vec<Dd> = (0..n).map(|j| of_inverse(k, j)).collect();
            let mut all = Vec::new();
            for run in runs() {
                let sum = run.clone().fold(Dd::ZERO, |sum, j| sum + row[j]);
                all.push((sum, within(run.map(|j| most(k, j)).sum())));
            }
            for j in 0..n {
                all.push((inverse[k][j], within((free[k] * inertia[j]).sqrt())));
                let (product, size) = (row[j] * qdd[j], most(k, j) * fastest(j));
                all.push((product, within(size)));
                all.push((product * pivots[j] * pivots[j], within(size * inertia[j] * inertia[j])));
                for i in 0..j {
                    let (sum, size) =
                        (row[i] * qdd[j] + row[j] * qdd[i], most(k, i) * fastest(j) + most(k, j) * fastest(i));
                    all.push((sum, within(size)));
                    all.push((sum * pivots[j], within(size * inertia[j])));
                    all.push((sum * pivots[i], within(size * inertia[i])));
                }
            }
            all
        });
        let adjoints = adjoints.collect();
        Facts { values, adjoints }
    }
}

/// What joints feel at least, and how easily they move at most.
struct Felt {
    /// Θ.
    held: Vec<f64>,
    /// c.
    free: Vec<f64>,
}

impl Felt {
    /// None if a joint may feel nothing of the bodies next to it.
    fn new(model: &Model<Dd>, q: &[Interval]) -> Option<Felt> {
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
