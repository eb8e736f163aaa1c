//! What a macro expands to beside its errors when there is no dynamics: items of the names that there would be, so that a use of
//! one is no further error.
//!
//! Where the robot cannot be read, neither the sizes of arrays nor, in a scene, the number of arguments are known. So each item
//! has the type [`MISSING`], which is an error itself, one that was said: the compiler takes a value of that type anywhere,
//! and whatever is done with it. Such a type comes from a constant that does not evaluate, in the projection
//! `<Why<{ compile_error!(..) }> as Stub>::Item`; [`DEFINITION`] has what it takes. Lengths are numbers that do not evaluate.

use super::frames;
use crate::choices::{Lanes, WrittenEntries};
use crate::function::{ContactFunction, Function};
use crate::identifier::{identifier, upper_camel_case};
use crate::options::Options;
use std::collections::BTreeSet;
use std::fmt::Write;
use straightline_graph::Scalar;

/// The name of the type of what is missing.
pub const MISSING: &str = "__Missing";

/// What the type is defined by: a macro adds `pub type __Missing = <__Why<{ compile_error!(..) }> as __Stub>::Item;`.
pub const DEFINITION: &str = "
#[doc(hidden)]
pub trait __Stub {
    type Item;
}
#[doc(hidden)]
pub struct __Why<const N: usize>;
impl __Stub for __Why<0> {
    type Item = ();
}
";

/// Lengths of arrays.
const LENGTHS: [&str; 6] = ["NQ", "NV", "NU", "NX", "BASE_PARAMETER_COUNT", "SUPPORT_PARAMETER_COUNT"];
/// Further constants of a robot.
const CONSTANTS: [&str; 20] = [
    "JOINT_NAMES",
    "FRAME_NAMES",
    "FOLLOWER_NAMES",
    "FOLLOWED",
    "FOLLOWER_RATIOS",
    "FOLLOWER_OFFSETS",
    "LOWER_LIMITS",
    "UPPER_LIMITS",
    "VELOCITY_LIMITS",
    "EFFORT_LIMITS",
    "DRIVE_NAMES",
    "DRIVE_STATES",
    "BASE_PARAMETER_NAMES",
    "BASE_PARAMETERS",
    "BASE_REGRESSOR_ROWS",
    "BASE_REGRESSOR_COLUMNS",
    "SUPPORT_PARAMETER_NAMES",
    "SUPPORT_PARAMETERS",
    "SUPPORT_REGRESSOR_ROWS",
    "SUPPORT_REGRESSOR_COLUMNS",
];

/// The functions of a self-test.
const SELF_TEST: [&str; 2] = ["self_test", "self_test_hashes"];

/// The items of the module, beside the definition of [`MISSING`]; `scene` is the text of the scene, if there is one.
pub fn module_items(options: &Options, scene: Option<&str>) -> String {
    let mut out = items_and_types(options, scene, "");
    for scalar in &options.also {
        let inner = items_and_types(options, scene, "super::");
        let _ = writeln!(out, "pub mod {} {{\n{inner}}}", scalar.module());
    }
    if options.also.is_empty() && scene.is_some() {
        // a scene may ask for another scalar
        let other = Scalar::ALL.iter().copied().find(|s| *s != options.scalar).unwrap_or(Scalar::F32);
        let inner = items_and_types(options, scene, "super::");
        let _ = writeln!(out, "pub mod {} {{\n{inner}}}", other.module());
    }
    out
}

/// The constants and functions of a type; `dynamics` is the module that holds [`MISSING`]. What `robot`, the text of the robot file,
/// gives a name to may be a frame.
pub fn associated_items(options: &Options, scene: Option<&str>, robot: &str) -> String {
    let missing = format!("dynamics::{MISSING}");
    let mut out = constants_and_functions(options, scene, &missing);
    let mut names: BTreeSet<String> = options.frames.iter().map(|frame| frames::constant(frame)).collect();
    names.extend(names_in(robot).map(frames::constant));
    let is_new = |name: &String| !out.contains(&format!("pub const {name}:"));
    let further: Vec<String> = names.into_iter().filter(is_new).chain(["pose".to_string()]).collect();
    further.iter().for_each(|name| out.push_str(&value(name, &missing)));
    out
}

