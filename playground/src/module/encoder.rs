//! The bytes of WebAssembly that are needed here (WebAssembly Core Specification 2.0, chapter 5): functions over f64 without branches.

/// An instruction without operands of its own, by its byte.
#[derive(Clone, Copy)]
pub enum Simple {
    Call0 = 0x10,
    Select = 0x1b,
    I32Sub = 0x6b,
    F64Less = 0x63,
    F64Greater = 0x64,
    F64Differs = 0x62,
    I64Add = 0x7c,
    I64Sub = 0x7d,
    I64And = 0x83,
    I64Or = 0x84,
    I64Xor = 0x85,
    I64ShiftLeft = 0x86,
    I64ShiftRightSigned = 0x87,
    Negate = 0x9a,
    Root = 0x9f,
    Add = 0xa0,
    Subtract = 0xa1,
    Multiply = 0xa2,
    Divide = 0xa3,
    OfI32 = 0xb7,
    BitsOf = 0xbd,
    OfBits = 0xbf,
}

/// Types of values, by their bytes.
pub const F64: u8 = 0x7c;
const I64: u8 = 0x7e;

/// The body of a function, as it grows.
#[derive(Default)]
pub struct FunctionBody {
    code: Vec<u8>,
    parameters: u32,
    /// Locals of f64, and behind them those of i64.
    numbers: u32,
    words: u32,
}

impl FunctionBody {
    /// Of a function of so many parameters, with so many locals of f64 and of i64; numbers are counted from the parameters on.
    pub fn new(parameters: u32, numbers: u32, words: u32) -> FunctionBody {
        FunctionBody { parameters, numbers, words, ..FunctionBody::default() }
    }

    /// The index of the local of i64 of that number.
    pub fn word(&self, k: u32) -> u32 {
        self.parameters + self.numbers + k
    }

    pub fn get(&mut self, local: u32) -> &mut Self {
        self.indexed(0x20, local)
    }

    pub fn set(&mut self, local: u32) -> &mut Self {
        self.indexed(0x21, local)
    }

    /// The number as a constant.
    pub fn number(&mut self, x: f64) -> &mut Self {
        self.code.push(0x44);
        self.code.extend(x.to_le_bytes());
        self
    }

    /// A word of 64 bits as a constant.
    pub fn bits(&mut self, x: i64) -> &mut Self {
        self.code.push(0x42);
        signed(&mut self.code, x);
        self
    }

    pub fn op(&mut self, op: Simple) -> &mut Self {
        self.code.push(op as u8);
        if let Simple::Call0 = op {
            self.code.push(0);
        }
        self
    }

    /// The number at that place of the memory, counted in numbers.
    pub fn load(&mut self, place: u32) -> &mut Self {
        self.code.extend([0x41, 0x00, 0x2b, 0x03]);
        unsigned(&mut self.code, place * 8);
        self
    }

    /// Puts what `value` leaves at that place of the memory.
    pub fn store(&mut self, place: u32, value: impl FnOnce(&mut Self)) -> &mut Self {
        self.code.extend([0x41, 0x00]);
        value(self);
        self.code.extend([0x39, 0x03]);
        unsigned(&mut self.code, place * 8);
        self
    }

    fn indexed(&mut self, op: u8, index: u32) -> &mut Self {
        self.code.push(op);
        unsigned(&mut self.code, index);
        self
    }

    fn bytes(&self) -> Vec<u8> {
        let mut body = Vec::new();
        let locals = [(self.numbers, F64), (self.words, I64)];
        let locals: Vec<_> = locals.iter().filter(|(count, _)| *count > 0).collect();
        unsigned(&mut body, locals.len() as u32);
        for (count, kind) in locals {
            unsigned(&mut body, *count);
            body.push(*kind);
        }
        body.extend(&self.code);
        body.push(0x0b);
        body
    }
}

/// LEB128.
fn unsigned(out: &mut Vec<u8>, mut x: u32) {
    while x >= 0x80 {
        out.push(x as u8 | 0x80);
        x >>= 7;
    }
    out.push(x as u8);
}

fn signed(out: &mut Vec<u8>, mut x: i64) {
    loop {
        let byte = x as u8 & 0x7f;
        x >>= 7;
        if (x == 0 && byte & 0x40 == 0) || (x == -1 && byte & 0x40 != 0) {
            return out.push(byte);
        }
        out.push(byte | 0x80);
    }
}

fn section(out: &mut Vec<u8>, kind: u8, items: &[Vec<u8>]) {
    let mut content = Vec::new();
    unsigned(&mut content, items.len() as u32);
    content.extend(items.concat());
    out.push(kind);
    unsigned(out, content.len() as u32);
    out.extend(content);
}

fn name(text: &str) -> Vec<u8> {
    let mut out = Vec::new();
    unsigned(&mut out, text.len() as u32);
    out.extend(text.bytes());
    out
}

/// The type of the first function: two numbers in, two out.
const PAIR_TO_PAIR: [u8; 7] = [0x60, 2, F64, F64, 2, F64, F64];
/// The type of the others: they read and write the memory.
const NOTHING_TO_NOTHING: [u8; 3] = [0x60, 0, 0];

/// A module of a function of two numbers with two results, and of functions over the memory, which are exported by their names beside it; the
/// memory holds so many numbers.
pub fn module(first: &FunctionBody, functions: &[(&str, FunctionBody)], numbers: usize) -> Vec<u8> {
    let mut out = b"\0asm\x01\0\0\0".to_vec();
    section(&mut out, 1, &[PAIR_TO_PAIR.to_vec(), NOTHING_TO_NOTHING.to_vec()]);
    let types: Vec<Vec<u8>> = std::iter::once(vec![0]).chain(functions.iter().map(|_| vec![1])).collect();
    section(&mut out, 3, &types);
    let mut memory = vec![0x00];
    unsigned(&mut memory, (numbers * 8).div_ceil(1 << 16).max(1) as u32);
    section(&mut out, 5, &[memory]);
    let exported = |text: &str, kind: u8, index: usize| {
        let mut export = name(text);
        export.push(kind);
        unsigned(&mut export, index as u32);
        export
    };
    let mut exports = vec![exported("memory", 2, 0)];
    exports.extend(functions.iter().enumerate().map(|(k, (text, _))| exported(text, 0, k + 1)));
    section(&mut out, 7, &exports);
    let bodies: Vec<Vec<u8>> = std::iter::once(first)
        .chain(functions.iter().map(|(_, body)| body))
        .map(|body| {
            let body = body.bytes();
            let mut sized = Vec::new();
            unsigned(&mut sized, body.len() as u32);
            sized.extend(body);
            sized
        })
        .collect();
    section(&mut out, 10, &bodies);
    out
}
