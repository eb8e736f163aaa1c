//! A package of its own around generated code, with C functions and their header, for C, C++, Python and any language that
//! calls C: text only, no file is touched here.
//!
//! Every function stands in a module of its own, so that rustc's back end can work on several at once.

use super::file::{header, item_text, lanes_text, preamble, short_sines, uses};
use super::routine::SHORT_SINES;
use super::{array_type, batch, fused, kernel};
use crate::emit::c99::interface::{CParameter, Exported, Interface, LAYOUTS};
use crate::emit::package::{rust_alone, PackageKind};
use crate::emit::{Generated, Item, Style};
use crate::identifier::{package_name, string_literal};
use crate::output::MARK;
use std::fmt::Write;
use straightline_graph::expr::Port;
use straightline_graph::Scalar;

/// Functions with C's calling convention, and a header.
pub const C_ABI: PackageKind = PackageKind {
    name: "c-abi",
    doc: "a Rust package of functions with C's calling convention, and their header",
    is_c: true,
    refusal: rust_alone,
    files: c_package,
};

/// The files of the package; all C names begin with `prefix`.
fn c_package(generated: &Generated, prefix: &str) -> Vec<(String, String)> {
    let package = Interface::new(generated, prefix);
    let mut files = vec![
        ("Cargo.toml".to_string(), package.manifest()),
        ("src/lib.rs".to_string(), package.library_source()),
        (format!("include/{}.h", package.library), package.header(&package.exported(), "")),
        ("src/dynamics/mod.rs".to_string(), package.dynamics()),
    ];
    for item in &generated.items {
        files.push((format!("src/dynamics/{}.rs", item.name()), package.function(item)));
    }
    if generated.lanes.is_some() {
        files.push(("src/dynamics/drivers.rs".to_string(), batch::drivers().to_string()));
        files.push(("src/dispatch.rs".to_string(), DISPATCH.to_string()));
    }
    if generated.calls_kernel() {
        files.push((
            "src/dynamics/trig.rs".to_string(),
            kernel(generated.lanes.is_some(), generated.style.fused).into_owned(),
        ));
    }
    if generated.items.iter().any(Item::calls_short_sines) {
        files.push((format!("src/dynamics/{SHORT_SINES}.rs"), short_sines(generated.memory)));
    }
    files
}

/// What chooses the vector instructions of the machine, pasted as it is.
const DISPATCH: &str = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/pasted/dispatch.rs"));

impl Exported {
    /// The path of the Rust function.
    fn path(&self) -> String {
        match &self.mode {
            None => format!("dynamics::{}", self.name),
            Some(mode) => format!("dynamics::contact::{mode}::{}", self.name),
        }
    }
}

impl CParameter {
    /// The type of the Rust array.
    fn array(&self, scalar: Scalar) -> String {
        match &self.port.wrapper {
            Some(wrapper) => format!("dynamics::{wrapper}"),
            None => array_type(&self.port, Style::plain(scalar)),
        }
    }

    /// The pointer as a reference to an array; one to no numbers at all may be null.
    fn as_array(&self, scalar: Scalar) -> String {
        let (name, array) = (&self.name, self.array(scalar));
        match (self.length, self.is_output) {
            (0, false) => format!("    let {name} = {{ let _ = {name}; &[] }};\n"),
            (0, true) => format!("    let {name} = {{ let _ = {name}; &mut [] }};\n"),
            (_, false) => format!("    let {name} = unsafe {{ &*{name}.cast::<{array}>() }};\n"),
            (_, true) => format!("    let {name} = unsafe {{ &mut *{name}.cast::<{array}>() }};\n"),
        }
    }

    /// The pointer as a slice of `n` states.
    fn as_slice(&self, scalar: Scalar) -> String {
        let CParameter { name, length, .. } = self;
        match (length, self.is_output) {
            _ if self.is_shared => self.as_array(scalar),
            (0, _) => self.as_array(scalar),
            (_, true) => {
                format!("    let {name} = unsafe {{ core::slice::from_raw_parts_mut({name}, n * {length}) }};\n")
            }
            (_, false) => format!("    let {name} = unsafe {{ core::slice::from_raw_parts({name}, n * {length}) }};\n"),
        }
    }
}

