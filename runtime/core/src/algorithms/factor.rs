//! Forward dynamics by factoring the mass matrix: H = Lᵀ D L without fill-in.
//!
//! Numbered from the base to the tips, H has a zero wherever two joints lie on different branches. Eliminated from the
//! tips down, it keeps them all, so that a leg costs what a leg has (Featherstone 2008, section 6.3-6.5, tables 6.3-6.5).

mod response;

pub use response::BranchResponses;

use super::crba::mass_matrix;
use super::rnea::bias_force;
use crate::model::{BodyId, Model};
use crate::real::Real;
use alloc::collections::BTreeSet;
use alloc::vec;
use alloc::vec::Vec;

/// H = Lᵀ D L of a mass matrix: L unit lower triangular over the joints from base to tips, D diagonal.
#[derive(Clone, Debug)]
pub struct Ltdl<T> {
    /// Per row of L, from the base outwards: its velocity coordinate.
    coordinates: Vec<usize>,
    /// Per row: the next row towards the base whose joint carries this one.
    parents: Vec<Option<usize>>,
    /// L below the diagonal, by rows; entries outside a row's own branch are never touched.
    lower: Vec<Vec<T>>,
    /// 1 / D.
    inverse_pivots: Vec<T>,
    /// Coordinates that do not move, each with its row of H.
    held: Vec<(usize, Vec<T>)>,
}

impl<T: Real> Ltdl<T> {
    /// Factors H, nv × nv, row-major, the mass matrix of `model`.
    ///
    /// A pivot is the inertia that a joint feels when all joints outside it are free. It is positive as long as every
    /// joint moves some mass or inertia; a joint that moves none has no forward dynamics, and what comes out is not
    /// finite.
    pub fn factor(model: &Model<T>, mass_matrix: &[T]) -> Self {
        Self::factor_along(model, branches(model), mass_matrix, &[])
    }

    /// Factors H where some coordinates, by their indices, do not move: what [`solve`](Ltdl::solve) gives is zero there, and elsewhere what
    /// the matrix without their rows and columns gives. They are not divided by, whatever their joints feel.
    pub fn factor_holding(model: &Model<T>, matrix: &[T], held: &[usize], is_dense: bool) -> Self {
        let mut chain = branches(model);
        if is_dense {
            chain.parents = (0..chain.coordinates.len()).map(|row| row.checked_sub(1)).collect();
        }
        Self::factor_along(model, chain, matrix, held)
    }

    fn factor_along(model: &Model<T>, branches: Branches, mass_matrix: &[T], held: &[usize]) -> Self {
        let nv = model.nv();
        let Branches { coordinates, bodies, parents } = branches;
        // the triangle below the diagonal, in the order of the rows; it becomes L in place
        let is_held = |row: usize| held.contains(&coordinates[row]);
        let entry = |row: usize, column: usize| match is_held(row) || is_held(column) {
            true => T::zero(),
            false => mass_matrix[coordinates[row] * nv + coordinates[column]],
        };
        let mut lower: Vec<Vec<T>> = (0..nv).map(|i| (0..=i).map(|j| entry(i, j)).collect()).collect();
        let mut inverse_pivots = vec![T::zero(); nv];
        // what is held has an infinite pivot
        for k in (0..nv).rev().filter(|k| !is_held(*k)) {
            T::section("factor", Some(bodies[k]));
            let inverse_pivot = (T::one() / lower[k][k]).named("inverse_pivot", coordinates[k], "");
            inverse_pivots[k] = inverse_pivot;
            for i in up(&parents, k) {
                // H_ij −= (H_ki / H_kk) H_kj for all j from i down to the base, then L_ki = H_ki / H_kk
                let factor = lower[k][i] * inverse_pivot;
                for j in core::iter::once(i).chain(up(&parents, i)) {
                    lower[i][j] = lower[i][j] - factor * lower[k][j];
                }
                lower[k][i] = factor;
            }
        }
        let row = |i: usize| (i, mass_matrix[i * nv..(i + 1) * nv].to_vec());
        let held = held.iter().map(|i| row(*i)).collect();
        Ltdl { coordinates, parents, lower, inverse_pivots, held }
    }

    /// x with H x = `right`, nv numbers by velocity coordinate.
    pub fn solve(&self, right: &[T]) -> Vec<T> {
        self.finish(self.half(right))
    }

    /// H⁻¹, nv × nv, row-major, of a matrix whose coordinates all move.
    pub fn inverse(&self) -> Vec<T> {
        self.inverse_by(&BranchResponses::default())
    }

    /// (H x)_i of the coordinates i that do not move: what moves the others as x says puts on them.
    pub(super) fn on_held<'a>(&'a self, x: &'a [T]) -> impl Iterator<Item = (usize, T)> + 'a {
        let along = move |row: &[T]| row.iter().zip(x).fold(T::zero(), |sum, (h, x)| sum + *h * *x);
        self.held.iter().map(move |(i, row)| (*i, along(row)))
    }

    /// y with Lᵀ y = `right`, by rows from the base outwards: bᵀ H⁻¹ c is y_bᵀ D⁻¹ y_c.
    pub(super) fn half(&self, right: &[T]) -> Vec<T> {
        let mut y: Vec<T> = self.coordinates.iter().map(|&i| right[i]).collect();
        T::section("solve", None);
        for i in (0..y.len()).rev() {
            for j in up(&self.parents, i) {
                y[j] = y[j] - self.lower[i][j] * y[i];
            }
        }
        y
    }

    /// D⁻¹ y.
    pub(super) fn scaled(&self, y: &[T]) -> Vec<T> {
        y.iter().zip(&self.inverse_pivots).map(|(y, d)| *y * *d).collect()
    }