fn items_and_types(options: &Options, scene: Option<&str>, upwards: &str) -> String {
    let missing = format!("{upwards}{MISSING}");
    let mut out = constants_and_functions(options, scene, &missing);
    let names = scene.map(names).unwrap_or_default();
    let mut taken: BTreeSet<String> = BTreeSet::new();
    let mut add_type = |out: &mut String, name: &str| {
        if taken.insert(name.to_string()) {
            let _ = writeln!(out, "pub type {name} = {missing};");
        }
    };
    add_type(&mut out, "Cost");
    if options.figures || scene.is_some() {
        add_type(&mut out, "Figures");
    }
    if options.lanes.is_some() {
        let _ = writeln!(out, "pub mod batch {{\n    pub type WrongLength = super::{missing};\n}}");
    }
    if scene.is_none() {
        return out;
    }
    add_type(&mut out, "Unphysical");
    add_type(&mut out, "OutOfRange");
    for name in &names {
        add_type(&mut out, &upper_camel_case(name));
        add_type(&mut out, &(upper_camel_case(name) + "Numbers"));
    }
    let stages = ["Parameters", "Configuration", "Velocity", "Motion"];
    let stages: String = stages.iter().map(|name| format!("    pub type {name} = super::{missing};\n")).collect();
    let _ = writeln!(out, "pub mod staged {{\n{stages}}}");
    out.push_str("pub mod contact {\n");
    let _ = writeln!(out, "    pub type Mode = super::{missing};");
    let _ = writeln!(out, "    {}", length("MOST_CONSTRAINED", &format!("super::{missing}")));
    let _ = writeln!(out, "    {}", value("forward_dynamics", &format!("super::{missing}")));
    for name in &names {
        let missing = format!("super::super::{missing}");
        let mut inner = String::new();
        for constant in ["CONSTRAINED", "FREE"] {
            let _ = writeln!(inner, "        {}", value(constant, &missing));
        }
        for function in ContactFunction::ALL.iter().map(|f| f.name()) {
            let _ = writeln!(inner, "        {}", value(function, &missing));
            let _ = writeln!(inner, "        {}", value(&format!("{function}_error_bound"), &missing));
            for batch in options.lanes.iter().flat_map(|lanes| over_states(function, *lanes)) {
                let _ = writeln!(inner, "        {}", value(&batch, &missing));
            }
        }
        let _ = writeln!(out, "    pub mod {name} {{\n{inner}    }}");
    }
    out.push_str("}\n");
    out
}

fn constants_and_functions(options: &Options, scene: Option<&str>, missing: &str) -> String {
    let mut out = String::new();
    for name in LENGTHS {
        let _ = writeln!(out, "{}", length(name, missing));
    }
    for name in CONSTANTS {
        let _ = writeln!(out, "{}", value(name, missing));
    }
    if options.self_test || scene.is_some() {
        SELF_TEST.iter().for_each(|name| out.extend([value(name, missing), "\n".to_string()]));
    }
    for function in functions(options, scene) {
        let name = function.name();
        let upper = name.to_uppercase();
        // without a scene the number of arguments is known
        let known = scene.is_none().then(|| function.arguments()).flatten();
        match known.filter(|_| options.generic) {
            Some(arguments) => out.push_str(&generic(name, "T", arguments, missing)),
            None => {
                let _ = writeln!(out, "{}", value(name, missing));
            }
        }
        if options.figures || scene.is_some() {
            let _ = writeln!(out, "{}", value(&format!("{upper}_FIGURES"), missing));
        }
        for constant in [format!("{upper}_COST"), format!("{name}_error_bound"), format!("{upper}_ERROR_BOUND")] {
            let _ = writeln!(out, "{}", value(&constant, missing));
        }
        let outputs = function.spec().outputs;
        for output in outputs.iter().filter(|_| outputs.len() > 1) {
            let _ = writeln!(out, "{}", value(&format!("{upper}_{}_ERROR_BOUND", output.name.to_uppercase()), missing));
        }
        for output in outputs {
            let name = format!("{upper}_{}", output.name.to_uppercase());
            let has_slopes = output.slope.is_some() && (options.certify.is_some() || scene.is_some());
            let has_entries = output.is_by_columns() && (options.entries != WrittenEntries::All || scene.is_some());
            let slopes = ["LIPSCHITZ", "LIPSCHITZ_NORM"].into_iter().filter(|_| has_slopes);
            for suffix in slopes.chain(["ROW_STARTS", "COLUMNS"].into_iter().filter(|_| has_entries)) {
                let _ = writeln!(out, "{}", value(&format!("{name}_{suffix}"), missing));
            }
        }
        let Some(lanes) = options.lanes else { continue };
        match known {
            Some(arguments) => out.push_str(&generic(&format!("{name}_lanes"), "const N: usize", arguments, missing)),
            None => {
                let _ = writeln!(out, "{}", value(&format!("{name}_lanes"), missing));
            }
        }
        for batch in over_states(name, lanes).skip(1) {
            let _ = writeln!(out, "{}", value(&batch, missing));
        }
    }
    out
}

