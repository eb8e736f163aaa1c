//! A machine for PTX: threads of an entry, one after the other, in Rust's arithmetic. It knows the instructions of generated texts, and nothing of how these are
//! made.

use std::collections::{BTreeMap, HashMap};

/// Where arrays are: the first one here, the others as far apart.
const ARRAYS: u64 = 1 << 40;

/// An entry of a text.
pub struct Entry<'t> {
    /// The names of its parameters, in order.
    pub parameters: Vec<&'t str>,
    body: Vec<&'t str>,
}

impl<'t> Entry<'t> {
    pub fn of(text: &'t str, name: &str) -> Entry<'t> {
        let lines: Vec<&str> = text.lines().map(str::trim).filter(|line| !line.starts_with("//")).collect();
        let head =
            lines.iter().position(|line| *line == format!(".visible .entry {name}(")).expect("the entry is there");
        let open = lines[head..].iter().position(|line| *line == ")").expect("its parameters end") + head;
        let name = |line: &&'t str| line.rsplit(' ').next().expect("a name").trim_end_matches(',');
        let parameters = lines[head + 1..open].iter().map(name).collect();
        let body = &lines[open + 2..];
        let end = body.iter().position(|line| *line == "ret;").expect("it returns");
        Entry { parameters, body: body[..end].to_vec() }
    }

    /// So many threads in blocks of 32 over arrays, each of numbers of so many bytes: what is in them behind.
    pub fn launch(&self, n: u32, threads: u32, bytes: usize, arrays: &mut [Vec<u64>]) {
        for thread in 0..threads {
            let mut machine = Thread { registers: HashMap::new(), arrays, bytes: bytes as u64 };
            let parameters: BTreeMap<&str, u64> = (self.parameters.iter().copied())
                .zip([u64::from(n)].into_iter().chain((1..).map(|k| k * ARRAYS)))
                .collect();
            let special = [("%ctaid.x", thread / 32), ("%ntid.x", 32), ("%tid.x", thread % 32)];
            machine.registers.extend(special.map(|(name, x)| (name, u64::from(x))));
            for line in &self.body {
                if !machine.step(line, &parameters) {
                    break;
                }
            }
        }
    }
}

struct Thread<'a, 't> {
    registers: HashMap<&'t str, u64>,
    arrays: &'a mut [Vec<u64>],
    bytes: u64,
}

impl<'t> Thread<'_, 't> {
    /// The bits of an operand.
    fn get(&self, operand: &str) -> u64 {
        let hex = |digits| u64::from_str_radix(digits, 16).expect("hexadecimal digits");
        if let Some(digits) = ["0d", "0f", "0x"].iter().find_map(|prefix| operand.strip_prefix(prefix)) {
            return hex(digits);
        }
        match self.registers.get(operand) {
            Some(bits) => *bits,
            None => operand.parse().unwrap_or_else(|_| panic!("`{operand}` holds nothing")),
        }
    }

    fn cell(&mut self, address: &str) -> &mut u64 {
        let inner = address.trim_start_matches('[').trim_end_matches(']');
        let (register, offset) = inner.split_once('+').unwrap_or((inner, "0"));
        let address = self.get(register) + offset.parse::<u64>().expect("an offset");
        let (array, place) = (address / ARRAYS - 1, address % ARRAYS);
        assert!(place.is_multiple_of(self.bytes), "an address between numbers");
        &mut self.arrays[array as usize][(place / self.bytes) as usize]
    }

