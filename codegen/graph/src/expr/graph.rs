//! Nodes and graphs.

use super::counts::{Counts, TAIL};
use super::op::{Binary, Counted, OpKind, OpRow, Unary};
use crate::number::Scalar;
use std::hash::{Hash, Hasher};
use straightline_core::Dd;

/// Index of a node in its [`Graph`]; operands have smaller indices than their users.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct NodeId(pub u32);

impl NodeId {
    /// Where the node stands in [`Graph::ops`] and in all that has one entry per node.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// A constant in double-double, comparable by its bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Constant {
    hi: u64,
    lo: u64,
}

impl Constant {
    /// The constant of that value; the sign of a zero is dropped.
    pub fn new(value: Dd) -> Self {
        let clear = |x: f64| if x == 0.0 { 0.0 } else { x };
        Constant { hi: clear(value.hi()).to_bits(), lo: clear(value.lo()).to_bits() }
    }

    /// The value that was given, but for the sign of a zero.
    pub fn value(self) -> Dd {
        Dd::new(f64::from_bits(self.hi), f64::from_bits(self.lo))
    }

    /// Whether it is exactly this f64.
    pub fn is(self, x: f64) -> bool {
        self.lo == 0 && f64::from_bits(self.hi) == x
    }

    /// Whether it is below zero.
    pub fn is_negative(self) -> bool {
        f64::from_bits(self.hi) < 0.0
    }
}

/// A node of a program: a leaf, an operation of the [tables](super::op), or part of an angle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Op {
    /// The input of that flat index (groups one after the other).
    Input(u32),
    /// A constant.
    Constant(Constant),
    /// An operation on a number.
    Unary(Unary, NodeId),
    /// An operation on two numbers.
    Binary(Binary, NodeId, NodeId),
    /// The sum of two angles as if it were formed exactly: of inputs, constants and such sums. Only [`Op::SinCos`] may use it,
    /// and such sums. It is not a value that could be stored, but is formed where its sine is.
    AngleSum(NodeId, NodeId),
    /// sin and cos of an angle, together; only [`Op::Sin`] and [`Op::Cos`] may use it.
    SinCos(NodeId),
    /// The sine of a [`Op::SinCos`].
    Sin(NodeId),
    /// The cosine of a [`Op::SinCos`].
    Cos(NodeId),
}

impl Hash for Op {
    /// In as few words as there can be: graphs are made by looking operations up.
    fn hash<H: Hasher>(&self, state: &mut H) {
        let word = |kind: u64, a: u32| kind << 32 | u64::from(a);
        match *self {
            Op::Input(k) => state.write_u64(word(1, k)),
            Op::Constant(c) => c.hash(state),
            Op::Unary(op, a) => state.write_u64(word(0x100 + op as u64, a.0)),
            Op::Binary(op, a, b) => {
                state.write_u64(word(0x200 + op as u64, a.0));
                state.write_u32(b.0);
            }
            Op::AngleSum(a, b) => {
                state.write_u64(word(2, a.0));
                state.write_u32(b.0);
            }
            Op::SinCos(a) => state.write_u64(word(3, a.0)),
            Op::Sin(a) => state.write_u64(word(4, a.0)),
            Op::Cos(a) => state.write_u64(word(5, a.0)),
        }
    }
}

impl Op {
    /// The operands, in order.
    pub fn operands(self) -> impl Iterator<Item = NodeId> {
        let (a, b) = match self {
            Op::Input(_) | Op::Constant(_) => (None, None),
            Op::Unary(_, a) | Op::SinCos(a) | Op::Sin(a) | Op::Cos(a) => (Some(a), None),
            Op::Binary(_, a, b) | Op::AngleSum(a, b) => (Some(a), Some(b)),
        };
        a.into_iter().chain(b)
    }

    /// The same operation on other operands.
    #[must_use]
    pub fn map(self, mut f: impl FnMut(NodeId) -> NodeId) -> Op {
        match self {
            Op::Input(_) | Op::Constant(_) => self,
            Op::Unary(op, a) => Op::Unary(op, f(a)),
            Op::Binary(op, a, b) => Op::Binary(op, f(a), f(b)),
            Op::AngleSum(a, b) => Op::AngleSum(f(a), f(b)),
            Op::SinCos(a) => Op::SinCos(f(a)),
            Op::Sin(a) => Op::Sin(f(a)),
            Op::Cos(a) => Op::Cos(f(a)),
        }
    }

