//! The measured program: generated code as users get it, and the same operations over other scalars, in one binary.
//!
//! It is compiled for the processor that it runs on. Called with `serve` it answers with results, so that errors are those of
//! the code that is timed; called with `time` it prints nanoseconds per evaluation.

use std::fmt::Write;
use straightline_codegen::expr::{Binary, Graph, Op};

/// A function's text in a module, and how it is called.
pub struct Generated {
    /// Name of the module.
    pub module: &'static str,
    /// Name of the function.
    pub function: String,
    /// The text that the compiler wrote.
    pub text: String,
    /// `f64` or `f32`.
    pub scalar: &'static str,
    /// Lengths of the inputs that it takes, and where each begins in the whole input.
    pub inputs: Vec<(usize, usize)>,
    /// Number of results, by their shape.
    pub output: Vec<usize>,
    /// What its function over lanes is called in the binary, if it has one.
    pub lanes: Option<&'static str>,
}

/// A way to compute: its name in the binary, its width in states per call, and the expression that calls it on `x` and `y`.
pub struct Call {
    pub name: String,
    pub lanes: usize,
    code: String,
}

/// The operations of a graph over any scalar, products contracted into sums where the scalar likes that.
fn generic(graph: &Graph) -> String {
    let mut uses = vec![0usize; graph.ops.len()];
    for op in &graph.ops {
        op.operands().for_each(|o| uses[o.index()] += 1);
    }
    graph.results.iter().for_each(|r| uses[r.index()] += 1);
    let inputs: usize = graph.inputs.iter().map(|p| p.len()).sum();
    let mut text =
        format!("#[inline(always)]\nfn generic<S: Scalar>(x: &[S; {inputs}]) -> [S; {}] {{\n", graph.results.len());
    // a product that one sum alone needs
    let product = |id: straightline_codegen::expr::NodeId| match graph.ops[id.index()] {
        Op::Binary(Binary::Mul, a, b) if uses[id.index()] == 1 => Some((a.index(), b.index())),
        _ => None,
    };
    let mut contracted = vec![false; graph.ops.len()];
    for op in &graph.ops {
        if let Op::Binary(Binary::Add | Binary::Sub, a, b) = *op {
            let inside = if product(b).is_some() { b } else { a };
            if product(inside).is_some() {
                contracted[inside.index()] = true;
            }
        }
    }
    for (i, op) in graph.ops.iter().enumerate().filter(|(i, _)| !contracted[*i]) {
        let v = |id: straightline_codegen::expr::NodeId| format!("t{}", id.index());
        let of = |id: straightline_codegen::expr::NodeId| product(id).filter(|_| contracted[id.index()]);
        let value = match *op {
            Op::Input(k) => format!("x[{k}]"),
            Op::Constant(c) => format!("S::constant({:?}, {:?})", c.value().hi(), c.value().lo()),
            Op::Binary(Binary::Add, a, b) => match (of(a), of(b)) {
                (_, Some((m, n))) => format!("S::product_plus(t{m}, t{n}, {})", v(a)),
                (Some((m, n)), _) => format!("S::product_plus(t{m}, t{n}, {})", v(b)),
                _ => format!("{}.add({})", v(a), v(b)),
            },
            Op::Binary(Binary::Sub, a, b) => match (of(a), of(b)) {
                (_, Some((m, n))) => format!("S::product_plus(t{m}.neg(), t{n}, {})", v(a)),
                (Some((m, n)), _) => format!("S::product_plus(t{m}, t{n}, {}.neg())", v(b)),
                _ => format!("{}.sub({})", v(a), v(b)),
            },
            Op::Unary(op, a) => format!("{}.{}()", v(a), op.row().name),
            Op::Binary(op, a, b) => format!("{}.{}({})", v(a), op.row().name, v(b)),
            // rounded here, unlike in generated code: half an ulp of the angle, which near the joints' limits is little
            Op::AngleSum(a, b) => format!("{}.add({})", v(a), v(b)),
            Op::SinCos(a) => format!("{}.sin_cos()", v(a)),
            Op::Sin(a) => format!("{}.0", v(a)),
            Op::Cos(a) => format!("{}.1", v(a)),
        };
        let _ = writeln!(text, "    let t{i} = {value};");
    }
    let results: Vec<String> = graph.results.iter().map(|r| format!("t{}", r.index())).collect();
    let _ = writeln!(text, "    [{}]\n}}", results.join(", "));
    text
}

