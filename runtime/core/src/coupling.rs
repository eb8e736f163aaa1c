//! Joints whose coordinates follow those of others: q = a q_source + b, as of the fingers of a gripper.
//!
//! A robot with couplings is its tree, moved by fewer coordinates. With the coordinates y of all joints of the tree and those q that are left to choose,
//! y = G q + b, the principle of virtual power gives everything that belongs to q:
//!
//! ```text
//! τ = Gᵀ τ_tree      H = Gᵀ H_tree G      J = J_tree G      ẏ = G q̇      ÿ = G q̈
//! ```
//!
//! Joints that are left to choose stand first in the vectors of the tree, so that q is where y begins, and G is the identity above the ratios of the
//! others. Without couplings y is q, and nothing is copied.

use crate::base_parameters::BaseParameter;
use crate::dd::Dd;
use crate::model::{Body, BodyId, Joint, Model};
use crate::real::Real;
use alloc::borrow::Cow;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

/// A joint of one coordinate that follows another one, which is no follower itself: q = `ratio` q_source + `offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coupling<T> {
    /// The body whose joint follows. In the vectors of the tree its coordinate stands behind those that are left to choose.
    pub body: BodyId,
    /// The body whose joint it follows.
    pub source: BodyId,
    /// a \[1, m/rad or rad/m\].
    pub ratio: T,
    /// b \[rad or m\].
    pub offset: T,
}

impl<T: Copy> Coupling<T> {
    /// Its numbers through `f`.
    pub fn map<U>(&self, mut f: impl FnMut(T) -> U) -> Coupling<U> {
        Coupling { body: self.body, source: self.source, ratio: f(self.ratio), offset: f(self.offset) }
    }
}

impl Coupling<Dd> {
    /// As a formula of the coordinate that it follows: `2 q[3] + 0.5`.
    pub fn in_words(&self, model: &Model<Dd>) -> String {
        let (ratio, offset) = (self.ratio.to_f64(), self.offset.to_f64());
        let source = model.bodies[self.source].joint.iq;
        let product = match ratio {
            1.0 => format!("q[{source}]"),
            -1.0 => format!("-q[{source}]"),
            _ => format!("{ratio:?} q[{source}]"),
        };
        match offset {
            0.0 => product,
            _ if offset < 0.0 => format!("{product} - {:?}", -offset),
            _ => format!("{product} + {offset:?}"),
        }
    }
}

impl<T> Model<T> {
    /// Number of configuration coordinates of the tree, those of joints that follow included.
    pub fn tree_nq(&self) -> usize {
        self.bodies.iter().map(|b| b.joint.kind.nq()).sum()
    }

    /// Number of velocity coordinates of the tree, those of joints that follow included.
    pub fn tree_nv(&self) -> usize {
        self.bodies.iter().map(|b| b.joint.kind.nv()).sum()
    }

    /// Whether every joint moves by coordinates of its own.
    pub fn is_tree(&self) -> bool {
        self.couplings.is_empty() && self.closure.is_empty()
    }

    /// The coupling that a body's joint follows.
    pub fn coupling_of(&self, body: BodyId) -> Option<&Coupling<T>> {
        self.couplings.iter().find(|coupling| coupling.body == body)
    }

