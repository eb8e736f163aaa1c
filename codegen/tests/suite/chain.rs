//! A chain of three joints about all axes, for tests of its drives.

use straightline_codegen::Source;

/// What the last link has where nothing else is said.
pub const LAST_LINK: &str = "mass = 0.7\ncom = [0.02, 0.05, 0.03]\ninertia = [0.003, 0.004, 0.002]";

/// The chain `arm.toml` with joints `one`, `two` and `three`; `last_link`: the lines of the last link; `drives`: the file's last lines.
pub fn arm(last_link: &str, drives: &str) -> Source {
    let link = |name: &str, inertial: &str| format!("[[link]]\nname = \"{name}\"\n{inertial}\n");
    let joint = |name: &str, parent: &str, child: &str, rest: &str| {
        format!(
            "[[joint]]\nname = \"{name}\"\nkind = \"continuous\"\nparent = \"{parent}\"\nchild = \"{child}\"\n{rest}\n"
        )
    };
    let text = [
        "[robot]\nname = \"arm\"\n".to_string(),
        link("base", ""),
        link("a", "mass = 2.5\ncom = [0.1, 0.01, 0.2]\ninertia = [0.02, 0.021, 0.004]"),
        link("b", "mass = 1.5\ncom = [0.03, 0.02, 0.1]\ninertia = [0.01, 0.011, 0.002]"),
        link("c", last_link),
        joint("one", "base", "a", "axis = \"y\""),
        joint("two", "a", "b", "origin = { xyz = [0.1, -0.2, 0.4] }\naxis = [0.6, 0.0, 0.8]"),
        joint("three", "b", "c", "origin = { xyz = [0.0, 0.1, 0.3] }\naxis = \"x\""),
        drives.to_string(),
    ];
    Source::new("arm.toml", text.concat())
}