/// The scalars of the generic form.
const SCALARS: &str = r#"
trait Scalar: Copy {
    fn constant(hi: f64, lo: f64) -> Self;
    fn input(x: f64) -> Self;
    fn output(self) -> f64;
    fn neg(self) -> Self;
    fn add(self, b: Self) -> Self;
    fn sub(self, b: Self) -> Self { self.add(b.neg()) }
    fn mul(self, b: Self) -> Self;
    fn div(self, b: Self) -> Self;
    fn sqrt(self) -> Self;
    fn sign(self) -> Self;
    fn sin_cos(self) -> (Self, Self);
    fn product_plus(a: Self, b: Self, c: Self) -> Self { a.mul(b).add(c) }
}
/// The plain one, to see that the form costs nothing.
#[derive(Clone, Copy)]
struct F64(f64);
impl Scalar for F64 {
    #[inline(always)] fn constant(hi: f64, lo: f64) -> Self { F64(hi + lo) }
    #[inline(always)] fn input(x: f64) -> Self { F64(x) }
    #[inline(always)] fn output(self) -> f64 { self.0 }
    #[inline(always)] fn neg(self) -> Self { F64(-self.0) }
    #[inline(always)] fn add(self, b: Self) -> Self { F64(self.0 + b.0) }
    #[inline(always)] fn sub(self, b: Self) -> Self { F64(self.0 - b.0) }
    #[inline(always)] fn mul(self, b: Self) -> Self { F64(self.0 * b.0) }
    #[inline(always)] fn div(self, b: Self) -> Self { F64(self.0 / b.0) }
    #[inline(always)] fn sqrt(self) -> Self { F64(trig::sqrt_f64(self.0)) }
    #[inline(always)] fn sign(self) -> Self { F64(trig::sign_f64(self.0)) }
    #[inline(always)] fn sin_cos(self) -> (Self, Self) { let (s, c) = trig::sin_cos_f64(self.0); (F64(s), F64(c)) }
}

/// An f32 and what sums and products have rounded away, to first order (compensated evaluation).
#[derive(Clone, Copy)]
struct Compensated { v: f32, e: f32 }
impl Scalar for Compensated {
    #[inline(always)] fn constant(hi: f64, lo: f64) -> Self { let v = (hi + lo) as f32; Compensated { v, e: (hi - v as f64 + lo) as f32 } }
    #[inline(always)] fn input(x: f64) -> Self { Compensated { v: x as f32, e: 0.0 } }
    #[inline(always)] fn output(self) -> f64 { (self.v + self.e) as f64 }
    #[inline(always)] fn neg(self) -> Self { Compensated { v: -self.v, e: -self.e } }
    #[inline(always)] fn add(self, b: Self) -> Self {
        let v = self.v + b.v;
        let z = v - self.v;
        Compensated { v, e: ((self.v - (v - z)) + (b.v - z)) + (self.e + b.e) }
    }
    #[inline(always)] fn mul(self, b: Self) -> Self {
        let v = self.v * b.v;
        Compensated { v, e: self.v.mul_add(b.v, -v) + (self.v * b.e + self.e * b.v) }
    }
    #[inline(always)] fn div(self, b: Self) -> Self {
        let v = self.v / b.v;
        Compensated { v, e: (self.e - v.mul_add(b.v, -self.v) - v * b.e) / b.v }
    }
    #[inline(always)] fn sqrt(self) -> Self {
        let v = trig::sqrt_f32(self.v);
        Compensated { v, e: (self.e - v.mul_add(v, -self.v)) / (v + v) }
    }
    #[inline(always)] fn sign(self) -> Self { Compensated { v: trig::sign_f32(self.v), e: 0.0 } }
    #[inline(always)] fn sin_cos(self) -> (Self, Self) {
        let (s, c) = trig::sin_cos_f32(self.v);
        (Compensated { v: s, e: c * self.e }, Compensated { v: c, e: -s * self.e })
    }
}