    /// The joints that have coordinates in q, body by body: all but those that follow others.
    pub fn free_joints(&self) -> impl Iterator<Item = &Joint> + Clone + '_ {
        self.free_bodies().map(|b| &self.bodies[b].joint)
    }

    /// All joints in the order of the coordinates of the tree: those that are left to choose, then those that follow.
    pub fn tree_joints(&self) -> Vec<&Joint> {
        self.bodies_in_order().into_iter().map(|b| &self.bodies[b].joint).collect()
    }

    /// The bodies in the order of their joints' coordinates of the tree.
    pub fn bodies_in_order(&self) -> Vec<BodyId> {
        let mut order: Vec<BodyId> = (0..self.bodies.len()).collect();
        order.sort_by_key(|b| self.bodies[*b].joint.iv);
        order
    }

    /// The joints that follow others with their couplings, in the order of the coordinates of the tree.
    pub fn followers(&self) -> Vec<(&Joint, &Coupling<T>)> {
        let mut all: Vec<_> = self.couplings.iter().map(|c| (&self.bodies[c.body].joint, c)).collect();
        all.sort_by_key(|(joint, _)| joint.iv);
        all
    }

    /// The bodies whose joints have coordinates in q.
    pub fn free_bodies(&self) -> impl Iterator<Item = BodyId> + Clone + '_ {
        (0..self.bodies.len()).filter(|b| self.coupling_of(*b).is_none())
    }

    /// The bodies whose joints have entries in q̇: those of joints in q that no loop determines.
    pub fn independent_bodies(&self) -> impl Iterator<Item = BodyId> + Clone + '_ {
        self.free_bodies().filter(|b| !self.is_dependent(*b))
    }

    /// The joints that have entries in q̇, body by body.
    pub fn independent_joints(&self) -> impl Iterator<Item = &Joint> + Clone + '_ {
        self.independent_bodies().map(|b| &self.bodies[b].joint)
    }

    /// The joints that loops determine, in the order of their coordinates.
    pub fn dependent_joints(&self) -> impl Iterator<Item = &Joint> + '_ {
        let first = self.independent_nv();
        self.tree_joints().into_iter().filter(move |joint| joint.iv >= first).take(self.closure.dependents().count())
    }

    /// Number of entries of q̇.
    pub fn independent_nv(&self) -> usize {
        self.independent_joints().map(|joint| joint.kind.nv()).sum()
    }

    /// Whether loops determine the joint of a body.
    pub fn is_dependent(&self, body: BodyId) -> bool {
        self.closure.dependents().any(|b| b == body)
    }

    /// The bodies with joints that have entries in q̇.
    pub fn independently_jointed(&self) -> impl Iterator<Item = &Body<T>> + Clone + '_ {
        self.independent_bodies().map(|b| &self.bodies[b])
    }

    /// Index into q̇ of what moves the joint of a body of one coordinate, and how fast it moves per unit of that.
    pub fn moved_by(&self, body: BodyId) -> (usize, Option<T>)
    where
        T: Copy,
    {
        match self.coupling_of(body) {
            Some(coupling) => (self.bodies[coupling.source].joint.iv, Some(coupling.ratio)),
            None => (self.bodies[body].joint.iv, None),
        }
    }
}

