//! What a report says is so: savings add up, what a scene skips is absent from the text, pages are well-formed.

use crate::made::Made;
use serde_json::Value;
use std::collections::BTreeSet;
use straightline_cli::html;
use straightline_codegen::compile::{compile, explain};
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::emit::Generated;
use straightline_codegen::options::scene_file;
use straightline_codegen::options::Options;
use straightline_codegen::report::waterfall::By;
use straightline_codegen::scene::{Budget, Gravity, Parameter, Scene, Selection, Zero};
use straightline_codegen::{Function, Grade};

const ARM: &str = include_str!("../../../tests/files/arm.toml");
const BRANCHED: &str = include_str!("../../../tests/files/branched.toml");

fn source(text: &str) -> Source {
    Source::new("robot.toml", text)
}

fn options(scene: Scene) -> Options {
    Options { scene, ..Options::default() }
}

/// The robot of a text with what its waterfall says, made once.
#[track_caller]
fn explained(text: &str, options: &Options) -> Generated {
    static MADE: Made<Generated> = Made::nothing();
    let key = format!("{options:?} {text}");
    MADE.once(key, || explain(&source(text), options).unwrap_or_else(|errors| panic!("{errors}")))
}

/// Its generated file without that, made once.
#[track_caller]
fn text_of(text: &str, options: &Options) -> String {
    static MADE: Made<String> = Made::nothing();
    let key = format!("{options:?} {text}");
    MADE.once(key, || compile(&source(text), options).unwrap_or_else(|errors| panic!("{errors}")).text)
}

fn scene_of(text: &str) -> Scene {
    let mut diagnostics = Diagnostics::new();
    let file = scene_file::read(&Source::new("scene.toml", text), &mut diagnostics);
    file.unwrap_or_else(|| panic!("{diagnostics}")).scene
}

/// A bit of everything for the branched robot.
fn crowded() -> Scene {
    scene_of(
        r#"
        [outputs]
        functions = ["inverse_dynamics", "forward_dynamics", "gravity_force"]
        mass_matrix = { part = "diagonal" }
        velocity_force = { joints = ["elbow"] }
        [hold]
        gravity = "input"
        joints = { wrist = 0.3, head = -0.2 }
        [zero]
        joints_at_rest = ["shoulder"]
        [effects]
        damping = false
        springs = false
        coulomb = "off"
        [[payload]]
        name = "camera"
        frame = "hand"
        mass = 0.2
        com = [0.01, 0.02, 0.03]
        inertia = { xx = 2e-4, yy = 3e-4, zz = 2e-4 }
        [[parameter]]
        kind = "payload"
        name = "tool"
        frame = "hand"
        "#,
    )
}

/// The words and numbers of generated code, without comments.
fn tokens(text: &str) -> BTreeSet<String> {
    let code = text.lines().map(|line| line.split("//").next().unwrap_or(""));
    let words = code.flat_map(|line| line.split(|c: char| !(c.is_alphanumeric() || c == '_' || c == '.')));
    words.filter(|word| !word.is_empty()).map(str::to_string).collect()
}

/// The functions of a generated file, without the kernel behind them.
fn functions(text: &str) -> &str {
    text.split("\nmod trig {").next().unwrap_or(text)
}

#[test]
fn savings_add_up() {
    let scenes =
        [Scene::default(), crowded(), Scene { zero: Zero { qd: true, ..Zero::default() }, ..Scene::default() }];
    for (scene, grade) in scenes.into_iter().flat_map(|s| [(s.clone(), Grade::Exact), (s, Grade::Algebraic)]) {
        let generated = explained(BRANCHED, &Options { grade, ..options(scene.clone()) });
        for (name, f) in &generated.report.functions {
            let waterfall = f.waterfall.as_ref().expect("it was asked for");
            let sum = |by: &[By]| -> (i64, i64) {
                let savings = waterfall.savings.iter().filter(|s| by.contains(&s.by));
                savings.fold((0, 0), |(a, b), s| (a + s.operations, b + s.sincos))
            };
            let (plain, full) = (waterfall.plain, waterfall.full);
            let from_plain = |(flops, pairs): (i64, i64)| (plain.flops() as i64 + flops, plain.sin_cos as i64 + pairs);
            assert_eq!(from_plain(sum(&[By::Compiler])), (full.flops() as i64, full.sin_cos as i64), "{name}");
            let here = (f.flops() as i64, f.sincos as i64);
            assert_eq!(from_plain(sum(&[By::Compiler, By::Scene])), here, "{name}");
            if let Some(last) = waterfall.savings.last() {
                assert_eq!((last.after.mul, last.after.add, last.after.sin_cos), (f.mul, f.add, f.sincos), "{name}");
            }
            let is_empty = scene.is_empty();
            assert!(!is_empty || waterfall.of_scene().next().is_none(), "{name}: nothing is skipped without a scene");
        }
    }
}

