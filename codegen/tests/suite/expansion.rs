//! What the macros stand on: files looked for, items of a type, complaints as they are shown.

use std::path::{Path, PathBuf};
use straightline_codegen::diagnostic::Front;
use straightline_codegen::fronts::expansion::{expand, SceneOf};
use straightline_codegen::options::{GivenOptions, OptionValue};
use straightline_codegen::Source;

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
    let expansion = expand("cart.toml", None, &[Path::new("/nowhere"), &here], &GivenOptions::default());
    assert_eq!(expansion.files, [here.join("cart.toml")]);
    let items = expansion.result.unwrap().1;
    assert!(items.contains("pub const EFFORT_LIMITS: [f64; 1] = dynamics::EFFORT_LIMITS;"), "{items}");
    assert!(items.contains("pub fn mass_matrix(q: &[f64; 1], h: &mut [[f64; 1]; 1]) {"), "{items}");
    assert!(items.contains("#[doc(alias(\"CRBA\", "), "{items}");
}

/// A robot file includes what stands beside it, wherever the compiler of Rust runs.
#[test]
fn files_that_a_robot_file_names_stand_beside_it_and_are_known() {
    let here = scratch("included", CART);
    let part =
        "<mujocoinclude><body name=\"a\"><joint name=\"j\"/><geom size=\"0.1\" pos=\"1 0 0\"/></body></mujocoinclude>";
    std::fs::write(here.join("part.xml"), part).unwrap();
    std::fs::write(here.join("arm.xml"), "<mujoco><worldbody><include file=\"part.xml\"/></worldbody></mujoco>")
        .unwrap();
    let own = || expand("arm.xml", None, &[&here], &GivenOptions::default());
    let expansion = own();
    assert_eq!(expansion.files, [here.join("arm.xml"), here.join("part.xml")]);
    assert!(expansion.result.is_ok());
    // what is wrong there is wrong with the robot, and named as the robot file is
    std::fs::write(here.join("part.xml"), part.replace("0.1", "0,1")).unwrap();
    let expansion = own();
    assert_eq!(expansion.files, [here.join("arm.xml"), here.join("part.xml")]);
    let message = expansion.result.unwrap_err().message;
    assert!(message.starts_with("the robot file is wrong\n"), "{message}");
    assert!(message.contains("--> part.xml:1:"), "{message}");
}

#[test]
fn frames_are_constants_and_pose_asks_for_poses_of_all_frames() {
    let here = scratch("frames", CART);
    let items = |frames: &[&str], scene: &str| {
        std::fs::write(here.join("scene.toml"), scene).unwrap();
        let scene = SceneOf::File("scene.toml".into());
        let mut options = GivenOptions::default();
        options.set("frames", OptionValue::of_words(frames.iter().copied()), Front::Derive).unwrap();
        expand("cart.toml", Some(&scene), &[&here], &options).result.unwrap().1
    };
    let pose = "pub fn pose<__T: Copy>(x: &[[__T; 12]; 2], frame: ::straightline::FrameIndex<Self>)";
    let all = items(&["rail", "cart"], "");
    for (name, index) in [("RAIL", 0), ("CART", 1)] {
        let constant = "::straightline::FrameIndex<Self> = ::straightline::FrameIndex::new";
        assert!(all.contains(&format!("pub const {name}: {constant}({index});")), "{all}");
    }
    assert!(all.contains(pose), "{all}");
    for scene in [
        "[outputs]\nforward_kinematics = { frames = [\"cart\", \"rail\"] }\n",
        "[outputs]\nforward_kinematics = { part = \"linear\" }\n",
        "[outputs]\nfunctions = [\"frame_velocity\"]\n",
    ] {
        let some = items(&["rail", "cart"], scene);
        assert!(some.contains("pub const CART: ") && !some.contains("fn pose"), "{some}");
    }
}

