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
//! Derivatives of accelerations solve the same equations for other right sides: H ∂q̈/∂q_c = −K_c with K = ∂τ/∂q, H ∂q̈/∂q̇_c = −D_c, and H⁻¹ for
//! unit vectors. So all of this holds of each column x with its own b and β, entries of K and D at most so large as their program says of the
//! box, with |q̈_k| ≤ √c_k β where these are found on the way. Then x depends on q̈ besides: with g_m = ∂x_k/∂q̈_m = −Σ_i (H⁻¹)_ki ∂K_ic/∂q̈_m,
//! adjoints of b, y and A of the equations for q̈ are those above with w = H⁻¹ g in place of a row of H⁻¹, |w_j| ≤ √c_j Σ √c_m |g_m|, and that of
//! q̈_j is (L⁻ᵀ g)_j, at most √H_jj Σ √c_m |g_m|.
//!
//! Which values of a program these are is not read off it (sums of several entries are shared, and put into other orders), but seen: in
//! double-double at random states, as `pass/substitute` finds values that are the same. All are rational in the inputs, sines and
//! cosines: two that differ anywhere agree at a random state with probability zero.

mod columns;
mod felt;

use crate::function::{Function, Quantity};
use crate::program::input_box::input_box;
use crate::scene::Scene;
use columns::{columns_of, ColumnAt, ColumnBounds, SolvedFor};
use felt::Felt;
use straightline_core::algorithms::mass_matrix;
use straightline_core::model::Model;
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

/// What is known of a box of inputs, by velocity coordinate.
pub struct Sizes<'a> {
    /// At least H_kk.
    pub inertia: Vec<f64>,
    /// At least |h_k|.
    pub bias: Vec<f64>,
    /// A program of the derivatives of joint forces, whose accelerations are to be bounded first.
    pub slopes: Option<(&'a Graph, &'a Scene)>,
}

impl<'a> Sizes<'a> {
    /// From programs of H and of the joint forces of a motion, and of the derivatives of these where they matter.
    ///
    /// # Errors
    /// If an input has no range.
    pub fn of(
        mass_matrix: &Graph,
        torques: &Graph,
        slopes: Option<&'a Graph>,
        scene: &'a Scene,
        model: &Model<Dd>,
    ) -> Result<Sizes<'a>, NoCertificate> {
        let rest = vec![Interval::ZERO; model.nv()];
        let magnitudes = |graph: &Graph| {
            let mut analysis = ErrorAnalysis::new(graph, FloatFormat::of(Scalar::F64));
            analysis.ranges(&with_accelerations(graph, scene, model, Some(&rest))?)?;
            Ok(graph.results.iter().map(|r| analysis.range(*r).mag()).collect::<Vec<f64>>())
        };
        let n = model.nv();
        let entries = magnitudes(mass_matrix)?;
        let inertia = (0..n).map(|k| entries[k * n + k]).collect();
        Ok(Sizes { inertia, bias: magnitudes(torques)?, slopes: slopes.map(|graph| (graph, scene)) })
    }
}

/// The box of a program's inputs, with these ranges of accelerations where they are given.
fn with_accelerations(
    graph: &Graph,
    scene: &Scene,
    model: &Model<Dd>,
    accelerations: Option<&[Interval]>,
) -> Result<Vec<Interval>, NoCertificate> {
    let mut ranges = input_box(&graph.inputs, scene, model)?;
    let mut first = 0;
    for port in &graph.inputs {
        if let (Some(Quantity::Acceleration), Some(given)) = (Quantity::of(port), accelerations) {
            ranges[first..first + port.len()].copy_from_slice(given);
        }
        first += port.len();
    }
    Ok(ranges)
}

/// Joints of the greatest robot that is looked at: beyond, errors add up to more than is left of H, and the search for values is long.
const MOST_JOINTS: usize = 12;

/// Whether something is known of this program: all joints turn or slide, no inertia is an input, and results are accelerations of a few
/// joints, or their derivatives.
pub fn is_arm(model: &Model<Dd>, function: Function, graph: &Graph) -> bool {
    let is_elementary = model.bodies.iter().all(|b| b.joint.kind.elementary().is_some());
    let turns_or_slides = is_elementary && model.is_tree();
    let is_known = |port: &Port| {
        use Quantity::{Acceleration, Configuration, Force, Gravity, Velocity};
        matches!(Quantity::of(port), Some(Configuration | Velocity | Acceleration | Force | Gravity))
    };
    let is_whole = model.nv() <= MOST_JOINTS && columns_of(function, graph, model.nv()).is_some();
    turns_or_slides && is_whole && graph.inputs.iter().all(is_known)
}