    /// What is known of an operation on numbers; none of leaves, angles and what is made of these.
    #[inline]
    pub fn row(self) -> Option<&'static OpRow> {
        match self {
            Op::Unary(op, _) => Some(op.row()),
            Op::Binary(op, ..) => Some(op.row()),
            _ => None,
        }
    }

    /// Whether it is an operation on numbers that is not [free](Counted::Free).
    #[inline]
    pub fn is_counted(self) -> bool {
        self.row().is_some_and(|row| row.counted != Counted::Free)
    }

    /// Whether it is a polynomial of its operands.
    #[inline]
    pub fn is_polynomial(self) -> bool {
        self.row().is_some_and(|row| row.kind == OpKind::Polynomial)
    }

    /// Whether it is an input or a constant.
    #[inline]
    pub fn is_leaf(self) -> bool {
        matches!(self, Op::Input(_) | Op::Constant(_))
    }

    /// Whether it is the same operation, whatever its operands, inputs and numbers are.
    pub fn is_alike(self, other: Op) -> bool {
        match (self, other) {
            (Op::Unary(op, _), Op::Unary(other, _)) => op == other,
            (Op::Binary(op, ..), Op::Binary(other, ..)) => op == other,
            _ => std::mem::discriminant(&self) == std::mem::discriminant(&other),
        }
    }
}

/// A named group of inputs or outputs with its array shape, such as `q` with `[7]` or `h` with `[7, 7]`.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Port {
    /// The name.
    pub name: String,
    /// The extents, outermost first.
    pub shape: Vec<usize>,
    /// A struct around the array, if it is not a plain one.
    pub wrapper: Option<String>,
}

impl Port {
    /// A port of that name and shape.
    pub fn new(name: &str, shape: &[usize]) -> Self {
        Port { name: name.to_string(), shape: shape.to_vec(), wrapper: None }
    }

    /// A port whose scalars lie in field 0 of a struct of that name.
    pub fn wrapped(name: &str, shape: &[usize], wrapper: &str) -> Self {
        Port { wrapper: Some(wrapper.to_string()), ..Port::new(name, shape) }
    }

    /// Number of scalars.
    pub fn len(&self) -> usize {
        self.shape.iter().product()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// A stretch of an algorithm: its phase, and which of many parts it is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Section {
    /// Such as `forward`.
    pub phase: &'static str,
    /// Index of the part, where the phase goes from one to the next.
    pub index: Option<usize>,
}

/// What a reader wants to know of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Note {
    /// Quantity, index of the part that it belongs to, component: `("omega", 3, "x")`.
    pub name: Option<(&'static str, usize, &'static str)>,
    /// Index into [`Graph::sections`].
    pub section: u32,
}

/// The formats of a value of a program in mixed precision: one that differs from that in which it is computed is what it is rounded to, for all
/// that use it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Precision {
    /// In which it is computed.
    pub computed: Scalar,
    /// In which it is used.
    pub held: Scalar,
}

impl Precision {
    /// Computed and used in one format.
    pub fn of(scalar: Scalar) -> Self {
        Precision { computed: scalar, held: scalar }
    }

    /// Whether it is rounded to another format.
    pub fn is_rounded(self) -> bool {
        self.computed != self.held
    }
}

/// Operations that are the same for several lanes: a loop over them can write each row once.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Alike {
    /// What the lanes are.
    pub lanes: LoopLanes,
    /// One operation for all lanes: of every lane its node, which has the same kind of operation. Rows stand behind those that they
    /// use, and all of them behind one another.
    pub rows: Vec<Vec<NodeId>>,
    /// Whether the loop is for one lane after the other, not for vectors of them: it leaves nothing behind but what is used there.
    pub is_rolled: bool,
}

/// What the lanes of a loop are.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum LoopLanes {
    /// Identical limbs: the first part of each, as sections count them.
    Limbs(Vec<usize>),
    /// So many columns of matrices.
    Columns(usize),
}