/// Sums in f64 of products of f32 numbers, which are exact in f64.
#[derive(Clone, Copy)]
struct Mixed(f64);
impl Scalar for Mixed {
    #[inline(always)] fn constant(hi: f64, lo: f64) -> Self { Mixed(hi + lo) }
    #[inline(always)] fn input(x: f64) -> Self { Mixed(x) }
    #[inline(always)] fn output(self) -> f64 { self.0 }
    #[inline(always)] fn neg(self) -> Self { Mixed(-self.0) }
    #[inline(always)] fn add(self, b: Self) -> Self { Mixed(self.0 + b.0) }
    #[inline(always)] fn sub(self, b: Self) -> Self { Mixed(self.0 - b.0) }
    #[inline(always)] fn mul(self, b: Self) -> Self { Mixed((self.0 as f32 as f64) * (b.0 as f32 as f64)) }
    #[inline(always)] fn div(self, b: Self) -> Self { Mixed((self.0 as f32 / b.0 as f32) as f64) }
    #[inline(always)] fn sqrt(self) -> Self { Mixed(trig::sqrt_f32(self.0 as f32) as f64) }
    #[inline(always)] fn sign(self) -> Self { Mixed(trig::sign_f64(self.0)) }
    #[inline(always)] fn sin_cos(self) -> (Self, Self) {
        let (s, c) = trig::sin_cos_f32(self.0 as f32);
        (Mixed(s as f64), Mixed(c as f64))
    }
}
"#;

/// What the binary does with its calls. `SIZES` and `CALLS` come before it.
const MAIN: &str = r#"
use std::hint::black_box;
use std::io::{Read, Write};
use std::time::Instant;

/// States that a warm run goes through, again and again.
const STATES: usize = 512;
const ROUNDS: usize = 8;

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    match arguments[1].as_str() {
        "serve" => serve(),
        _ => time(&arguments[2]),
    }
}