impl<T: Real> Model<T> {
    /// Base parameters with the rows of the tree in which they stand, from those of the coordinates that are left to choose.
    pub fn of_tree<'a>(&self, parameters: &'a [BaseParameter]) -> Cow<'a, [BaseParameter]> {
        if self.couplings.is_empty() {
            return Cow::Borrowed(parameters);
        }
        let mut moved_by: Vec<(usize, usize)> = Vec::new();
        for (b, body) in self.bodies.iter().enumerate() {
            let free = self.moved_by(b).0;
            moved_by.extend((0..body.joint.kind.nv()).map(|k| (body.joint.iv + k, free + k)));
        }
        let of = |parameter: &BaseParameter| {
            let rows = moved_by.iter().filter(|(_, free)| parameter.rows.contains(free)).map(|(row, _)| *row);
            BaseParameter { rows: rows.collect(), ..parameter.clone() }
        };
        Cow::Owned(parameters.iter().map(of).collect())
    }

    /// y: the configuration of the tree.
    pub fn tree_positions<'a>(&self, q: &'a [T]) -> Cow<'a, [T]> {
        self.extended(Cow::Borrowed(q), self.tree_nq(), |coupling, q| {
            let [own, source] = [coupling.body, coupling.source].map(|b| self.bodies[b].joint.iq);
            (own, coupling.ratio * q[source] + coupling.offset)
        })
    }

    /// G q̇: velocities or displacements of the tree, which stands at y.
    pub fn tree_rates<'a>(&self, y: &[T], rates: &'a [T]) -> Cow<'a, [T]> {
        self.with_followers(self.open_rates(y, rates))
    }

    /// q, q̇ and q̈ of the tree.
    pub fn tree_motion<'a>(&self, [q, qd, qdd]: [&'a [T]; 3]) -> [Cow<'a, [T]>; 3] {
        let y = self.tree_positions(q);
        let yd = self.tree_rates(&y, qd);
        let mut open = self.open_rates(&y, qdd);
        for (k, bias) in self.embedding_bias(&y, &yd).into_iter().enumerate() {
            let own = &mut open.to_mut()[self.nv() + k];
            *own = *own + bias;
        }
        let ydd = self.with_followers(open);
        [y, yd, ydd]
    }

    /// Rates with those of joints that follow others.
    fn with_followers<'a>(&self, rates: Cow<'a, [T]>) -> Cow<'a, [T]> {
        let of = |coupling: &Coupling<T>, rates: &[T]| {
            let [own, source] = [coupling.body, coupling.source].map(|b| self.bodies[b].joint.iv);
            (own, coupling.ratio * rates[source])
        };
        self.extended(rates, self.tree_nv(), of)
    }

    fn extended<'a>(&self, x: Cow<'a, [T]>, len: usize, of: impl Fn(&Coupling<T>, &[T]) -> (usize, T)) -> Cow<'a, [T]> {
        if self.couplings.is_empty() {
            return x;
        }
        debug_assert_eq!(x.len() + self.couplings.len(), len, "coordinates but those of followers");
        let mut all = x.into_owned();
        all.resize(len, T::zero());
        for coupling in &self.couplings {
            let (place, value) = of(coupling, &all);
            all[place] = value;
        }
        Cow::Owned(all)
    }

    /// Gᵀ f: what forces of the tree, which stands at y, or rows of such, do along the independent velocities; `width` numbers to a row.
    pub fn free_rows(&self, y: &[T], mut rows: Vec<T>, width: usize) -> Vec<T> {
        for coupling in &self.couplings {
            let [own, source] = [coupling.body, coupling.source].map(|b| self.bodies[b].joint.iv);
            for k in 0..width {
                let (at, from) = (source * width + k, own * width + k);
                rows[at] = rows[at] + coupling.ratio * rows[from];
            }
        }
        if !self.couplings.is_empty() {
            rows.truncate(self.open_nv() * width);
        }
        match self.closure.is_empty() {
            true => rows,
            false => self.independent_rows(y, rows, width),
        }
    }

    /// Gᵀ f of generalized forces of the tree.
    pub fn free_forces(&self, y: &[T], forces: Vec<T>) -> Vec<T> {
        self.free_rows(y, forces, 1)
    }

    /// J G of a matrix with a column per velocity coordinate of the tree, by rows.
    pub fn free_columns(&self, y: &[T], matrix: Vec<T>) -> Vec<T> {
        if self.is_tree() {
            return matrix;
        }
        let of_row = |row: &[T]| self.free_forces(y, row.to_vec());
        matrix.chunks(self.tree_nv()).flat_map(of_row).collect()
    }

    /// Gᵀ H G of a matrix over the velocity coordinates of the tree, by rows.
    pub fn free_square(&self, y: &[T], matrix: Vec<T>) -> Vec<T> {
        self.free_rows(y, self.free_columns(y, matrix), self.nv())
    }

    /// Gᵀ H G of a symmetric matrix, which stays symmetric to the bit.
    pub fn free_symmetric(&self, y: &[T], matrix: Vec<T>) -> Vec<T> {
        let (nv, mut h) = (self.nv(), self.free_square(y, matrix));
        if !self.is_tree() {
            (0..nv).for_each(|i| (0..i).for_each(|j| h[i * nv + j] = h[j * nv + i]));
        }
        h
    }
}