impl LoopLanes {
    /// How many.
    pub fn count(&self) -> usize {
        match self {
            LoopLanes::Limbs(limbs) => limbs.len(),
            LoopLanes::Columns(count) => *count,
        }
    }
}

/// A program of scalar operations.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Graph {
    /// The operations.
    pub ops: Vec<Op>,
    /// One note per operation. They are not stored.
    #[cfg_attr(feature = "serde", serde(skip))]
    pub notes: Vec<Note>,
    /// Stretches that the notes refer to. They are not stored.
    #[cfg_attr(feature = "serde", serde(skip))]
    pub sections: Vec<Section>,
    /// Input groups; [`Op::Input`] counts through them.
    pub inputs: Vec<Port>,
    /// Output groups.
    pub outputs: Vec<Port>,
    /// The nodes that are put out, group after group.
    pub results: Vec<NodeId>,
    /// Of a program in mixed precision, how each value is computed; empty where all are in one format. Chosen after all
    /// [passes](crate::pass), which take no such program.
    pub formats: Vec<Precision>,
    /// Stretches that may be written as loops over limbs. Passes, again, come before.
    pub alike: Vec<Alike>,
    /// By which kernel its sines and cosines are computed. Passes, again, come before.
    pub sines: Sines,
}

/// A kernel of sines and cosines.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Sines {
    /// Every digit, in the whole domain: `straightline_core::trig`.
    #[default]
    Precise,
    /// An absolute error, for angles that are known to be small: `straightline_core::short_sines`.
    Short,
}

impl Graph {
    /// The same with nothing said of its operations.
    #[must_use]
    pub fn without_notes(self) -> Self {
        let notes = vec![Note { name: None, section: 0 }; self.ops.len()];
        Graph { notes, sections: vec![Section { phase: "", index: None }], ..self }
    }

    /// The terms of an angle: of a sum of angles those, of anything else itself.
    pub fn angle_terms(&self, angle: NodeId) -> Vec<NodeId> {
        match self.op(angle) {
            Op::AngleSum(a, b) => [self.angle_terms(a), self.angle_terms(b)].concat(),
            _ => vec![angle],
        }
    }

    /// How a value of a program in this scalar is computed.
    pub fn precision(&self, id: NodeId, scalar: Scalar) -> Precision {
        self.formats.get(id.index()).copied().unwrap_or(Precision::of(scalar))
    }

    /// The widest format of a program in this scalar.
    pub fn widest(&self, scalar: Scalar) -> Scalar {
        if self.formats.is_empty() {
            return scalar;
        }
        scalar.wider().unwrap_or(scalar)
    }

    /// For passes, which make other nodes: what is said of the present ones would be lost without a word.
    ///
    /// # Panics
    /// If the program has [`Graph::formats`] or [`Graph::alike`].
    pub(crate) fn expect_plain(&self, pass: &str) {
        assert!(self.formats.is_empty(), "`{pass}` would lose the formats of values: mix precisions after it");
        assert!(self.alike.is_empty(), "`{pass}` would lose the loops over lanes: write lanes out after it");
        assert!(self.sines == Sines::Precise, "`{pass}` would lose the kernel of sines: choose it after it");
    }

    /// The operation of a node.
    pub fn op(&self, id: NodeId) -> Op {
        self.ops[id.index()]
    }

    /// All nodes, operands before users.
    pub fn ids(&self) -> impl Iterator<Item = NodeId> {
        (0..self.ops.len() as u32).map(NodeId)
    }

    /// How often each node is used, as an operand or as a result.
    pub fn uses(&self) -> Vec<u32> {
        let mut uses = vec![0; self.ops.len()];
        for op in &self.ops {
            op.operands().for_each(|a| uses[a.index()] += 1);
        }
        self.results.iter().for_each(|r| uses[r.index()] += 1);
        uses
    }

    /// The stretch of [`Graph::alike`] that each node lies in.
    pub fn stretches(&self) -> Vec<Option<usize>> {
        let mut stretch = vec![None; self.ops.len()];
        for (k, alike) in self.alike.iter().enumerate() {
            alike.rows.iter().flatten().for_each(|id| stretch[id.index()] = Some(k));
        }
        stretch
    }