#[test]
#[ignore = "slow proof: compiles every scene twice"]
fn slow_proof_that_full_counts_are_those_of_the_robot_without_a_scene() {
    // the same frames: the robot's tips are others when joints are locked
    let with = |scene| Options { frames: vec!["finger".to_string()], ..options(scene) };
    let all = explained(BRANCHED, &with(Scene::default()));
    let part = explained(BRANCHED, &with(crowded()));
    for (name, f) in &part.report.functions {
        let full = part.report.functions[name].waterfall.as_ref().map(|w| (w.full.mul, w.full.add, w.full.sin_cos));
        let whole = &all.report.functions[name];
        assert_eq!(full, Some((whole.mul, whole.add, whole.sincos)), "{name}");
        assert!(f.flops() > 0);
    }
}

#[test]
fn every_item_of_a_scene_is_named_with_what_it_changes() {
    let generated = explained(BRANCHED, &options(crowded()));
    let of = |name: &str| -> Vec<String> {
        let waterfall = generated.report.functions[name].waterfall.as_ref().unwrap();
        waterfall.of_scene().map(|s| s.what.clone()).collect()
    };
    for what in [
        "gravity as an input",
        "wrist",
        "head",
        "shoulder at rest",
        "no viscous friction",
        "no springs",
        "payload tool on hand at run time",
    ] {
        assert!(of("inverse_dynamics").iter().any(|w| w.contains(what)), "{what}: {:?}", of("inverse_dynamics"));
    }
    assert!(of("mass_matrix").contains(&"only the diagonal".to_string()), "{:?}", of("mass_matrix"));
    assert!(of("velocity_force").contains(&"only joint elbow".to_string()), "{:?}", of("velocity_force"));
    // and in the header of the file
    for line in ["// What this scene skips", "//     ", "payload tool on hand at run time", "  only the diagonal"] {
        assert!(generated.text.contains(line), "{line}:\n{}", &generated.text[..4000]);
    }
    assert!(!text_of(BRANCHED, &Options::default()).contains("What this scene skips"));
}

#[test]
fn neighbours_that_are_locked_are_one_item() {
    let locked = ["shoulder", "lift"].map(|joint| (joint.to_string(), 0.1)).to_vec();
    let generated = explained(ARM, &options(Scene { locked, ..Scene::default() }));
    let waterfall = generated.report.functions["inverse_dynamics"].waterfall.as_ref().unwrap();
    let what: Vec<&str> = waterfall.of_scene().map(|s| s.what.as_str()).collect();
    assert_eq!(what, ["joints shoulder, lift locked"]);
}

#[test]
fn the_json_has_its_fields() {
    let generated = explained(BRANCHED, &options(crowded()));
    let json: Value = serde_json::to_value(&generated.report).unwrap();
    let f = &json["functions"]["inverse_dynamics"];
    for key in [
        "mul",
        "add",
        "fma",
        "div",
        "sqrt",
        "sincos",
        "max_live",
        "carried_bytes",
        "stack_bytes",
        "code_bytes",
        "parts",
        "lines",
    ] {
        assert!(f[key].is_u64(), "{key}");
    }
    for (counts, key) in
        ["plain", "full"].iter().flat_map(|c| ["mul", "add", "fma", "div", "sqrt", "sincos"].map(|k| (c, k)))
    {
        assert!(f[counts][key].is_u64(), "{counts}.{key}");
    }
    let savings = f["savings"].as_array().unwrap();
    assert!(savings.len() > 5, "{savings:?}");
    for saving in savings {
        assert!(saving["what"].is_string() && ["compiler", "scene"].contains(&saving["by"].as_str().unwrap()));
        assert!(saving["operations"].is_i64() && saving["sincos"].is_i64() && saving["after"]["mul"].is_u64());
    }
    let stages: Vec<&str> =
        json["staged"]["stages"].as_array().unwrap().iter().map(|s| s["name"].as_str().unwrap()).collect();
    assert_eq!(stages, ["Parameters", "Configuration", "Velocity"]);
}

