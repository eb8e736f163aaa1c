//! How branches respond to the motion of what carries them.
//!
//! Where b of H x = b is zero on a branch, the branch follows what carries it: x_i = Σ R_ij x_j over the rows j from the cut, the last row towards
//! the base that b reaches, to the base. R = −H_bb⁻¹ H_bc of the branch b and the rows c that carry it is what the Schur complement
//! H_cc − H_cb H_bb⁻¹ H_bc multiplies by (a leg's on the trunk). Formed once, it spares every column that leaves the branch alone the substitution
//! along it: a row takes as many products as its cut has rows above it, not as many as it has itself.

use super::{up, Ltdl};
use crate::real::Real;
use alloc::collections::BTreeMap;
use alloc::vec::Vec;
use core::cell::RefCell;

/// The responses of rows to their cuts, of one factor, as they were asked for.
#[derive(Clone, Debug)]
pub struct BranchResponses<T> {
    /// By row and cut: R of the cut and of the rows from there to the base.
    known: RefCell<BTreeMap<(usize, usize), Vec<T>>>,
}

impl<T> Default for BranchResponses<T> {
    fn default() -> Self {
        BranchResponses { known: RefCell::default() }
    }
}

impl<T: Real> BranchResponses<T> {
    fn is_known(&self, row: usize, cut: usize) -> bool {
        self.known.borrow().contains_key(&(row, cut))
    }

    fn of(&self, factor: &Ltdl<T>, row: usize, cut: usize) -> Vec<T> {
        if let Some(known) = self.known.borrow().get(&(row, cut)) {
            return known.clone();
        }
        let lower = &factor.lower[row];
        let between = up(&factor.parents, row).take_while(|m| *m != cut);
        let between: Vec<(usize, Vec<T>)> = between.map(|m| (m, self.of(factor, m, cut))).collect();
        T::section("response", None);
        let entry = |(place, j): (usize, usize)| {
            between.iter().fold(-lower[j], |sum, (m, response)| sum - lower[*m] * response[place])
        };
        let response: Vec<T> = from(&factor.parents, cut).enumerate().map(entry).collect();
        T::section("solve", None);
        self.known.borrow_mut().insert((row, cut), response.clone());
        response
    }

    /// x of a row, from x of those before it.
    fn motion(&self, factor: &Ltdl<T>, (row, cut): (usize, usize), x: &[T]) -> T {
        let response = self.of(factor, row, cut);
        let mut products = response.iter().zip(from(&factor.parents, cut)).map(|(r, j)| *r * x[j]);
        let first = products.next().unwrap_or_else(T::zero);
        products.fold(first, |sum, product| sum + product)
    }
}

impl<T: Real> Ltdl<T> {
    /// x with H x = `right`, nv numbers by velocity coordinate, which are zero but on the branch of one coordinate: of those that carry it and
    /// those that it carries. Other branches follow by their responses.
    pub fn solve_on_branch(&self, coordinate: usize, right: &[T], responses: &BranchResponses<T>) -> Vec<T> {
        let own = self.row_of(coordinate);
        let reaches = |row: usize| is_on_branch(&self.parents, own, row);
        let last = self.coordinates.len().saturating_sub(1);
        self.finish_by(last, self.half(right), |row, x| {
            let cut = self.cut(row, reaches)?;
            Some(responses.motion(self, (row, cut), x))
        })
    }

    /// H⁻¹, nv × nv, row-major, of a matrix whose coordinates all move: one triangle by substitution, the other as it is symmetric. Responses are
    /// formed where they pay, and taken where they are known.
    pub fn inverse_by(&self, responses: &BranchResponses<T>) -> Vec<T> {
        let nv = self.coordinates.len();
        let cut = |row: usize, column: usize| self.cut(row, |m| from(&self.parents, column).any(|j| j == m));
        let mut columns: BTreeMap<(usize, usize), usize> = BTreeMap::new();
        for (row, column) in (0..nv).flat_map(|column| (0..column).map(move |row| (row, column))) {
            if let Some(cut) = cut(row, column) {
                *columns.entry((row, cut)).or_default() += 1;
            }
        }
        // a product for each row between and each row from the cut on is spared by every column, and taken once
        let pays = |row: usize, cut: usize| {
            responses.is_known(row, cut) || columns[&(row, cut)] > from(&self.parents, cut).count()
        };
        let mut inverse = alloc::vec![T::zero(); nv * nv];
        for k in 0..nv {
            let unit: Vec<T> = (0..nv).map(|i| if i == self.coordinates[k] { T::one() } else { T::zero() }).collect();
            let column = self.finish_by(k, self.half(&unit), |row, x| {
                let cut = cut(row, k).filter(|cut| pays(row, *cut))?;
                Some(responses.motion(self, (row, cut), x))
            });
            for i in 0..=k {
                let (i, k) = (self.coordinates[i], self.coordinates[k]);
                (inverse[i * nv + k], inverse[k * nv + i]) = (column[i], column[i]);
            }
        }
        inverse
    }

    /// The velocity coordinates by their branches: those together that the same others carry or are carried by, all of a leg for instance.
    pub fn branches(&self) -> Vec<Vec<usize>> {
        let reached = |row: usize| (0..self.parents.len()).map(|m| is_on_branch(&self.parents, row, m)).collect();
        let mut branches: Vec<(Vec<bool>, Vec<usize>)> = Vec::new();
        for (row, coordinate) in self.coordinates.iter().enumerate() {
            let own: Vec<bool> = reached(row);
            match branches.iter_mut().find(|(other, _)| *other == own) {
                Some((_, coordinates)) => coordinates.push(*coordinate),
                None => branches.push((own, alloc::vec![*coordinate])),
            }
        }
        branches.into_iter().map(|(_, coordinates)| coordinates).collect()
    }

    /// The last row towards the base that b reaches, of a row that b does not reach; none where the response would be the row of L, right on its cut.
    fn cut(&self, row: usize, reaches: impl Fn(usize) -> bool) -> Option<usize> {
        let cut = up(&self.parents, row).find(|m| reaches(*m)).filter(|_| !reaches(row))?;
        (self.parents[row] != Some(cut)).then_some(cut)
    }

    fn row_of(&self, coordinate: usize) -> usize {
        self.coordinates.iter().position(|k| *k == coordinate).expect("every velocity coordinate has a row")
    }
}

/// The row and those on the way to the base.
fn from(parents: &[Option<usize>], row: usize) -> impl Iterator<Item = usize> + '_ {
    core::iter::once(row).chain(up(parents, row))
}

/// Whether one of two rows carries the other.
fn is_on_branch(parents: &[Option<usize>], a: usize, b: usize) -> bool {
    from(parents, a).any(|m| m == b) || up(parents, b).any(|m| m == a)
}