/// Where a quantity stands among the inputs of a program.
fn place(graph: &Graph, quantity: Quantity) -> std::ops::Range<usize> {
    let is_it = |port: &&Port| Quantity::of(port) == Some(quantity);
    let first: usize = graph.inputs.iter().take_while(|port| !is_it(port)).map(Port::len).sum();
    let count = graph.inputs.iter().find(is_it).map_or(0, Port::len);
    first..first + count
}

/// What is known for inputs in a box. Nothing where it [is no arm](is_arm).
pub fn known(
    model: &Model<Dd>,
    function: Function,
    graph: &Graph,
    ranges: &[Interval],
    sizes: &Sizes<'_>,
) -> KnownSystem {
    if !is_arm(model, function, graph) {
        return KnownSystem::default();
    }
    all_known(model, function, graph, ranges, sizes).unwrap_or_default()
}

fn all_known(
    model: &Model<Dd>,
    function: Function,
    graph: &Graph,
    ranges: &[Interval],
    sizes: &Sizes<'_>,
) -> Option<KnownSystem> {
    let results = columns_of(function, graph, model.nv())?;
    let (q, tau) = (&ranges[place(graph, Quantity::Configuration)], &ranges[place(graph, Quantity::Force)]);
    let felt = Felt::new(model, q)?;
    let sizes_of_b = sizes.bias.iter().enumerate().map(|(k, h)| h + tau.get(k).map_or(0.0, |t| t.mag()));
    let beta = sizes_of_b.zip(&felt.free).map(|(b, c)| b * c.sqrt()).sum::<f64>() * (1.0 + SLACK);
    let given = graph.inputs.iter().any(|port| Quantity::of(port) == Some(Quantity::Acceleration));
    let accelerations = felt.free.iter().map(|c| Interval::around_zero(c.sqrt() * beta * (1.0 + SLACK))).collect();
    let accelerations = if given { None } else { Some(accelerations) };
    let columns = ColumnBounds::new(model, &results, (beta, &felt.free), (sizes, accelerations))?;
    let bounds = Bounds { felt, inertia: &sizes.inertia };
    let count: usize = graph.inputs.iter().map(Port::len).sum();
    let mut probe = graph.clone();
    probe.results = graph.ids().collect();
    let mut random = Random(11);
    let mut values: Vec<Vec<Dd>> = Vec::new();
    let mut facts: Vec<Facts> = Vec::new();
    for _ in 0..STATES {
        let inputs: Vec<Dd> = (0..count).map(|_| Dd::from(random.symmetric(2.0))).collect();
        let of_nodes = evaluate(&probe, &inputs);
        let h = match q.is_empty() {
            true => mass_matrix(model, &vec![Dd::ZERO; model.nq()]),
            false => mass_matrix(model, &inputs[place(graph, Quantity::Configuration)]),
        };
        let solved = columns.at(model, graph, (&inputs, &of_nodes), (&h, &results))?;
        facts.push(bounds.facts(model, &h, &solved, &results));
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
    Some(known)
}

/// Which nodes have the number of a fact, or its opposite, at all states.
fn agreements(graph: &Graph, of_nodes: &[Vec<Dd>], facts: &[&Vec<(Dd, Interval)>]) -> Vec<(NodeId, usize, bool)> {
    let mut by_size: Vec<(f64, usize)> =
        facts[0].iter().enumerate().map(|(k, (w, _))| (w.to_f64().abs(), k)).filter(|(w, _)| *w != 0.0).collect();
    by_size.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut found = Vec::new();
    for id in graph.ids() {
        let v = of_nodes[0][id.index()].to_f64();
        let start = by_size.partition_point(|(w, _)| *w < v.abs() * (1.0 - 2e-12));
        let near = by_size[start..].iter().take_while(|(w, _)| *w <= v.abs() * (1.0 + 2e-12));
        for &(_, k) in near {
            let negative = (v < 0.0) != (facts[0][k].0.to_f64() < 0.0);
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
}

/// Numbers at a state, and their ranges at all of them.
struct Facts {
    values: Vec<(Dd, Interval)>,
    /// Of each result.
    adjoints: Vec<Vec<(Dd, Interval)>>,
}

/// How a result depends on the equations for a column: the adjoint of b with its bound relative to √c, and that of x where it is used again,
/// with its bound relative to √H.
struct Influence<'a> {
    column: &'a ColumnAt,
    of_right: Vec<Dd>,
    of_solution: Vec<Dd>,
    most: f64,
}

fn within(x: f64) -> Interval {
    Interval::around_zero(x * (1.0 + SLACK))
}

/// Neighbours, whose sums are accelerations about parallel axes.
fn runs(n: usize) -> impl Iterator<Item = std::ops::RangeInclusive<usize>> {
    (0..n).flat_map(move |i| (i..n).map(move |j| i..=j))
}

impl Bounds<'_> {
    /// From H and the columns that are solved for at a state. One piece: elimination, inverse and adjoints share all of their values.
    fn facts(&self, model: &Model<Dd>, h: &[Dd], columns: &[ColumnAt], results: &[(usize, SolvedFor)]) -> Facts {
        let (n, held, inertia) = (model.nv(), &self.felt.held, self.inertia);
        let root = |k: usize| self.felt.free[k].sqrt();
        let mut a = h.to_vec();
        let row = |x: &[Dd], i: usize| (0..n).fold(Dd::ZERO, |sum, j| sum + h[i * n + j] * x[j]);
        let mut ys: Vec<Vec<Dd>> = columns.iter().map(|c| (0..n).map(|i| row(&c.x, i)).collect()).collect();
        // sums of accelerations about parallel axes are values of their own
        let mut values: Vec<(Dd, Interval)> = Vec::new();
        for column in columns {
            let (x, beta) = (&column.x, column.beta);
            for run in runs(n).filter(|run| column.of == SolvedFor::Acceleration || run.clone().count() == 1) {
                let sum = run.clone().fold(Dd::ZERO, |sum, j| sum + x[j]);
                values.push((sum, within(run.map(|j| root(j) * beta).sum())));
            }
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
            values.extend(columns.iter().zip(&ys).map(|(c, y)| (y[k], within(inertia[k].sqrt() * c.beta))));
            left.retain(|i| *i != k);
            for &i in &left {
                let factor = a[i * n + k] / pivot;
                lower[k].push((i, factor));
                values.push((factor, within((inertia[i] / held[k]).sqrt())));
                for &j in &left {
                    let product = factor * a[k * n + j];
                    a[i * n + j] -= product;
                }
                for y in &mut ys {
                    let product = factor * y[k];
                    y[i] -= product;
                }
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
        let rows: Vec<Vec<Dd>> = (0..n).map(|k| (0..n).map(|j| of_inverse(k, j)).collect()).collect();
        let find = |of: SolvedFor| columns.iter().find(|c| c.of == of);
        let adjoints = results.iter().map(|(k, of)| {
            let Some(column) = find(*of) else { return Vec::new() };
            let own =
                Influence { column, of_right: rows[*k].clone(), of_solution: inverse[*k].clone(), most: root(*k) };
            let through =
                find(SolvedFor::Acceleration).filter(|_| !column.of_accelerations.is_empty()).map(|column_of_qdd| {
                    // g, w = H⁻¹ g and L⁻ᵀ g
                    let g: Vec<Dd> = (0..n)
                        .map(|m| (0..n).fold(Dd::ZERO, |sum, i| sum - rows[*k][i] * column.of_accelerations[i * n + m]))
                        .collect();
                    let times = |matrix: &dyn Fn(usize, usize) -> Dd| -> Vec<Dd> {
                        (0..n).map(|j| (0..n).fold(Dd::ZERO, |sum, m| sum + matrix(j, m) * g[m])).collect()
                    };
                    Influence {
                        column: column_of_qdd,
                        of_right: times(&|j, m| rows[j][m]),
                        of_solution: times(&|j, m| inverse[m][j]),
                        most: root(*k) * column.most_of_accelerations,
                    }
                });
            self.of_result(&std::iter::once(own).chain(through).collect::<Vec<_>>(), &pivots)
        });
        let adjoints = adjoints.collect();
        Facts { values, adjoints }
    }

    /// The adjoints of one result, of all equations that it depends on.
    fn of_result(&self, influences: &[Influence<'_>], pivots: &[Dd]) -> Vec<(Dd, Interval)> {
        let (n, inertia) = (pivots.len(), self.inertia);
        let root = |k: usize| self.felt.free[k].sqrt();
        let mut all = Vec::new();
        for Influence { of_right, of_solution, most, .. } in influences {
            for run in runs(n) {
                let sum = run.clone().fold(Dd::ZERO, |sum, j| sum + of_right[j]);
                all.push((sum, within(run.map(|j| most * root(j)).sum())));
            }
            for j in 0..n {
                all.push((of_solution[j], within(most * inertia[j].sqrt())));
            }
        }
        // of entries of A: of all equations together
        let together = |i: usize, j: usize| {
            influences.iter().fold((Dd::ZERO, 0.0), |(sum, size), of| {
                let x = &of.column.x;
                let (product, most) = (of.of_right[i] * x[j], of.most * root(i) * root(j) * of.column.beta);
                (sum + product, size + most)
            })
        };
        for j in 0..n {
            let (product, size) = together(j, j);
            all.push((product, within(size)));
            all.push((product * pivots[j] * pivots[j], within(size * inertia[j] * inertia[j])));
            for i in 0..j {
                let ((one, of_one), (other, of_other)) = (together(i, j), together(j, i));
                let (sum, size) = (one + other, of_one + of_other);
                all.push((sum, within(size)));
                all.push((sum * pivots[j], within(size * inertia[j])));
                all.push((sum * pivots[i], within(size * inertia[i])));
            }
        }
        all
    }
}