/// Requests: the index of a call and its input; answers: results. Lanes answer with their last state's.
fn serve() {
    let (mut input, mut output) = (std::io::stdin().lock(), std::io::stdout().lock());
    let mut request = vec![0u8; 8 * (1 + IN)];
    while input.read_exact(&mut request).is_ok() {
        let numbers: Vec<f64> = request.chunks(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect();
        let (_, lanes, call) = CALLS[numbers[0] as usize];
        let x: Vec<[f64; IN]> = vec![numbers[1..].try_into().unwrap(); lanes];
        let mut y = vec![[0.0; OUT]; lanes];
        call(&Inputs::new(&x), 0, &mut y);
        let bytes: Vec<u8> = y[lanes - 1].iter().flat_map(|v| v.to_le_bytes()).collect();
        output.write_all(&bytes).unwrap();
        output.flush().unwrap();
    }
}

/// States from a file of numbers, in all the forms that calls take, made before the clock runs.
struct Inputs { rows: Vec<[f64; IN]>, singles: Vec<[f32; IN]>, lanes8: Vec<[[f64; 8]; IN]>, lanes16: Vec<[[f32; 16]; IN]> }
impl Inputs {
    fn new(rows: &[[f64; IN]]) -> Inputs {
        Inputs {
            rows: rows.to_vec(),
            singles: rows.iter().map(|r| r.map(|x| x as f32)).collect(),
            lanes8: rows.chunks_exact(8).map(|c| std::array::from_fn(|i| std::array::from_fn(|l| c[l][i]))).collect(),
            lanes16: rows.chunks_exact(16).map(|c| std::array::from_fn(|i| std::array::from_fn(|l| c[l][i] as f32))).collect(),
        }
    }
}

/// Warm: nanoseconds per state, best and median of the runs; cold: with 8 MB of memory and a lot of other code in between.
fn time(states: &str) {
    let bytes = std::fs::read(states).unwrap();
    let numbers: Vec<f64> = bytes.chunks(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect();
    let rows: Vec<[f64; IN]> = numbers.chunks_exact(IN).take(STATES).map(|c| c.try_into().unwrap()).collect();
    let inputs = Inputs::new(&rows);
    let mut rubbish = vec![1u64; 1 << 20];
    // the clock's own time is the least of what it shows for nothing
    let clock = (0..1000).map(|_| { let start = Instant::now(); start.elapsed().as_nanos() as f64 }).fold(1e9, f64::min);
    let mut figures: Vec<[Vec<f64>; 2]> = vec![Default::default(); CALLS.len()];
    // round after round, so that a disturbance of the machine meets all alike
    for round in 0..ROUNDS {
        for ((name, lanes, call), [warm, cold]) in CALLS.iter().zip(&mut figures) {
            let mut y = vec![[0.0; OUT]; *lanes];
            let calls = STATES / lanes;
            let mut once = || { for k in 0..calls { call(black_box(&inputs), k, &mut y); black_box(&y); } };
            once();
            let start = Instant::now();
            once();
            let repeats = (1e6 / start.elapsed().as_nanos() as f64).ceil() as usize;
            for _ in 0..3 {
                let start = Instant::now();
                (0..repeats).for_each(|_| once());
                warm.push(start.elapsed().as_nanos() as f64 / (repeats * calls * lanes) as f64);
            }
            for k in 0..6 {
                for (i, x) in rubbish.iter_mut().enumerate().step_by(4) { *x = x.wrapping_mul(3).wrapping_add(i as u64); }
                black_box(&mut rubbish);
                other::run(k + round);
                let start = Instant::now();
                call(black_box(&inputs), k % calls, &mut y);
                black_box(&y);
                cold.push((start.elapsed().as_nanos() as f64 - clock) / *lanes as f64);
            }
        }
    }
    for ((name, ..), [warm, cold]) in CALLS.iter().zip(&mut figures) {
        warm.sort_by(f64::total_cmp);
        cold.sort_by(f64::total_cmp);
        println!("{name}\t{}\t{}\t{}", warm[0], warm[warm.len() / 2], cold[cold.len() / 2]);
    }
}
"#;

/// The function over as many lanes as a register of 64 bytes has.
fn over_lanes(g: &Generated, name: &str) -> Call {
    let n = if g.scalar == "f32" { 16 } else { 8 };
    let argument = |(first, len): &(usize, usize)| {
        format!("inputs.lanes{n}[k][{first}..{}].first_chunk::<{len}>().unwrap()", first + len)
    };
    let arguments: Vec<String> = g.inputs.iter().map(argument).collect();
    let zero = g.output.iter().rev().fold(format!("[0.0; {n}]"), |inner, n| format!("[{inner}; {n}]"));
    let flat = if g.output.len() == 2 { "out.as_flattened()" } else { "&out[..]" };
    // only the last state's results are copied: a user's batch stays in lanes
    let code = format!(
        "let mut out = {zero}; {}::{}_lanes::<{n}>({}, &mut out); black_box(&mut out); \
         for (y, v) in y[{n} - 1].iter_mut().zip({flat}) {{ *y = v[{n} - 1] as f64; }}",
        g.module,
        g.function,
        arguments.join(", ")
    );
    Call { name: name.to_string(), lanes: n, code }
}

/// The source of the binary, and its calls in order.
pub fn source(generated: &[Generated], graph: &Graph, total_in: usize) -> (String, Vec<Call>) {
    let total_out = graph.results.len();
    let mut text = String::from("#![allow(warnings)]\n");
    let mut calls = Vec::new();
    for g in generated {
        let _ = writeln!(text, "mod {} {{\n{}\n}}", g.module, g.text.replace("\nmod trig {", "\npub mod trig {"));
        let rows = if g.scalar == "f32" { "inputs.singles" } else { "inputs.rows" };
        let arguments: Vec<String> = g
            .inputs
            .iter()
            .map(|(first, len)| format!("{rows}[k][{first}..{}].first_chunk::<{len}>().unwrap()", first + len))
            .collect();
        let zero = g.output.iter().rev().fold("0.0".to_string(), |inner, n| format!("[{inner}; {n}]"));
        let flat = if g.output.len() == 2 { "out.as_flattened()" } else { "&out[..]" };
        calls.push(Call {
            name: g.module.to_string(),
            lanes: 1,
            code: format!(
                "let mut out = {zero}; {}::{}({}, &mut out); for (y, v) in y[0].iter_mut().zip({flat}) {{ *y = *v as f64; }}",
                g.module,
                g.function,
                arguments.join(", ")
            ),
        });
        calls.extend(g.lanes.map(|name| over_lanes(g, name)));
    }
    text += "use double::trig;\n";
    text += SCALARS;
    text += &generic(graph);
    for (name, scalar) in [("generic_f64", "F64"), ("compensated_f32", "Compensated"), ("mixed", "Mixed")] {
        let code = format!(
            "let x: [{scalar}; IN] = inputs.rows[k].map({scalar}::input); y[0] = generic(&x).map({scalar}::output);"
        );
        calls.push(Call { name: name.to_string(), lanes: 1, code });
    }
    let _ = writeln!(text, "const IN: usize = {total_in};\nconst OUT: usize = {total_out};");
    let entries: Vec<String> =
        calls.iter().map(|c| format!("    ({:?}, {}, |inputs, k, y| {{ {} }}),", c.name, c.lanes, c.code)).collect();
    let _ = writeln!(
        text,
        "static CALLS: &[(&str, usize, fn(&Inputs, usize, &mut [[f64; OUT]]))] = &[\n{}\n];",
        entries.join("\n")
    );
    text += MAIN;
    (text, calls)
}