#[test]
fn no_gravity_leaves_nothing_of_it() {
    let robot = |g: &str| ARM.replace("gravity = [0.0, 0.0, -9.81]", &format!("gravity = {g}"));
    let wanted = vec![Function::InverseDynamics, Function::ForwardDynamics, Function::BiasForce];
    let with = |gravity| Options { functions: wanted.clone(), ..options(Scene { gravity, ..Scene::default() }) };
    let weightless = with(Gravity::Constant([0.0; 3]));
    let earth = text_of(&robot("[0.0, 0.0, -9.81]"), &weightless);
    // not one constant comes from it: the same code for any other gravity
    let moon = text_of(&robot("[0.1, 0.2, -1.62]"), &weightless);
    assert_eq!(tokens(&earth), tokens(&moon));
    assert!(!tokens(&earth).contains("gravity") && !tokens(&earth).iter().any(|t| t.starts_with("9.81")));
    assert_ne!(tokens(&earth), tokens(&text_of(&robot("[0.0, 0.0, -9.81]"), &with(Gravity::OfRobot))));
    assert!(tokens(&text_of(ARM, &with(Gravity::Input))).contains("gravity"));
}

#[test]
fn at_rest_no_velocity_is_read() {
    let zero = Zero { qd: true, qdd: true, joints_at_rest: Vec::new() };
    // forward dynamics puts out a qdd
    let functions = Function::all().filter(|f| *f != Function::ForwardDynamics).collect();
    let text = text_of(BRANCHED, &Options { functions, ..options(Scene { zero, ..Scene::default() }) });
    for gone in ["qd", "qdd", "signum"] {
        assert!(!tokens(&text).contains(gone), "{gone}");
    }
    assert!(tokens(&text_of(BRANCHED, &Options::default())).contains("qd"));
}

#[test]
fn a_locked_joint_has_no_sine_and_no_coordinate() {
    let calls = |text: &str| tokens(functions(text)).iter().filter(|t| t.starts_with("sin_q")).count();
    let wanted = |scene| Options { functions: vec![Function::InverseDynamics], ..options(scene) };
    let free = text_of(BRANCHED, &wanted(Scene::default()));
    let locked = vec![("elbow".to_string(), 0.4), ("wrist".to_string(), 0.3)];
    let held = text_of(BRANCHED, &wanted(Scene { locked, ..Scene::default() }));
    assert_eq!(calls(&held) + 2, calls(&free));
    assert!(tokens(&free).contains("elbow") && !tokens(&held).contains("elbow") && !tokens(&held).contains("wrist"));
    assert!(held.contains("pub const NV: usize = 4;"));
}

#[test]
fn what_is_not_asked_for_is_not_written() {
    let text = text_of(BRANCHED, &options(Scene { zero: Zero { qd: true, ..Zero::default() }, ..Scene::default() }));
    // h at rest is gravity's and the springs' alone; what velocities make is zero
    let start = text.find("pub fn velocity_force").expect("the function is there");
    let body = &text[start..][..text[start..].find("\n}").expect("it ends")];
    assert!(!body.contains(['*', '+', '-']), "{body}");
    let one = Options { functions: vec![Function::GravityForce], ..Options::default() };
    for function in Function::all().filter(|f| *f != Function::GravityForce) {
        assert!(!tokens(&text_of(BRANCHED, &one)).contains(function.name()));
    }
    let selected = Selection { joints: vec!["grip".to_string()], ..Selection::default() };
    let scene = Scene { outputs: [(Function::MassMatrix, selected)].into(), ..Scene::default() };
    let part = explained(BRANCHED, &Options { functions: vec![Function::MassMatrix], ..options(scene) });
    assert!(part.report.functions["mass_matrix"].waterfall.as_ref().unwrap().of_scene().all(|s| s.operations < 0));
}

#[test]
fn a_scene_that_needs_nothing_emits_nothing() {
    let tool = Parameter::Payload { name: "tool".to_string(), frame: "hand".to_string() };
    let scene = Scene { parameters: vec![tool], ..Scene::default() };
    let nothing = text_of(BRANCHED, &Options { functions: Vec::new(), ..options(scene.clone()) });
    for token in ["fn", "mod", "struct", "Cost", "Tool"] {
        assert!(!tokens(&nothing).contains(token), "{token}:\n{nothing}");
    }
    // a parameter that no function reads has no type
    let poses = text_of(BRANCHED, &Options { functions: vec![Function::ForwardKinematics], ..options(scene.clone()) });
    assert!(!tokens(&poses).contains("Tool"));
    let torques = text_of(BRANCHED, &Options { functions: vec![Function::GravityForce], ..options(scene) });
    assert!(tokens(&torques).contains("Tool"));
}

