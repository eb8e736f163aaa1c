//! Reads packages in OpenCL C back: the functions as those of C99; the kernels around them are written here a second time.

use super::around::{code_lines, kernel_names};
use super::tokens::CText;
use super::{c_name, compare, definitions};
use crate::emit::Generated;
use crate::readback::values::Values;
use crate::readback::wanted::{of_package, PackageFunction};
use crate::readback::ReadingStop;
use std::collections::BTreeSet;

/// What compilers are told.
const HEAD: [&str; 11] = [
    "#if !defined(__OPENCL_VERSION__)",
    "#error \"this is OpenCL C; a package of C99 is for other compilers\"",
    "#endif",
    "#if defined(__FAST_RELAXED_MATH__)",
    "#error \"leave out -cl-fast-relaxed-math: operations must be those that are written\"",
    "#endif",
    "#pragma OPENCL FP_CONTRACT OFF",
    "typedef uint uint32_t;",
    "typedef ulong uint64_t;",
    "#define UINT32_C(x) x##U",
    "#define UINT64_C(x) x##UL",
];

/// The same, of double precision.
const HEAD_OF_DOUBLE: [&str; 5] = [
    "#if defined(cl_khr_fp64)",
    "#pragma OPENCL EXTENSION cl_khr_fp64 : enable",
    "#elif !defined(__opencl_c_fp64)",
    "#error \"the device has no double precision: export with --scalar f32\"",
    "#endif",
];

/// What stands before the functions.
const FUNCTIONS: &str = "\n/* Functions of one state. */\n";

/// Checks the text of a package; `place` is what of it is read.
pub(in crate::readback) fn read(
    generated: &Generated,
    prefix: &str,
    source: &str,
    place: &mut String,
) -> Result<(), ReadingStop> {
    let file = place.clone();
    let (kernel, from) = head(source, prefix)?;
    let text = CText::read(source, from, false)?;
    let (functions, mut at) = definitions(&text, prefix, "__kernel")?;
    let mut values = Values::default();
    let wanted = of_package(generated, prefix, &mut values);
    for wanted in wanted.iter().filter(|wanted| !wanted.is_private) {
        values.forget();
        compare(wanted, (&text, &functions), (&kernel, prefix), &mut values, place)?;
        kernel_around(wanted, &text, &mut at)?;
    }
    *place = file;
    if let Some(function) = functions.values().find(|function| !function.claimed.get()) {
        return text.stop(function.start, "a function that nothing asked for");
    }
    match at == text.len() {
        true => Ok(()),
        false => text.stop(at, "something behind the end"),
    }
}

/// All before the functions: what the kernel defines, and where it ends.
fn head(source: &str, prefix: &str) -> Result<(BTreeSet<String>, usize), ReadingStop> {
    let Some(end) = source.find(FUNCTIONS) else { return Err(ReadingStop::at(0, "there are no functions")) };
    let lines = code_lines(&source[..end]);
    let rest = &source[end..];
    let part = format!("#define {}_PART static", prefix.to_uppercase());
    let is_double = rest.contains("double");
    let has_parts = rest.contains(&format!("{}_PART", prefix.to_uppercase()));
    let of_double = HEAD_OF_DOUBLE.into_iter().filter(|_| is_double);
    let expected: Vec<&str> = HEAD.into_iter().chain(of_double).chain(has_parts.then_some(&part[..])).collect();
    for (k, expected) in expected.iter().enumerate() {
        let (place, found) = lines.get(k).copied().unwrap_or((end, ""));
        if found != *expected {
            return Err(ReadingStop::at(place, format!("`{expected}` is expected here")));
        }
    }
    Ok((kernel_names(&lines[expected.len()..], prefix)?, end))
}

/// A kernel gives a function the numbers of its state, and puts its results where they belong.
fn kernel_around(wanted: &PackageFunction<'_>, text: &CText<'_>, at: &mut usize) -> Result<(), ReadingStop> {
    let (name, t) = (&wanted.name, c_name(wanted.format));
    let ports = || wanted.inputs.iter().map(|p| (p, false)).chain(wanted.outputs.iter().map(|p| (p, true)));
    let mut taken: BTreeSet<String> = ports().map(|(port, _)| port.name.clone()).collect();
    let mut own = |at: &mut usize| {
        let (start, name) = (*at, text.name(at)?);
        match taken.insert(name.to_string()) {
            true => Ok(name.to_string()),
            false => text.stop(start, "a name that stands for something else already"),
        }
    };
    text.these(at, &format!("__kernel void {name}_batch_soa(const uint"))?;
    let n = own(at)?;
    for (port, is_output) in ports() {
        let constant = if is_output { "" } else { "const " };
        text.these(at, &format!(", __global {constant}{t} *{}", port.name))?;
    }
    text.these(at, ") { const size_t")?;
    let state = own(at)?;
    text.these(at, &format!("= get_global_id(0); if ({state} < {n}) {{"))?;
    let mut arrays = Vec::new();
    for (port, is_output) in ports() {
        text.these(at, t)?;
        let array = own(at)?;
        text.these(at, &format!("[{}];", port.len().max(1)))?;
        arrays.push((port, is_output, array));
    }
    let copies = |at: &mut usize, results: bool, component: &mut Option<String>| {
        for (port, _, array) in arrays.iter().filter(|(port, is_output, _)| *is_output == results && !port.is_empty()) {
            text.these(at, "for (uint")?;
            let (start, c) = (*at, text.name(at)?.to_string());
            let is_new = c != n && c != state && arrays.iter().all(|(port, _, array)| c != port.name && c != *array);
            if !is_new || component.as_ref().is_some_and(|known| *known != c) {
                return text.stop(start, "a name that stands for something else already");
            }
            let there = match port.wrapper.is_some() {
                true => format!("{}[{c}]", port.name),
                false => format!("{}[((size_t){c} * {n}) + {state}]", port.name),
            };
            let copy = match results {
                true => format!("{there} = {array}[{c}];"),
                false => format!("{array}[{c}] = {there};"),
            };
            text.these(at, &format!("= 0U; {c} < {}U; {c}++) {{ {copy} }}", port.len()))?;
            *component = Some(c);
        }
        Ok(())
    };
    let mut component = None;
    copies(at, false, &mut component)?;
    let given: Vec<&str> = arrays.iter().map(|(.., array)| array.as_str()).collect();
    text.these(at, &format!("{name}({});", given.join(", ")))?;
    copies(at, true, &mut component)?;
    text.these(at, "} }")
}