#[test]
fn a_missing_file_is_answered_with_every_path_that_was_tried() {
    let directories = [Path::new("/nowhere"), Path::new("/nowhere/src")];
    let expansion = expand("cart.toml", None, &directories, &GivenOptions::default());
    assert!(expansion.files.is_empty());
    assert_eq!(
        expansion.result.unwrap_err().message,
        "there is no robot file `cart.toml`; tried:\n  /nowhere/cart.toml\n  /nowhere/src/cart.toml\n\
         help: the path counts from the package's manifest, or else from the source file"
    );
}

#[test]
fn a_wrong_file_is_shown_at_the_place_and_stays_an_input() {
    let here = scratch("wrong", &CART.replace("2.0", "-2.0"));
    let expansion = expand("cart.toml", None, &[&here], &GivenOptions::default());
    assert_eq!(expansion.files, [here.join("cart.toml")]);
    let message = expansion.result.unwrap_err().message;
    assert!(message.starts_with("the robot file is wrong\nerror[negative-mass]: "), "{message}");
    assert!(message.contains("--> cart.toml:10:8\n") && message.contains("| mass = -2.0"), "{message}");
}

#[test]
fn a_scene_is_an_input_too_and_its_complaints_have_their_place() {
    let here = scratch("scene", CART);
    let scene = |text: &str| {
        std::fs::write(here.join("scene.toml"), text).unwrap();
        expand("cart.toml", Some(&SceneOf::File("scene.toml".into())), &[&here], &GivenOptions::default())
    };
    let expansion = scene("[outputs]\nmass_matrix = { part = \"diagonal\" }\n");
    assert_eq!(expansion.files, [here.join("cart.toml"), here.join("scene.toml")]);
    let items = expansion.result.unwrap().1;
    assert!(items.contains("pub fn mass_matrix(q: &[f64; 1], h: &mut [f64; 1])"), "{items}");
    assert!(!items.contains("pub fn inverse_dynamics"));

    for (text, place) in
        [("[zero]\nqdot = true\n", "scene.toml:2:1"), ("[hold]\njoints = { slid = 0 }\n", "scene.toml:2:12")]
    {
        let expansion = scene(text);
        assert_eq!(expansion.files.len(), 2);
        let message = expansion.result.unwrap_err().message;
        assert!(message.starts_with("the scene is wrong\nerror[") && message.contains(place), "{message}");
    }
    let none = SceneOf::File("none.toml".into());
    let message = expand("cart.toml", Some(&none), &[&here], &GivenOptions::default()).result.unwrap_err().message;
    assert!(message.starts_with("there is no scene file `none.toml`"), "{message}");
}

#[test]
fn complaints_of_a_scene_in_the_macro_are_kept_apart() {
    let here = scratch("within", CART);
    let scene = |text: &str| {
        let scene = SceneOf::Macro(Source::new("scene(..)", text));
        expand("cart.toml", Some(&scene), &[&here], &GivenOptions::default())
    };
    let expansion = scene("[zero]\nqd = true\n");
    assert_eq!(expansion.files, [here.join("cart.toml")]);
    assert!(!expansion.result.unwrap().1.contains("qd: &"));
    for (text, code) in [("[zero]\nqdot = true\n", "unknown-key"), ("[hold]\njoints = { slid = 0 }\n", "unknown-joint")]
    {
        let refusal = scene(text).result.unwrap_err();
        let codes: Vec<&str> = refusal.of_scene.iter().map(|d| d.code).collect();
        assert_eq!((refusal.message.as_str(), &codes[..]), ("", &[code][..]));
    }
    // both wrong: each said once
    std::fs::write(here.join("cart.toml"), CART.replace("2.0", "-2.0")).unwrap();
    let refusal = scene("[zero]\nqd = true\n").result.unwrap_err();
    assert!(refusal.message.starts_with("the robot file is wrong\nerror[negative-mass]"), "{}", refusal.message);
}
