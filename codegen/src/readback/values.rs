//! Values by what they are made of: two values have the same number if and only if the same operations on the same inputs make them.
//!
//! Signs stand beside the numbers, as a change of sign is exact: (−a)·b is −(a·b), a − b is a + (−b), bit for bit, and so may factors and
//! terms of one operation change places. Nothing else is taken as equal: (a + b) + c is not a + (b + c).

use rustc_hash::FxHashMap;
use straightline_graph::expr::{Binary, Graph, NodeId, Op, Sines, Unary};
use straightline_graph::Scalar;

/// In which format a value is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TextFormat {
    /// Double precision.
    F64,
    /// Single precision.
    F32,
    /// That of the caller.
    Any,
}

impl From<Scalar> for TextFormat {
    fn from(scalar: Scalar) -> TextFormat {
        match scalar {
            Scalar::F64 => TextFormat::F64,
            Scalar::F32 => TextFormat::F32,
        }
    }
}

/// A value and its sign.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct TextValue(u32);

impl TextValue {
    /// No value.
    pub const NONE: TextValue = TextValue(u32::MAX);

    fn new(number: u32, negative: bool) -> TextValue {
        TextValue(number << 1 | u32::from(negative))
    }

    fn number(self) -> u32 {
        self.0 >> 1
    }

    fn is_negative(self) -> bool {
        self.0 & 1 == 1
    }

    /// With the other sign.
    pub fn negated(self) -> TextValue {
        TextValue(self.0 ^ 1)
    }
}

#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
enum ValueKind {
    Input,
    Constant,
    Long,
    Add,
    Mul,
    Div,
    Sqrt,
    Sign,
    Angle,
    Sin,
    Cos,
    Widened,
    Rounded,
}

#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
struct Key {
    what: ValueKind,
    format: u8,
    a: u32,
    b: u32,
}

/// All values that are known.
#[derive(Clone, Debug, Default)]
pub struct Values {
    known: FxHashMap<Key, u32>,
    formats: Vec<TextFormat>,
    /// How many of them the programs have: others are the text's alone.
    wanted: usize,
}

impl Values {
    fn get(&mut self, what: ValueKind, format: TextFormat, a: u32, b: u32) -> u32 {
        let key = Key { what, format: format as u8, a, b };
        let next = self.formats.len() as u32;
        let number = *self.known.entry(key).or_insert(next);
        if number == next {
            self.formats.push(format);
        }
        number
    }

    /// From here on values are the text's.
    pub fn close(&mut self) {
        self.wanted = self.formats.len();
    }

    /// Whether some program computes this.
    pub fn is_wanted(&self, value: TextValue) -> bool {
        (value.number() as usize) < self.wanted
    }

    /// Forgets what was not there when [`Values::close`] was called.
    pub fn forget(&mut self) {
        let wanted = self.wanted as u32;
        if self.formats.len() > self.wanted {
            self.known.retain(|_, number| *number < wanted);
            self.formats.truncate(self.wanted);
        }
    }

    /// The format of a value.
    pub fn format(&self, value: TextValue) -> TextFormat {
        self.formats[value.number() as usize]
    }

    /// Scalar `index` of the input of that name.
    pub fn input(&mut self, name: u32, index: usize, format: TextFormat) -> TextValue {
        TextValue::new(self.get(ValueKind::Input, format, name, index as u32), false)
    }

    /// A number.
    pub fn constant(&mut self, x: f64, format: TextFormat) -> TextValue {
        let bits = x.abs().to_bits();
        TextValue::new(self.get(ValueKind::Constant, format, (bits >> 32) as u32, bits as u32), x.is_sign_negative())
    }

    /// A number in two parts, of a caller's format.
    pub fn long(&mut self, high: f64, low: f64) -> TextValue {
        let negative = high < 0.0;
        let [high, low] = if negative { [-high, -low] } else { [high, low] };
        let [a, b] = [high + 0.0, low + 0.0].map(|x| self.constant(x, TextFormat::F64).0);
        TextValue::new(self.get(ValueKind::Long, TextFormat::Any, a, b), negative)
    }

    /// a + b.
    pub fn add(&mut self, a: TextValue, b: TextValue) -> TextValue {
        let format = self.format(a);
        TextValue::new(self.get(ValueKind::Add, format, a.min(b).0, a.max(b).0), false)
    }

    fn product(&mut self, what: ValueKind, a: TextValue, b: TextValue) -> TextValue {
        let format = self.format(a);
        TextValue::new(self.get(what, format, a.number(), b.number()), a.is_negative() != b.is_negative())
    }

