//! `sin_cos_of_sum_f64` of `runtime/core/src/trig.rs`, instruction by instruction: the same operations in the same order, and so the same bits.
//! What its numbers are and why they suffice is said there.

use super::encoder::FunctionBody;
use super::encoder::Simple::*;
use std::f64::consts::FRAC_2_PI;
use straightline_core::trig::DOMAIN_F64;

const ROUND: f64 = 6_755_399_441_055_744.0;
const PARTS: [f64; 4] = [1.570796325802803, 9.920935791635221e-10, 5.17018297889025e-19, 2.9038559739793605e-28];
const SIGN: i64 = i64::MIN;
const SINE: [f64; 7] = [
    -0.16666666666666666,
    0.00833333333333304,
    -0.00019841269840959285,
    2.7557319071880108e-6,
    -2.5052070283413337e-8,
    1.605422047840546e-10,
    -7.384541077267838e-13,
];
const COSINE: [f64; 6] = [
    0.041666666666666595,
    -0.0013888888888873342,
    2.480158728900208e-5,
    -2.755731421703886e-7,
    2.0875705396029103e-9,
    -1.135874923991542e-11,
];

// locals: parameters, then numbers
const X: u32 = 0;
const TAIL: u32 = 1;
const SHIFTED: u32 = 2;
const K: u32 = 3;
const R0: u32 = 4;
const W: u32 = 5;
const R1: u32 = 6;
const T: u32 = 7;
const Y0: u32 = 8;
const Y1: u32 = 9;
const Z: u32 = 10;
const S: u32 = 11;
const C: u32 = 12;
const A: u32 = 13;
const B: u32 = 14;
const HALF: u32 = 15;
const LEAD: u32 = 16;
const NUMBERS: u32 = 15;

/// (x, tail) → (sin, cos) of their sum.
pub fn sines() -> FunctionBody {
    let mut body = FunctionBody::new(2, NUMBERS, 5);
    let f = &mut body;
    // shifted = x·2/π + ROUND, k = shifted − ROUND
    f.get(X).number(FRAC_2_PI).op(Multiply).number(ROUND).op(Add).set(SHIFTED);
    f.get(SHIFTED).number(ROUND).op(Subtract).set(K);
    // r0 = x − k P1, w = k P2, r1 = r0 − w
    f.get(X).get(K).number(PARTS[0]).op(Multiply).op(Subtract).set(R0);
    f.get(K).number(PARTS[1]).op(Multiply).set(W);
    f.get(R0).get(W).op(Subtract).set(R1);
    // t = (k P3 − e1) − tail, e1 = (r0 − r1) − w
    f.get(K).number(PARTS[2]).op(Multiply);
    f.get(R0).get(R1).op(Subtract).get(W).op(Subtract);
    f.op(Subtract).get(TAIL).op(Subtract).set(T);
    // y0 = r1 − t, y1 = ((r1 − y0) − t) − k P4
    f.get(R1).get(T).op(Subtract).set(Y0);
    f.get(R1).get(Y0).op(Subtract).get(T).op(Subtract).get(K).number(PARTS[3]).op(Multiply).op(Subtract).set(Y1);
    kernel(f);
    quadrant(f);
    body
}

/// a + z b of what is on the stack and the next lower coefficient.
fn horner(f: &mut FunctionBody, coefficients: &[f64]) {
    let (last, rest) = coefficients.split_last().expect("there are coefficients");
    // c0 + z (c1 + z (… + z cn)): operands from the left
    rest.iter().for_each(|c| {
        f.number(*c).get(Z);
    });
    f.number(*last);
    rest.iter().for_each(|_| {
        f.op(Multiply).op(Add);
    });
}

/// Sine in S and cosine in C, of y0 + y1.
fn kernel(f: &mut FunctionBody) {
    f.get(Y0).get(Y0).op(Multiply).set(Z);
    horner(f, &SINE);
    f.set(S);
    horner(f, &COSINE);
    f.set(C);
    // a: 26 bits of y0; b = (y0 − a) + y1
    f.get(Y0).op(BitsOf).bits(!0x7ff_ffff).op(I64And).op(OfBits).set(A);
    f.get(Y0).get(A).op(Subtract).get(Y1).op(Add).set(B);
    // ½ a a, and the lead 1 − ½ a a
    f.number(0.5).get(A).op(Multiply).get(A).op(Multiply).set(HALF);
    f.number(1.0).get(HALF).op(Subtract).set(LEAD);
    // cos = lead + ((((1 − lead) − ½ a a) − ½ b (y0 + a)) + z z c)
    f.get(LEAD);
    f.number(1.0).get(LEAD).op(Subtract).get(HALF).op(Subtract);
    f.number(0.5).get(B).op(Multiply).get(Y0).get(A).op(Add).op(Multiply).op(Subtract);
    f.get(Z).get(Z).op(Multiply).get(C).op(Multiply).op(Add).op(Add).set(C);
    // sin = y0 + (y0 z s + y1 cos)
    f.get(Y0).get(Y0).get(Z).op(Multiply).get(S).op(Multiply).get(Y1).get(C).op(Multiply).op(Add).op(Add).set(S);
}

/// Sine and cosine exchanged and with their signs, NaN outside the domain.
fn quadrant(f: &mut FunctionBody) {
    let [sin, cos, quadrant, exchange, outside] = [0, 1, 2, 3, 4].map(|k| f.word(k));
    f.get(SHIFTED).op(BitsOf).set(quadrant);
    f.get(S).op(BitsOf).get(Y0).op(BitsOf).bits(SIGN).op(I64And).op(I64Or).set(sin);
    f.get(C).op(BitsOf).set(cos);
    // (sin ^ cos) & (0 − (quadrant & 1))
    f.get(sin).get(cos).op(I64Xor).bits(0).get(quadrant).bits(1).op(I64And).op(I64Sub).op(I64And).set(exchange);
    // ((DOMAIN − |x|) of bits >> 63)
    f.bits(DOMAIN_F64.to_bits() as i64).get(X).op(BitsOf).bits(!SIGN).op(I64And).op(I64Sub);
    f.bits(63).op(I64ShiftRightSigned).set(outside);
    let signed = |f: &mut FunctionBody, own: u32, plus: i64| {
        f.get(own).get(exchange).op(I64Xor);
        f.get(quadrant).bits(plus).op(I64Add).bits(2).op(I64And).bits(62).op(I64ShiftLeft).op(I64Xor);
        f.get(outside).op(I64Or).op(OfBits);
    };
    signed(f, sin, 0);
    signed(f, cos, 1);
}