/// The function over lanes, and those over batches.
fn over_states(name: &str, lanes: Lanes) -> impl Iterator<Item = String> + '_ {
    let threads: &[&str] = if lanes == Lanes::Runtime { &["", "_parallel"] } else { &[""] };
    let of_layout = move |layout| threads.iter().map(move |threads| format!("{name}_batch_{layout}{threads}"));
    [format!("{name}_lanes")].into_iter().chain(["soa", "aos"].into_iter().flat_map(of_layout))
}

/// The functions that there may be.
fn functions(options: &Options, scene: Option<&str>) -> Vec<Function> {
    match scene.is_some() || options.functions.iter().copied().eq(Function::all()) {
        true => Function::known().collect(),
        false => options.functions.clone(),
    }
}

fn length(name: &str, missing: &str) -> String {
    format!("pub const {name}: usize = <{missing}>::value;")
}

fn value(name: &str, missing: &str) -> String {
    format!("pub const {name}: {missing} = <{missing}>::value;")
}

fn generic(name: &str, parameter: &str, arguments: usize, missing: &str) -> String {
    let arguments: Vec<String> = (0..arguments).map(|k| format!("_{k}: {missing}")).collect();
    format!("pub fn {name}<{parameter}>({}) -> {missing} {{\n    <{missing}>::value\n}}\n", arguments.join(", "))
}

/// What a scene's text gives names to, as identifiers: parameters, contacts, modes. It need not be readable.
fn names(text: &str) -> BTreeSet<String> {
    names_in(text).flat_map(|name| ["body", "mode"].map(|what| identifier(name, what))).collect()
}

/// What a text, which need not be readable, gives names to: a parameter of a link or of a drive has their name.
fn names_in(text: &str) -> impl Iterator<Item = &str> {
    let keys = ["name", "link", "drive"];
    keys.into_iter().flat_map(|key| text.match_indices(key).map(move |(at, key)| at + key.len())).filter_map(|end| {
        let quoted = text[end..].trim_start().strip_prefix('=')?.trim_start();
        let quote = quoted.chars().next().filter(|c| ['"', '\''].contains(c))?;
        quoted[1..].split(quote).next()
    })
}

#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod tests {
    use super::*;

    pub fn names_are_found_in_text_that_no_reader_takes() {
        let text =
            "[[parameter]\nname = \"tool 2\"\n[[mode]]\nname='left'\ncontacts = [\nparameter = { name = \"Grip\" }";
        assert_eq!(names(text).into_iter().collect::<Vec<_>>(), ["grip", "left", "tool_2"]);
    }

    pub fn without_a_scene_the_functions_are_those_that_are_asked_for() {
        let options =
            Options { functions: vec![Function::GravityForce], lanes: Some(Lanes::Runtime), ..Options::default() };
        let items = associated_items(&options, None, "<link name='panda hand'/>");
        assert!(items.contains("pub const NQ: usize = "), "{items}");
        assert!(items.contains("pub const gravity_force: dynamics::__Missing = "), "{items}");
        assert!(items.contains("pub fn gravity_force_lanes<const N: usize>(_0: dynamics::__Missing, _1"), "{items}");
        assert!(items.contains("pub const PANDA_HAND: dynamics::__Missing"), "{items}");
        assert!(items.contains("gravity_force_batch_soa_parallel") && !items.contains("mass_matrix"), "{items}");
    }
}