    /// Whether the thread goes on.
    fn step(&mut self, line: &'t str, parameters: &BTreeMap<&str, u64>) -> bool {
        if line.starts_with(['{', '}']) || line.starts_with(".reg") {
            return true;
        }
        if line == "@%is_beyond ret;" {
            return self.get("%is_beyond") == 0;
        }
        let (operation, operands) = line.trim_end_matches(';').split_once(' ').expect("an instruction");
        let operands: Vec<&'t str> = operands.split(", ").collect();
        let parts: Vec<&str> = operation.split('.').collect();
        if operation.starts_with("st.global") {
            let value = self.get(operands[1]);
            *self.cell(operands[0]) = value;
            return true;
        }
        let value = match (parts[0], *parts.last().expect("a name")) {
            ("ld", _) if parts[1] == "param" => parameters[operands[1].trim_matches(['[', ']'])],
            ("ld", _) => *self.cell(operands[1]),
            ("mov" | "cvta", _) => self.get(operands[1]),
            ("cvt", "f32") => f64::from(f32::from_bits(self.get(operands[1]) as u32)).to_bits(),
            ("cvt", _) => u64::from((f64::from_bits(self.get(operands[1])) as f32).to_bits()),
            (name, "f64") => {
                let x: Vec<f64> = self.numbers(&operands).map(f64::from_bits).collect();
                match name {
                    "setp" => u64::from(compared(parts[1], x[0].partial_cmp(&x[1]))),
                    "selp" => self.selected(&operands),
                    name => arithmetic(name, &x, f64::mul_add, f64::sqrt, f64::abs).to_bits(),
                }
            }
            (name, "f32") => {
                let x: Vec<f32> = self.numbers(&operands).map(|bits| f32::from_bits(bits as u32)).collect();
                match name {
                    "setp" => u64::from(compared(parts[1], x[0].partial_cmp(&x[1]))),
                    "selp" => self.selected(&operands),
                    name => u64::from(arithmetic(name, &x, f32::mul_add, f32::sqrt, f32::abs).to_bits()),
                }
            }
            (name, kind) => {
                let x: Vec<u64> = self.numbers(&operands).collect();
                let bits = kind[1..].parse::<u32>().expect("a width");
                let narrow = |x: u64| if bits == 32 { u64::from(x as u32) } else { x };
                match (name, parts[1]) {
                    ("mad" | "mul", "wide") => x[0] * x[1] + x.get(2).copied().unwrap_or(0),
                    ("mad", "lo") => narrow(x[0].wrapping_mul(x[1]).wrapping_add(x[2])),
                    ("setp", how) => u64::from(compared(how, narrow(x[0]).partial_cmp(&narrow(x[1])))),
                    ("selp", _) => self.selected(&operands),
                    ("add", _) => narrow(x[0].wrapping_add(x[1])),
                    ("neg", _) => narrow(x[0].wrapping_neg()),
                    ("and", _) => x[0] & x[1],
                    ("or", _) => x[0] | x[1],
                    ("xor", _) => x[0] ^ x[1],
                    ("shl", _) => narrow(x[0] << x[1]),
                    _ => panic!("`{line}` is not known"),
                }
            }
        };
        self.registers.insert(operands[0], value);
        true
    }

    fn numbers<'a>(&'a self, operands: &'a [&'t str]) -> impl Iterator<Item = u64> + 'a {
        operands[1..].iter().map(|operand| self.get(operand))
    }

    fn selected(&self, operands: &[&str]) -> u64 {
        self.get(operands[if self.get(operands[3]) == 1 { 1 } else { 2 }])
    }
}

fn compared(how: &str, order: Option<std::cmp::Ordering>) -> bool {
    match how {
        "gt" => order.is_some_and(|o| o.is_gt()),
        "ge" => order.is_some_and(|o| o.is_ge()),
        "lt" => order.is_some_and(|o| o.is_lt()),
        "le" => order.is_some_and(|o| o.is_le()),
        how => panic!("`{how}` is not known"),
    }
}

fn arithmetic<T>(name: &str, x: &[T], fma: fn(T, T, T) -> T, sqrt: fn(T) -> T, abs: fn(T) -> T) -> T
where
    T: Copy
        + std::ops::Add<Output = T>
        + std::ops::Sub<Output = T>
        + std::ops::Mul<Output = T>
        + std::ops::Div<Output = T>
        + std::ops::Neg<Output = T>,
{
    match name {
        "add" => x[0] + x[1],
        "sub" => x[0] - x[1],
        "mul" => x[0] * x[1],
        "div" => x[0] / x[1],
        "neg" => -x[0],
        "abs" => abs(x[0]),
        "sqrt" => sqrt(x[0]),
        "fma" => fma(x[0], x[1], x[2]),
        name => panic!("`{name}` is not known"),
    }
}