    /// a · b.
    pub fn mul(&mut self, a: TextValue, b: TextValue) -> TextValue {
        let [first, second] = if a.number() <= b.number() { [a, b] } else { [b, a] };
        self.product(ValueKind::Mul, first, second)
    }

    /// a / b.
    pub fn div(&mut self, a: TextValue, b: TextValue) -> TextValue {
        self.product(ValueKind::Div, a, b)
    }

    /// √a.
    pub fn sqrt(&mut self, a: TextValue) -> TextValue {
        let format = self.format(a);
        TextValue::new(self.get(ValueKind::Sqrt, format, a.0, 0), false)
    }

    /// −1, 0 or 1.
    pub fn sign(&mut self, a: TextValue) -> TextValue {
        let format = self.format(a);
        TextValue::new(self.get(ValueKind::Sign, format, a.0, 0), false)
    }

    /// An angle, the sum of these in this order: what sine and cosine take.
    pub fn angle(&mut self, terms: impl IntoIterator<Item = TextValue>) -> TextValue {
        let mut angle = TextValue::NONE;
        for term in terms {
            let format = self.format(term);
            angle = TextValue::new(self.get(ValueKind::Angle, format, angle.0, term.0), false);
        }
        angle
    }

    /// Sine and cosine of an angle, by this kernel.
    pub fn sin_cos(&mut self, angle: TextValue, sines: Sines) -> (TextValue, TextValue) {
        let format = self.format(angle);
        let mut of = |what| TextValue::new(self.get(what, format, angle.0, sines as u32), false);
        (of(ValueKind::Sin), of(ValueKind::Cos))
    }

    /// In f64 what was in f32.
    pub fn widened(&mut self, a: TextValue) -> TextValue {
        TextValue::new(self.get(ValueKind::Widened, TextFormat::F64, a.number(), 0), a.is_negative())
    }

    /// In f32 what was in f64.
    pub fn rounded(&mut self, a: TextValue) -> TextValue {
        TextValue::new(self.get(ValueKind::Rounded, TextFormat::F32, a.number(), 0), a.is_negative())
    }

    /// The results of a graph for these inputs.
    pub fn results(&mut self, graph: &Graph, inputs: &[TextValue], format: TextFormat) -> Vec<TextValue> {
        let mut values: Vec<TextValue> = Vec::with_capacity(graph.ops.len());
        for (i, op) in graph.ops.iter().enumerate() {
            let precision = graph.formats.get(i);
            let computed = precision.map_or(format, |p| TextFormat::from(p.computed));
            let held = precision.map_or(format, |p| TextFormat::from(p.held));
            // an operand in the format in which the operation is computed
            let operand = |id: NodeId, known: &mut Values| {
                let value = values[id.index()];
                match (known.format(value), computed) {
                    (TextFormat::F32, TextFormat::F64) => known.widened(value),
                    _ => value,
                }
            };
            let value = match *op {
                Op::Input(k) => inputs[k as usize],
                Op::Constant(c) => match held {
                    TextFormat::F64 => self.constant(c.value().to_f64(), TextFormat::F64),
                    TextFormat::F32 => self.constant(f64::from(c.value().to_f32()), TextFormat::F32),
                    TextFormat::Any => self.long(c.value().hi(), c.value().lo()),
                },
                Op::Unary(op, a) => {
                    let a = operand(a, self);
                    match op {
                        Unary::Neg => a.negated(),
                        Unary::Sqrt => self.sqrt(a),
                        Unary::Sign => self.sign(a),
                    }
                }
                Op::Binary(op, a, b) => {
                    let (a, b) = (operand(a, self), operand(b, self));
                    match op {
                        Binary::Add => self.add(a, b),
                        Binary::Sub => self.add(a, b.negated()),
                        Binary::Mul => self.mul(a, b),
                        Binary::Div => self.div(a, b),
                    }
                }
                // formed where its sine is
                Op::AngleSum(..) => TextValue::NONE,
                Op::SinCos(a) => self.angle(graph.angle_terms(a).into_iter().map(|term| values[term.index()])),
                Op::Sin(a) => self.sin_cos(values[a.index()], graph.sines).0,
                Op::Cos(a) => self.sin_cos(values[a.index()], graph.sines).1,
            };
            let is_operation = !matches!(op, Op::Input(_) | Op::Constant(_));
            values.push(if computed != held && is_operation { self.rounded(value) } else { value });
        }
        graph.results.iter().map(|r| values[r.index()]).collect()
    }
}