impl Interface<'_> {
    /// The module of one function.
    fn function(&self, item: &Item) -> String {
        let types: String = item
            .inputs()
            .iter()
            .filter_map(|p| p.wrapper.as_ref())
            .map(|wrapper| format!("use super::{wrapper};\n"))
            .collect();
        let short = if item.calls_short_sines() { format!("use super::{SHORT_SINES};\n") } else { String::new() };
        let uses = uses("super", item.calls_kernel(), self.generated) + &short + &types;
        let gap = if uses.is_empty() { "" } else { "\n" };
        [&uses, gap, &item_text(item), &lanes_text(item, self.generated.lanes)].concat()
    }

    fn manifest(&self) -> String {
        let (library, name) = (&self.library, package_name(&self.library));
        format!(
            r#"{MARK}: {provenance}
[package]
name = "{name}"
version = "0.1.0"
edition = "2021"
publish = false

[lib]
name = "{library}"
crate-type = ["cdylib", "staticlib", "rlib"]

[profile.release]
opt-level = 3
panic = "abort"
overflow-checks = false

# on its own, wherever it stands
[workspace]
"#,
            provenance = self.provenance(),
        )
    }

    fn dynamics(&self) -> String {
        let g = self.generated;
        let mut out = header(g) + &preamble(g);
        if g.style.fused {
            out.push_str(&fused::module(g.style, g.calls_kernel()));
        }
        for item in &self.generated.items {
            let name = item.name();
            let names = match self.generated.lanes {
                Some(_) => format!("{{{name}, {name}_batch_aos, {name}_batch_soa, {name}_lanes}}"),
                None => name.to_string(),
            };
            let _ = write!(out, "\nmod {name};\npub use self::{name}::{names};\n");
        }
        if self.generated.lanes.is_some() {
            out.push_str(
                "\n#[allow(dead_code, clippy::all, clippy::pedantic)]\nmod drivers;\n\
                 /// Batches, with the vector instructions of the machine.\n\
                 pub mod batch {\n    pub use super::drivers::*;\n    pub use crate::dispatch::{run_f32, run_f64};\n}\n",
            );
        }
        if g.calls_kernel() {
            out.push_str("\n#[allow(dead_code, clippy::all, clippy::pedantic)]\nmod trig;\n");
        }
        if g.items.iter().any(Item::calls_short_sines) {
            let _ = write!(out, "\n#[allow(dead_code, clippy::all, clippy::pedantic)]\nmod {SHORT_SINES};\n");
        }
        out
    }

    /// `src/lib.rs`: from pointers to arrays, and nothing else.
    fn library_source(&self) -> String {
        let prefix = self.prefix;
        let joints = c_strings(self.generated.model.joints().iter().map(|j| j.name.as_str()));
        let frames = c_strings(self.generated.frames.iter().map(String::as_str));
        let mut out = format!(
            r#"//! Generated by {provenance}
//!
//! C functions over [`dynamics`]. C knows arrays as pointers only, so turning them into references is unsafe, and it is
//! all that happens here; the dynamics themselves are safe Rust that cannot panic.
#![allow(non_snake_case)] // C names

use core::ffi::{{c_char, c_int, CStr}};

#[forbid(unsafe_code)]
pub mod dynamics;
{dispatch}
/// Number of configuration coordinates.
#[no_mangle]
pub extern "C" fn {prefix}_nq() -> c_int {{
    dynamics::NQ as c_int
}}

/// Number of velocity coordinates.
#[no_mangle]
pub extern "C" fn {prefix}_nv() -> c_int {{
    dynamics::NV as c_int
}}

/// Number of joints.
#[no_mangle]
pub extern "C" fn {prefix}_joint_count() -> c_int {{
    dynamics::JOINT_NAMES.len() as c_int
}}

/// Number of frames.
#[no_mangle]
pub extern "C" fn {prefix}_frame_count() -> c_int {{
    dynamics::FRAME_NAMES.len() as c_int
}}

/// Name of joint `i`, or null.
#[no_mangle]
pub extern "C" fn {prefix}_joint_name(i: c_int) -> *const c_char {{
    const NAMES: &[&CStr] = &[{joints}];
    name(NAMES, i)
}}

/// Name of frame `i`, or null.
#[no_mangle]
pub extern "C" fn {prefix}_frame_name(i: c_int) -> *const c_char {{
    const NAMES: &[&CStr] = &[{frames}];
    name(NAMES, i)
}}

fn name(names: &[&CStr], i: c_int) -> *const c_char {{
    usize::try_from(i).ok().and_then(|i| names.get(i)).map_or(core::ptr::null(), |n| n.as_ptr())
}}
"#,
            provenance = self.provenance(),
            dispatch = match self.generated.lanes {
                Some(_) => "mod dispatch;\n\nuse dynamics::batch;\n",
                None => "",
            },
        );
        for body in self.bodies() {
            let _ = write!(out, "{}", self.constructor(&body));
        }
        for function in self.exported() {
            out.push_str(&self.wrapper(&function));
            if self.generated.lanes.is_some() {
                out.push_str(&self.batches(&function));
            }
        }
        out
    }

    /// The C function of one function.
    fn wrapper(&self, function: &Exported) -> String {
        let (prefix, scalar) = (self.prefix, self.scalar().name());
        let Exported { c_name, summary, parameters, .. } = function;
        let path = function.path();
        let list = |f: &dyn Fn(&CParameter) -> String| function.list(f);
        let signature = list(&|p| format!("{}: *{} {scalar}", p.name, if p.is_output { "mut" } else { "const" }));
        let arguments = list(&|p| p.name.to_string());
        let arrays: String = parameters.iter().map(|p| p.as_array(self.scalar())).collect();
        let lengths = list(&|p| format!("`{}` {}", p.name, p.length));
        format!(
            r#"
/// {summary}
///
/// # Safety
/// The pointers lead to aligned arrays of {scalar}: {lengths}; what is written overlaps nothing that is read.
#[no_mangle]
pub unsafe extern "C" fn {prefix}_{c_name}({signature}) {{
    // SAFETY of all these: the caller's promise
{arrays}    {path}({arguments});
}}
"#
        )
    }

    /// The C functions over batches of one function.
    fn batches(&self, function: &Exported) -> String {
        let (prefix, scalar) = (self.prefix, self.scalar().name());
        let Exported { c_name, parameters, .. } = function;
        let path = function.path();
        let list = |f: &dyn Fn(&CParameter) -> String| function.list(f);
        let pointer = |p: &CParameter| format!("{}: *{} {scalar}", p.name, if p.is_output { "mut" } else { "const" });
        let slices: String = parameters.iter().map(|p| p.as_slice(self.scalar())).collect();
        let lengths = list(&|p| match p.is_shared {
            true => format!("`{}` {}", p.name, p.length),
            false => format!("`{}` n times {}", p.name, p.length),
        });
        let (signature, arguments) = (list(&pointer), list(&|p| p.name.clone()));
        let mut out = String::new();
        for (layout, place) in LAYOUTS {
            let _ = write!(
                out,
                r#"
/// The same for `n` states: component c of state s at {place}.
///
/// # Safety
/// The pointers lead to aligned arrays of {scalar}: {lengths}; what is written overlaps nothing that is read.
#[no_mangle]
pub unsafe extern "C" fn {prefix}_{c_name}_batch_{layout}(n: usize, {signature}) {{
    if n == 0 {{
        return;
    }}
    // SAFETY of all these: the caller's promise
{slices}    let done = {path}_batch_{layout}(n, {arguments});
    debug_assert!(done.is_ok(), "the slices are made of n");
}}
"#
            );
        }
        out
    }

    /// The C function that makes a run-time parameter.
    fn constructor(&self, body: &Port) -> String {
        let (prefix, scalar, name, length) = (self.prefix, self.scalar().name(), &body.name, body.len());
        let type_name = body.wrapper.as_deref().unwrap_or_default();
        if let Some(numbers) = self.drive_numbers(body) {
            let each = |text: &dyn Fn(usize, &str) -> String| -> String {
                numbers.iter().enumerate().map(|(k, n)| text(k, &n.name)).collect()
            };
            let arguments = each(&|_, n| format!("    {n}: {scalar},\n"));
            let fields = each(&|_, n| format!("{n}, "));
            let refusals = each(&|k, n| format!("        Err(e) if e.number == {n:?} => {},\n", k + 1));
            return format!(
                r#"
/// A drive as the functions take it in `made`, with these numbers. Zero, or which of them no drive has, counted from 1, or one more than
/// there are where what follows from them is not finite; `made` is untouched then.
///
/// # Safety
/// The pointer leads to an aligned array of {length} {scalar}.
#[no_mangle]
pub unsafe extern "C" fn {prefix}_{name}_new(
{arguments}    made: *mut {scalar},
) -> c_int {{
    // SAFETY: the caller's promise
    let made = unsafe {{ &mut *made.cast::<dynamics::{type_name}>() }};
    match dynamics::{type_name}::new(dynamics::{type_name}Numbers {{ {fields}}}) {{
        Ok(drive) => {{
            *made = drive;
            0
        }}
{refusals}        Err(_) => {},
    }}
}}
"#,
                numbers.len() + 1
            );
        }
        format!(
            r#"
/// A body as the functions take it in `{name}`, from mass, centre of mass and inertia (xx, xy, xz, yy, yz, zz) about the centre
/// of mass. Zero, or why no body has these: 1 a number is not finite, 2 the mass is negative, 3 inertia without mass, 4 the
/// inertia is impossible; `{name}` is untouched then.
///
/// # Safety
/// The pointers lead to aligned arrays of {scalar}: `com` 3, `inertia` 6, `{name}` {length}; what is written overlaps nothing
/// that is read.
#[no_mangle]
pub unsafe extern "C" fn {prefix}_{name}_new(
    mass: {scalar},
    com: *const {scalar},
    inertia: *const {scalar},
    {name}: *mut {scalar},
) -> c_int {{
    // SAFETY of all these: the caller's promise
    let com = unsafe {{ *com.cast::<[{scalar}; 3]>() }};
    let inertia = unsafe {{ *inertia.cast::<[{scalar}; 6]>() }};
    let {name} = unsafe {{ &mut *{name}.cast::<dynamics::{type_name}>() }};
    match dynamics::{type_name}::new(mass, com, inertia) {{
        Ok(new) => {{
            *{name} = new;
            0
        }}
        Err(dynamics::Unphysical::NotFinite) => 1,
        Err(dynamics::Unphysical::NegativeMass) => 2,
        Err(dynamics::Unphysical::InertiaWithoutMass) => 3,
        Err(dynamics::Unphysical::Inertia) => 4,
    }}
}}
"#
        )
    }
}

/// `c"a", c"b"`; what no C string can hold is left out.
fn c_strings<'a>(names: impl Iterator<Item = &'a str>) -> String {
    names.map(|n| format!("c{}", string_literal(&n.replace('\0', "")))).collect::<Vec<_>>().join(", ")
}
