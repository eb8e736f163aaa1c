//! What the macros expand to, as text; `straightline-macros` is a shell over this.

use crate::compile::{compile, Generated, Options};
use crate::diagnostic::{Severity, Source};
use crate::emit::array_type;
use crate::expr::Port;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use straightline_core::model::JointKind;

/// What became of a robot file.
#[derive(Debug)]
pub struct Expansion {
    /// The file that was read: the expansion depends on it, right or wrong.
    pub file: Option<PathBuf>,
    /// The dynamics, or what to tell the person.
    pub result: Result<Generated, String>,
    /// What to tell the person besides.
    pub warnings: String,
}

/// Compiles the robot file that a macro names, looked for in these directories.
pub fn expand(robot: &str, directories: &[&Path], options: &Options) -> Expansion {
    let tried: Vec<PathBuf> = directories.iter().map(|d| d.join(robot)).collect();
    let failed = |file, message| Expansion { file, result: Err(message), warnings: String::new() };
    let Some(file) = tried.iter().find_map(|path| path.canonicalize().ok()) else {
        let mut message = format!("there is no robot file `{}`; tried:", robot.escape_default());
        tried.iter().for_each(|path| message.push_str(&format!("\n  {}", path.display())));
        message.push_str("\nhelp: the path counts from the package's manifest, or else from the source file");
        return failed(None, message);
    };
    let bytes = match std::fs::read(&file) {
        Ok(bytes) => bytes,
        Err(error) => return failed(None, format!("{}: {error}", file.display())),
    };
    match compile(&Source::from_bytes(robot, bytes), options) {
        Ok(generated) => {
            let warnings = generated.warnings.at_least(Severity::Warning).render();
            Expansion { file: Some(file), result: Ok(generated), warnings }
        }
        Err(diagnostics) => {
            let shown = diagnostics.at_least(Severity::Warning);
            failed(Some(file), format!("the robot file is wrong\n{}", shown.render().trim_end()))
        }
    }
}

/// Constants and functions of the module `dynamics` as associated items of a type.
pub fn associated_items(generated: &Generated) -> String {
    let Generated { model, frames, scalar, .. } = generated;
    let joints = model.bodies.len();
    let limited = model.bodies.iter().filter(|b| b.joint.kind != JointKind::Floating).count();
    let numbers = format!("[{}; {limited}]", scalar.name());
    let mut out = String::new();
    let mut constant = |name: &str, kind: &str, doc: &str| {
        let _ = writeln!(out, "/// {doc}\npub const {name}: {kind} = dynamics::{name};");
    };
    constant("NQ", "usize", "Number of configuration coordinates q.");
    constant("NV", "usize", "Number of velocity coordinates qd, qdd, tau.");
    constant("JOINT_NAMES", &format!("[&'static str; {joints}]"), "Joints in the order of their coordinates.");
    constant(
        "FRAME_NAMES",
        &format!("[&'static str; {}]", frames.len()),
        "Frames of the functions that answer per frame.",
    );
    constant("LOWER_LIMITS", &numbers, "Least coordinate of every joint \\[rad or m\\]; without a floating base.");
    constant("UPPER_LIMITS", &numbers, "Greatest coordinate of every joint \\[rad or m\\]; without a floating base.");
    constant("VELOCITY_LIMITS", &numbers, "Greatest speed of every joint \\[rad/s or m/s\\]; without a floating base.");
    constant("EFFORT_LIMITS", &numbers, "Greatest drive of every joint \\[N·m or N\\]; without a floating base.");
    for item in &generated.items {
        let name = item.function.name();
        constant(&format!("{}_COST", name.to_uppercase()), "dynamics::Cost", &format!("What [`Self::{name}`] costs."));
    }
    for item in &generated.items {
        let name = item.function.name();
        let parameters = item.inputs.iter().map(|p| (p, "&")).chain(item.outputs.iter().map(|p| (p, "&mut ")));
        let array = |p: &Port| {
            let module = if p.wrapper.is_some() { "dynamics::" } else { "" };
            format!("{module}{}", array_type(p, *scalar))
        };
        let signature: Vec<String> =
            parameters.clone().map(|(p, reference)| format!("{}: {reference}{}", p.name, array(p))).collect();
        let arguments: Vec<&str> = parameters.map(|(p, _)| p.name.as_str()).collect();
        for line in item.doc.replace("[`FRAME_NAMES`]", "[`Self::FRAME_NAMES`]").lines() {
            let _ = writeln!(out, "/// {line}");
        }
        let _ = writeln!(
            out,
            "#[inline]\npub fn {name}({}) {{\n    dynamics::{name}({})\n}}",
            signature.join(", "),
            arguments.join(", ")
        );
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    const CART: &str = r#"
[robot]
name = "cart"

[[link]]
name = "rail"

[[link]]
name = "cart"
mass = 2.0
com = [0.0, 0.0, 0.1]
inertia = [0.1, 0.1, 0.1]

[[joint]]
name = "slide"
kind = "prismatic"
parent = "rail"
child = "cart"
axis = "x"
limits = { lower = -1.0, upper = 1.0, velocity = 2.0, effort = 50.0 }
"#;

    fn scratch(name: &str, text: &str) -> PathBuf {
        let path = std::env::temp_dir().join(format!("straightline-expansion-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        std::fs::write(path.join("cart.toml"), text).unwrap();
        path.canonicalize().unwrap()
    }

    #[test]
    fn the_first_directory_that_has_the_file_counts() {
        let here = scratch("found", CART);
        let expansion = expand("cart.toml", &[Path::new("/nowhere"), &here], &Options::default());
        assert_eq!(expansion.file, Some(here.join("cart.toml")));
        let items = associated_items(&expansion.result.unwrap());
        assert!(items.contains("pub const EFFORT_LIMITS: [f64; 1] = dynamics::EFFORT_LIMITS;"), "{items}");
        assert!(items.contains("pub fn mass_matrix(q: &[f64; 1], h: &mut [[f64; 1]; 1]) {"), "{items}");
    }

    #[test]
    fn a_missing_file_is_answered_with_every_path_that_was_tried() {
        let directories = [Path::new("/nowhere"), Path::new("/nowhere/src")];
        let expansion = expand("cart.toml", &directories, &Options::default());
        assert_eq!(expansion.file, None);
        assert_eq!(
            expansion.result.unwrap_err(),
            "there is no robot file `cart.toml`; tried:\n  /nowhere/cart.toml\n  /nowhere/src/cart.toml\n\
             help: the path counts from the package's manifest, or else from the source file"
        );
    }

    #[test]
    fn a_wrong_file_is_shown_at_the_place_and_stays_an_input() {
        let here = scratch("wrong", &CART.replace("2.0", "-2.0"));
        let expansion = expand("cart.toml", &[&here], &Options::default());
        assert_eq!(expansion.file, Some(here.join("cart.toml")));
        let message = expansion.result.unwrap_err();
        assert!(message.starts_with("the robot file is wrong\nerror[negative-mass]: "), "{message}");
        assert!(message.contains("--> cart.toml:10:8\n") && message.contains("| mass = -2.0"), "{message}");
    }
}