    /// x with L x = D⁻¹ y, nv numbers by velocity coordinate.
    pub(super) fn finish(&self, y: Vec<T>) -> Vec<T> {
        let last = y.len().saturating_sub(1);
        self.finish_up_to(last, y)
    }

    /// The velocity coordinates in the order of the rows, from the base outwards.
    pub(super) fn rows(&self) -> &[usize] {
        &self.coordinates
    }

    /// The same of the rows up to the one given; the others are left as they were.
    pub(super) fn finish_up_to(&self, last: usize, y: Vec<T>) -> Vec<T> {
        self.finish_by(last, y, |_, _| None)
    }

    /// The same, where x of some rows is known from x of those before them.
    fn finish_by(&self, last: usize, y: Vec<T>, known: impl Fn(usize, &[T]) -> Option<T>) -> Vec<T> {
        let mut x = y;
        let mut solution = x.clone();
        for i in (0..x.len()).take(last + 1) {
            x[i] = known(i, &x).unwrap_or_else(|| {
                let scaled = x[i] * self.inverse_pivots[i];
                up(&self.parents, i).fold(scaled, |x_i, j| x_i - self.lower[i][j] * x[j])
            });
            solution[self.coordinates[i]] = x[i];
        }
        solution
    }

    /// Σ 1/D: how easily the joints move, each with those outside it free.
    pub(super) fn mobility(&self) -> T {
        self.inverse_pivots.iter().fold(T::zero(), |sum, d| sum + *d)
    }
}

/// q̈ \[rad/s² or m/s²\] that the generalized forces tau \[N·m or N\] cause: H q̈ = tau − h, with [`Ltdl`].
#[doc(alias("forward dynamics", "LTDL"))]
pub fn forward_dynamics_ltdl<T: Real>(model: &Model<T>, q: &[T], qd: &[T], tau: &[T]) -> Vec<T> {
    let bias = bias_force(model, q, qd);
    let drive: Vec<T> = tau.iter().zip(&bias).map(|(&t, &h)| t - h).collect();
    Ltdl::factor(model, &mass_matrix(model, q)).solve(&drive)
}

/// The velocity coordinates in the order of their bodies (Featherstone 2008, section 6.4: the expanded parent array).
struct Branches {
    /// Index into qd.
    coordinates: Vec<usize>,
    /// The body it moves.
    bodies: Vec<BodyId>,
    /// Place in this list of the next coordinate towards the base.
    parents: Vec<Option<usize>>,
}

/// The elimination tree of H: a row's parent is the nearest row towards the base that it is coupled with, by a body that both move or by rows
/// eliminated before. A floating base is a chain of six, and of a tree the parents are those of the bodies; joints that follow others, or from loops, join branches.
fn branches<T: Real>(model: &Model<T>) -> Branches {
    match model.is_tree() {
        true => branches_of_tree(model),
        false => joined_branches(model),
    }
}

/// Of a robot whose joints all have coordinates of their own: the bodies' own branches.
fn branches_of_tree<T: Real>(model: &Model<T>) -> Branches {
    let mut list = Branches { coordinates: Vec::new(), bodies: Vec::new(), parents: Vec::new() };
    let mut last_of_body: Vec<Option<usize>> = Vec::new();
    for (b, body) in model.bodies.iter().enumerate() {
        let mut parent = body.parent.and_then(|p| last_of_body[p]);
        for k in 0..body.joint.kind.nv() {
            list.coordinates.push(body.joint.iv + k);
            list.bodies.push(b);
            list.parents.push(parent);
            parent = Some(list.coordinates.len() - 1);
        }
        last_of_body.push(parent);
    }
    list
}

/// Of a robot whose joints follow others, or from loops.
fn joined_branches<T: Real>(model: &Model<T>) -> Branches {
    let mut list = Branches { coordinates: Vec::new(), bodies: Vec::new(), parents: Vec::new() };
    let mut rows = vec![0..0; model.bodies.len()];
    for b in model.independent_bodies() {
        let (joint, first) = (&model.bodies[b].joint, list.bodies.len());
        list.coordinates.extend(joint.iv..joint.iv + joint.kind.nv());
        list.bodies.extend((0..joint.kind.nv()).map(|_| b));
        rows[b] = first..list.bodies.len();
    }
    let mut towards_base: Vec<BTreeSet<usize>> = vec![BTreeSet::new(); list.bodies.len()];
    let mut movers: Vec<BTreeSet<usize>> = Vec::with_capacity(rows.len());
    for (b, body) in model.bodies.iter().enumerate() {
        let mut own = body.parent.map_or(BTreeSet::new(), |parent| movers[parent].clone());
        own.extend(model.movers(b).into_iter().flat_map(|mover| rows[mover].clone()));
        // of rows that are joined in pairs the elimination joins the others
        for (lower, upper) in own.iter().zip(own.iter().skip(1)) {
            towards_base[*upper].insert(*lower);
        }
        movers.push(own);
    }
    let mut parents = vec![None; towards_base.len()];
    for row in (0..parents.len()).rev() {
        let mut others = core::mem::take(&mut towards_base[row]);
        parents[row] = others.pop_last();
        if let Some(parent) = parents[row] {
            towards_base[parent].extend(others);
        }
    }
    Branches { parents, ..list }
}

/// The rows on the way from `row` to the base, without `row`.
fn up(parents: &[Option<usize>], row: usize) -> impl Iterator<Item = usize> + '_ {
    core::iter::successors(parents[row], |&i| parents[i])
}