#[test]
fn all_exceeded_budgets_are_said_at_once_and_kept_ones_are_silent() {
    let budget = |flops| Budget { max_flops: Some(flops), ..Budget::default() };
    let budgets = [
        (Function::InverseDynamics, Budget { max_sincos: Some(0), max_live: Some(1), ..budget(5) }),
        (Function::GravityForce, budget(5)),
        (Function::MassMatrix, budget(100_000)),
    ];
    let scene = Scene { budgets: budgets.into(), ..Scene::default() };
    let of = |functions: &[Function], scene| Options { functions: functions.to_vec(), ..options(scene) };
    let three = [Function::InverseDynamics, Function::GravityForce, Function::MassMatrix];
    let errors =
        compile(&source(BRANCHED), &of(&three, scene)).expect_err("three budgets are exceeded for one function");
    let over: Vec<_> = errors.iter().filter(|d| d.code == "over-budget").collect();
    assert_eq!(over.len(), 4, "{errors}");
    assert!(over.iter().all(|d| !d.title.contains("mass_matrix") && d.help.contains('−')), "{errors}");
    let exact = explained(BRANCHED, &Options::default());
    let flops = exact.report.functions["inverse_dynamics"].flops();
    let at = |flops| Scene { budgets: [(Function::InverseDynamics, budget(flops))].into(), ..Scene::default() };
    assert!(compile(&source(BRANCHED), &of(&three[..1], at(flops))).is_ok());
    assert!(compile(&source(BRANCHED), &of(&three[..1], at(flops - 1))).is_err());
}

#[test]
fn a_page_is_well_formed_and_needs_no_network() {
    for (robot, scene) in [(ARM, Scene::default()), (BRANCHED, Scene::default()), (BRANCHED, crowded())] {
        let options = options(scene);
        let page = html::page(&source(robot), &options, &explained(robot, &options));
        let parsing = roxmltree::ParsingOptions { allow_dtd: true, ..Default::default() };
        let document = roxmltree::Document::parse_with_options(&page, parsing).expect("the page is well-formed XML");
        for node in document.descendants().filter(roxmltree::Node::is_element) {
            let loads = ["script", "link", "img", "iframe", "object", "embed", "image", "use"];
            assert!(!loads.contains(&node.tag_name().name()), "{:?}", node.tag_name());
            for attribute in node.attributes() {
                let name = attribute.name();
                assert!(!["src", "href", "srcset", "data"].contains(&name) && !name.starts_with("on"), "{name}");
            }
        }
        let style = document.descendants().find(|n| n.has_tag_name("style")).and_then(|n| n.text().map(str::to_string));
        let style = style.expect("the style is in the page");
        assert!(!style.contains("url(") && !style.contains("@import") && style.contains("prefers-color-scheme: dark"));
        let addresses = page.replace("http://www.w3.org/1999/xhtml", "");
        assert!(!addresses.contains("://"), "no address but the namespace");
        let text: String = document.descendants().filter_map(|n| n.text()).collect();
        for function in Function::all() {
            assert!(text.contains(function.name()), "{}", function.name());
        }
    }
}

#[test]
fn a_page_is_the_same_wherever_the_files_stand() {
    let options = Options { functions: vec![Function::InverseDynamics], ..options(crowded()) };
    let page = |path: &str| {
        let source = Source::new(path, BRANCHED);
        html::page(&source, &options, &explain(&source, &options).unwrap())
    };
    assert_eq!(page("branched.toml"), page("/some/where/else/branched.toml"));
}

#[test]
fn names_cannot_leave_their_place_in_a_page() {
    let evil = "</title><script>alert('x')</script>&\\\"";
    let robot = BRANCHED
        .replace("name = \"elbow\"", &format!("name = \"{evil}\""))
        .replace("name = \"branched\"", &format!("name = \"{evil}\""));
    let options = Options { functions: vec![Function::InverseDynamics, Function::MassMatrix], ..Options::default() };
    let page = html::page(&source(&robot), &options, &explained(&robot, &options));
    assert!(!page.contains("<script") && page.contains("&lt;script&gt;alert(&#39;x&#39;)"));
    let parsing = roxmltree::ParsingOptions { allow_dtd: true, ..Default::default() };
    roxmltree::Document::parse_with_options(&page, parsing).expect("the page is well-formed XML");
}

#[test]
fn a_page_says_which_angles_are_exact_and_where_they_stand() {
    let robot = ARM.replace("rpy_quarter_turns = [1, 0, 0]", "rpy = [1.5707963267948966, 0, 0]");
    let options = Options { functions: vec![Function::InverseDynamics], ..Options::default() };
    let page = html::page(&source(&robot), &options, &explained(&robot, &options));
    let line = robot.lines().position(|l| l.contains("1.5707963267948966")).unwrap() + 1;
    assert!(page.contains(&format!("robot.toml:{line}:")), "line {line}");
    assert!(page.contains("π/2") && page.contains("1.5707963267948966"));
}