    /// How often each node is used from another stretch than its own: there it is a number that is rounded.
    pub fn uses_across(&self) -> Vec<u32> {
        let mut uses = vec![0; self.ops.len()];
        if self.alike.is_empty() {
            return uses;
        }
        let stretch = self.stretches();
        for (i, op) in self.ops.iter().enumerate() {
            op.operands().filter(|a| stretch[a.index()] != stretch[i]).for_each(|a| uses[a.index()] += 1);
        }
        uses
    }

    /// Which nodes the results need.
    pub fn live(&self) -> Vec<bool> {
        let mut live = vec![false; self.ops.len()];
        self.results.iter().for_each(|r| live[r.index()] = true);
        // a row of a loop over limbs is computed for all of them; its users stand behind all of its nodes
        let mut row_of: Vec<Option<&Vec<NodeId>>> = vec![None; if self.alike.is_empty() { 0 } else { self.ops.len() }];
        for row in self.alike.iter().flat_map(|alike| &alike.rows) {
            row_of[row[row.len() - 1].index()] = Some(row);
        }
        for (i, op) in self.ops.iter().enumerate().rev() {
            if let Some(row) = row_of.get(i).copied().flatten() {
                let any = row.iter().any(|id| live[id.index()]);
                row.iter().for_each(|id| live[id.index()] = any);
            }
            if live[i] {
                op.operands().for_each(|a| live[a.index()] = true);
            }
        }
        live
    }

    /// How often each node is used, as an operand of these or as a result.
    fn uses_by(&self, users: &[bool]) -> Vec<u32> {
        let mut uses = vec![0; self.ops.len()];
        let users = self.ops.iter().zip(users).filter(|(_, is_user)| **is_user);
        users.flat_map(|(op, _)| op.operands()).for_each(|a| uses[a.index()] += 1);
        self.results.iter().for_each(|r| uses[r.index()] += 1);
        uses
    }

    /// Operation counts of what the results need.
    pub fn counts(&self) -> Counts {
        let live = self.live();
        let mut uses = self.uses_by(&live);
        uses.iter_mut().zip(self.uses_across()).for_each(|(uses, across)| *uses += across);
        // a sum of n terms, the sums in it that nothing else uses included, of which k are products (seen through a sign) that
        // nothing else uses: in the right order as many of its additions are fused
        let inner = |a: NodeId| match self.op(a) {
            Op::Unary(Unary::Neg, b) if uses[a.index()] == 1 => b,
            _ => a,
        };
        let is_sum = |a: NodeId| matches!(self.op(a), Op::Binary(Binary::Add | Binary::Sub, ..));
        let mut products = vec![0usize; self.ops.len()];
        let mut terms = vec![0usize; self.ops.len()];
        let mut within = vec![false; self.ops.len()];
        let mut counts = Counts::default();
        for (i, op) in self.ops.iter().enumerate() {
            if !live[i] {
                continue;
            }
            if let Some(row) = op.row() {
                counts.count(row.counted);
            }
            match *op {
                Op::Binary(Binary::Add | Binary::Sub, a, b) => {
                    for a in [a, b].map(inner) {
                        let alone = uses[a.index()] == 1;
                        let (n, k) = match self.op(a) {
                            _ if alone && is_sum(a) => (terms[a.index()], products[a.index()]),
                            Op::Binary(Binary::Mul, ..) if alone => (1, 1),
                            _ => (1, 0),
                        };
                        terms[i] += n;
                        products[i] += k;
                        within[a.index()] |= alone;
                    }
                }
                Op::SinCos(a) => {
                    counts.sin_cos += 1;
                    counts.tail += usize::from(matches!(self.op(a), Op::AngleSum(..)));
                }
                Op::AngleSum(..) => {
                    counts.add += 1;
                    counts.tail += TAIL;
                }
                _ => {}
            }
        }
        let roots = (0..self.ops.len()).filter(|i| live[*i] && terms[*i] > 0 && !within[*i]);
        let fused: usize = roots.map(|i| products[i].min(terms[i] - 1)).sum();
        counts.fma = counts.mul + counts.add - fused;
        counts
    }
}
