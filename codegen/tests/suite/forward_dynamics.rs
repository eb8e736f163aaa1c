//! What the compiler demands of a robot before it writes its forward dynamics, and which method it writes.

use straightline_codegen::certify::Effort;
use straightline_codegen::diagnostic::Diagnostics;
use straightline_codegen::emit::Generated;
use straightline_codegen::equations::forward_method::{MethodChoice, TOLERATED};
use straightline_codegen::expr::Grade;
use straightline_codegen::model::singular::{singular_joints, Inertia};
use straightline_codegen::model::{load, ModelOptions};
use straightline_codegen::options::scene_file::read;
use straightline_codegen::{compile, Function, Options, Scalar, Source};

/// A chain of revolute joints in TOML: per link its joint's origin, its axis and its inertial lines.
fn chain(links: &[([f64; 3], [f64; 3], &str)]) -> Source {
    let mut text = String::from("[robot]\nname = \"chain\"\n[[link]]\nname = \"base\"\n");
    for (i, (xyz, axis, inertial)) in links.iter().enumerate() {
        let parent = if i == 0 { "base".to_string() } else { format!("link{i}") };
        let child = i + 1;
        text += &format!(
            "[[link]]\nname = \"link{child}\"\n{inertial}\n[[joint]]\nname = \"joint{child}\"\nkind = \"continuous\"\n\
             parent = \"{parent}\"\nchild = \"link{child}\"\norigin = {{ xyz = {xyz:?} }}\naxis = {axis:?}\n"
        );
    }
    Source::new("chain.toml", text)
}

const BODY: &str = "mass = 1.0\ncom = [0.1, 0.02, -0.03]\ninertia = [0.02, 0.03, 0.025]";
const MASSLESS: &str = "";
const POINT_ON_AXIS: &str = "mass = 1.0\ncom = [0.0, 0.0, 0.3]\ninertia = [0.0, 0.0, 0.0]";
const X: [f64; 3] = [1.0, 0.0, 0.0];
const Y: [f64; 3] = [0.0, 1.0, 0.0];
const Z: [f64; 3] = [0.0, 0.0, 1.0];
const OFF: [f64; 3] = [0.3, 0.1, 0.0];
const HERE: [f64; 3] = [0.0, 0.0, 0.0];

/// The joints that cannot have forward dynamics, by name.
fn singular(source: &Source) -> Vec<String> {
    let (model, diagnostics) = load(source, &ModelOptions::default());
    let model = model.unwrap_or_else(|| panic!("{diagnostics}"));
    singular_joints(&model, Inertia::OfLinks).into_iter().map(|b| model.bodies[b].joint.name.clone()).collect()
}

#[test]
fn joints_that_feel_no_inertia_are_found() {
    assert_eq!(singular(&chain(&[(OFF, Z, BODY), (OFF, Y, BODY)])), [""; 0]);
    // nothing at the tip
    assert_eq!(singular(&chain(&[(OFF, Z, BODY), (OFF, Y, MASSLESS)])), ["joint2"]);
    // a point mass on the axis
    assert_eq!(singular(&chain(&[(OFF, Y, BODY), (OFF, Z, POINT_ON_AXIS)])), ["joint2"]);
    // a massless link in the middle is no fault where the next joint is elsewhere ...
    assert_eq!(singular(&chain(&[(OFF, Z, BODY), (OFF, Y, MASSLESS), (OFF, Y, BODY)])), [""; 0]);
    // ... and one where both turn about one axis
    assert_eq!(singular(&chain(&[(OFF, Z, BODY), (OFF, Y, MASSLESS), (HERE, Y, BODY)])), ["joint2"]);
    // a wrist of three axes about a point mass: whatever turns, it stays
    let in_the_centre = "mass = 1.0\ncom = [0.0, 0.0, 0.0]\ninertia = [0.0, 0.0, 0.0]";
    let wrist = [(OFF, Z, BODY), (OFF, X, MASSLESS), (HERE, Y, MASSLESS), (HERE, Z, in_the_centre)];
    assert_eq!(singular(&chain(&wrist)), ["joint2", "joint3", "joint4"]);
}

/// Elimination of a thousand rows in double-double takes seconds, of ten thousand, which a robot may have, hours: here, and only here, it takes
/// none.
#[test]
fn a_chain_of_a_thousand_joints_is_checked_link_by_link() {
    let light = "mass = 1e-3\ncom = [0.1, 0.0, 0.02]\ninertia = [1e-6, 2e-6, 2e-6]";
    let link = |k: usize| if k.is_multiple_of(3) { (OFF, X, light) } else { (OFF, Z, BODY) };
    assert_eq!(singular(&chain(&(0..1000).map(link).collect::<Vec<_>>())), [""; 0]);
    // of few joints it is the same with and without a link that takes elimination
    let few: Vec<_> = (0..12).map(link).collect();
    assert_eq!(singular(&chain(&few)), [""; 0]);
    let with_none = [&few[..], &[(OFF, Y, MASSLESS), (OFF, X, BODY), (HERE, X, MASSLESS)]].concat();
    assert_eq!(singular(&chain(&with_none)), ["joint15"]);
}

#[test]
fn tips_a_million_million_times_lighter_are_no_fault() {
    let light = "mass = 1e-12\ncom = [0.1, 0.02, -0.03]\ninertia = [0.02e-12, 0.03e-12, 0.025e-12]";
    assert_eq!(singular(&chain(&[(OFF, Z, BODY), (OFF, Y, light)])), [""; 0]);
    assert_eq!(singular(&chain(&[(OFF, Z, light), (OFF, Y, BODY)])), [""; 0]);
}

#[test]
fn forward_dynamics_of_a_joint_without_inertia_is_an_error_with_place_and_remedy() {
    let source = chain(&[(OFF, Z, BODY), (OFF, Y, MASSLESS)]);
    let errors = compile(&source, &Options::default()).expect_err("nothing resists the second joint");
    let error = errors.iter().find(|d| d.code == "no-forward-dynamics").unwrap_or_else(|| panic!("{errors}"));
    let line = error.place.as_ref().expect("a place").line;
    let joint2 = source.text().lines().position(|l| l == "name = \"joint2\"").expect("it is there") + 1;
    assert_eq!(line, joint2, "{errors}");
    assert!(error.help.contains("rotor") && error.help.contains("forward_dynamics"), "{errors}");
    // either remedy will do
    let functions: Vec<Function> = Function::all().filter(|f| *f != Function::ForwardDynamics).collect();
    assert!(compile(&source, &Options { functions, ..Options::default() }).is_ok());
    let with_rotor = Source::new("chain.toml", format!("{}armature = 1e-4\n", source.text()));
    assert!(compile(&with_rotor, &Options::default()).is_ok());
}

/// A base of 1 kg on which 3.5e20 kg slide: what the base feels along the slide is a difference that f64 has no digit of.
#[test]
fn a_joint_whose_inertia_is_lost_beside_what_it_moves_is_refused_at_its_place() {
    let text = "[robot]\nname = \"sledge\"\n\n[[link]]\nname = \"base\"\nmass = 1.0\ncom = [0.0, 0.0, 0.0]\n\
                inertia = [0.01, 0.01, 0.01]\n\n[[link]]\nname = \"planet\"\nmass = 3.5e20\ncom = [0.1, -0.2, 0.05]\n\
                inertia = [3.5e18, 3.5e18, 3.5e18]\n\n[[joint]]\nname = \"slide\"\nkind = \"prismatic\"\nparent = \"base\"\n\
                child = \"planet\"\norigin = { xyz = [-0.5, 0.0, 0.0], rpy = [0.3, 0.2, 0.1] }\naxis = [0.0, 0.0, 1.0]\n";
    let floating = ModelOptions { floating_base: true, ..ModelOptions::default() };
    let refused = [Scalar::F64, Scalar::F32].map(|scalar| {
        let options = Options { scalar, model: floating.clone(), ..Options::default() };
        let errors = match compile(&Source::new("sledge.toml", text), &options) {
            Err(errors) => errors,
            Ok(made) => {
                // folded in double-double its constants lose what cancels by chance where they are rounded one by one
                let plainer = made.warnings.iter().find(|d| d.code == "plainer-form").expect("it is said");
                assert!(plainer.detail.contains("without “constants folded in double-double”"), "{plainer:?}");
                return 0;
            }
        };
        assert!(errors.iter().all(|d| d.code != "internal-disagreement"), "{errors}");
        let Some(error) = errors.iter().find(|d| d.code == "no-forward-dynamics") else { return 0 };
        assert_eq!(error.place.as_ref().map(|p| p.line), Some(5), "{errors}");
        assert!(error.title.contains(scalar.name()) && error.title.contains("of the inertia"), "{errors}");
        assert!(error.help.contains("kg") && error.help.contains("forward_dynamics"), "{errors}");
        1
    });
    assert!(refused.contains(&1), "{refused:?}");
}

/// By exact rules constants are rounded on the way: what is certified of such a program would not be certified of the robot.
#[test]
fn no_bound_is_certified_where_constants_are_rounded_one_by_one() {
    let text = |grade| {
        let options = Options {
            grade,
            functions: vec![Function::GravityForce, Function::ForwardDynamics],
            certify: Some(Effort::new(Some(1), None, true)),
            ..Options::default()
        };
        compile(&chain(&[(OFF, Z, BODY), (OFF, Y, BODY)]), &options).unwrap_or_else(|d| panic!("{d}")).text
    };
    let (exact, other) = (text(Grade::Exact), text(Grade::Algebraic));
    for bound in ["GRAVITY_FORCE_ERROR_BOUND: ", "fn gravity_force_error_bound", "fn forward_dynamics_error_bound"] {
        assert!(other.contains(bound) && !exact.contains(bound), "{bound}");
    }
    assert!(exact.contains("its constants are rounded one by one"), "{exact}");
}

/// What the compiler makes of a robot in a scene.
fn compiled(robot: &Source, scene: &str) -> Result<Generated, Diagnostics> {
    let mut diagnostics = Diagnostics::new();
    let file = read(&Source::new("scene.toml", scene), &mut diagnostics);
    let file = file.unwrap_or_else(|| panic!("{}", diagnostics.render()));
    compile(robot, &file.into_options(Options::default()))
}

/// The titles of the complaints with a code.
fn titles(diagnostics: &Diagnostics, code: &str) -> Vec<String> {
    diagnostics.iter().filter(|d| d.code == code).map(|d| d.title.clone()).collect()
}

const CONTACT: &str =
    "[[contact]]\nname = \"foot\"\nframe = \"link2\"\nobject = { origin = [0.0, 0.0, 0.0], z = [0.0, 0.0, 1.0] }\n\
                       constrained = [\"pz\"]\n";

#[test]
fn contact_modes_divide_by_inertia_too() {
    // whatever nothing resists: a tip, a root that floats without any mass, a joint whose inertia is rounding
    let tip = chain(&[(OFF, Z, BODY), (OFF, Y, MASSLESS)]);
    let root = Source::new("root.toml", "[robot]\nname = \"root\"\nbase = \"floating\"\n[[link]]\nname = \"link2\"\n");
    let functions = |list: &str| format!("[outputs]\nfunctions = [\"energy\"]\ncontact = [{list}]\n{CONTACT}");
    for (robot, joint) in [(&tip, "joint2"), (&root, "root_joint")] {
        for (name, is_divided) in [
            ("forward_dynamics", true),
            ("inverse_dynamics", true),
            ("impact", true),
            ("projection", true),
            ("constrained_coordinates", false),
        ] {
            let result = compiled(robot, &functions(&format!("\"{name}\"")));
            match is_divided {
                false => assert!(result.is_ok(), "{name} divides by nothing: {}", result.unwrap_err()),
                true => {
                    let errors = result.expect_err(name);
                    let title = format!("`{name}` of contact modes is asked for, and joint `{joint}` feels no inertia");
                    assert_eq!(titles(&errors, "no-forward-dynamics"), [title], "{errors}");
                    let error = errors.iter().find(|d| d.code == "no-forward-dynamics").expect("it is there");
                    assert!(error.place.is_some(), "{errors}");
                }
            }
        }
    }
}

#[test]
fn functions_of_drives_divide_by_the_inertia_with_drives() {
    let tip = chain(&[(OFF, Z, BODY), (OFF, Y, MASSLESS)]);
    let motor = "motor = { torque_constant = 0.05, resistance = 1.2, rotor_inertia = 1e-5 }";
    let scene = |function: &str, stages: &str| {
        format!("[outputs]\nfunctions = [\"{function}\"]\n[[drive]]\njoint = \"joint2\"\n{motor}\n{stages}\n")
    };
    let elastic = "stages = [{ ratio = 50.0, stiffness = 1e4 }]";
    for function in ["driven_forward_dynamics", "drive_torques", "drive_power", "state_space"] {
        // a rotor is inertia, behind a spring it is none of the joint's
        compiled(&tip, &scene(function, "ratio = 50.0")).unwrap_or_else(|d| panic!("{function}: {d}"));
        let errors = compiled(&tip, &scene(function, elastic)).expect_err(function);
        let title = format!("`{function}` is asked for, and joint `joint2` feels no inertia");
        assert_eq!(titles(&errors, "no-forward-dynamics"), [title], "{errors}");
    }
    for function in ["complete_model", "driven_inverse_dynamics", "drive_energy"] {
        compiled(&tip, &scene(function, elastic)).unwrap_or_else(|d| panic!("{function}: {d}"));
    }
}

#[test]
fn a_centre_of_mass_takes_some_mass() {
    let none = chain(&[(OFF, Z, MASSLESS), (OFF, Y, MASSLESS)]);
    let options = |functions: &[Function]| Options { functions: functions.to_vec(), ..Options::default() };
    let errors = compile(&none, &options(&[Function::CentreOfMass, Function::Momentum])).expect_err("0/0");
    let title = "`centre_of_mass`, `momentum` are asked for, and nothing that moves has mass";
    assert_eq!(titles(&errors, "no-mass"), [title], "{errors}");
    assert!(compile(&none, &options(&[Function::Energy])).is_ok());
    let some = chain(&[(OFF, Z, BODY), (OFF, Y, MASSLESS)]);
    assert!(compile(&some, &options(&[Function::CentreOfMass])).is_ok());
}

#[test]
fn inertia_that_is_rounding_or_dust_is_none() {
    // a point mass on an oblique axis leaves rounding of what its links have
    let axis = [0.48, -0.6, 0.64];
    let on_axis = "mass = 1.0\ncom = [0.144, -0.18, 0.192]\ninertia = [0.0, 0.0, 0.0]";
    assert_eq!(singular(&chain(&[(OFF, Y, BODY), (OFF, axis, on_axis)])), ["joint2"]);
    // dust in place of a zero
    let body = |factor: f64| {
        let [m, x, y, z] = [1.0, 0.02, 0.03, 0.025].map(|x: f64| x * factor);
        format!("mass = {m:e}\ncom = [0.1, 0.02, -0.03]\ninertia = [{x:e}, {y:e}, {z:e}]")
    };
    assert_eq!(singular(&chain(&[(OFF, Z, BODY), (OFF, Y, &body(1e-30))])), ["joint2"]);
    // small is not dust, and of a robot that is small everywhere nothing is
    assert_eq!(singular(&chain(&[(OFF, Z, BODY), (OFF, Y, &body(1e-20))])), [""; 0]);
    assert_eq!(singular(&chain(&[(OFF, Z, &body(1e-30)), (OFF, Y, &body(1e-30))])), [""; 0]);
}

#[test]
fn what_a_run_time_parameter_alone_brings_is_a_warning() {
    let tip = chain(&[(OFF, Z, BODY), (OFF, Y, MASSLESS)]);
    let scene = |link: &str| {
        format!("[outputs]\nfunctions = [\"forward_dynamics\"]\n[[parameter]]\nkind = \"payload\"\nname = \"load\"\nframe = \"{link}\"\n")
    };
    let generated = compiled(&tip, &scene("link2")).unwrap_or_else(|d| panic!("{d}"));
    let said = titles(&generated.warnings, "inertia-by-parameters");
    assert_eq!(said, ["joint `joint2` feels no inertia but that of `load`"]);
    assert!(generated.text.contains("joint `joint2` feels no inertia but that of `load`"), "{}", generated.text);
    // a parameter elsewhere does not help
    let errors = compiled(&tip, &scene("link1")).expect_err("nothing resists the second joint");
    assert_eq!(titles(&errors, "no-forward-dynamics").len(), 1, "{errors}");
    // where it is not needed there is nothing to say
    let sound = chain(&[(OFF, Z, BODY), (OFF, Y, BODY)]);
    let generated = compiled(&sound, &scene("link2")).unwrap_or_else(|d| panic!("{d}"));
    assert!(titles(&generated.warnings, "inertia-by-parameters").is_empty());
}

/// n rods in a plane: what stretches is ill-conditioned.
fn planar(n: usize) -> Source {
    let rod = "mass = 1.0\ncom = [0.25, 0.0, 0.0]\ninertia = [0.0009765625, 0.021, 0.021]";
    chain(&vec![([0.5, 0.0, 0.0], Z, rod); n])
}

/// The method that a robot gets, and the text with its documentation.
fn method(source: &Source, scalar: Scalar) -> (MethodChoice, String) {
    let options = Options { functions: vec![Function::ForwardDynamics], scalar, ..Options::default() };
    let generated = compile(source, &options).unwrap_or_else(|d| panic!("{d}"));
    let method = generated.report.function(Function::ForwardDynamics).and_then(|f| f.method).expect("it was chosen");
    (method, generated.text)
}

#[test]
fn where_the_factorisation_would_lose_digits_articulated_bodies_are_chosen_and_it_is_said() {
    for scalar in [Scalar::F32, Scalar::F64] {
        let (method, text) = method(&planar(3), scalar);
        let factorisation = method.factorisation.expect("three joints are few");
        let errors = [method.articulated.error, factorisation.error].map(|e| e.expect("both were tried"));
        assert!(factorisation.operations < method.articulated.operations, "it would be cheaper: {method}");
        assert!(errors[1] > TOLERATED * errors[0], "and loses digits: {method}");
        assert!(method.articulated_bodies, "{method}");
        let said = format!("/// {method}");
        assert!(text.contains(&said), "the function's documentation lacks: {said}\n{text}");
    }
}

/// Ascher, Pai and Cloutier (1997): the error of the factorisation grows with the length of a stretched chain, that of
/// articulated bodies hardly does.
#[test]
fn the_factorisation_of_a_stretched_chain_loses_a_digit_that_articulated_bodies_keep() {
    let [short, long] = [3, 12].map(|n| method(&planar(n), Scalar::F64).0);
    let articulated = [short, long].map(|m| m.articulated.error.expect("it was tried"));
    let factorised = [short, long].map(|m| m.factorisation.and_then(|f| f.error).expect("it was tried"));
    assert!(factorised[1] > 10.0 * factorised[0], "{short}\n{long}");
    assert!(articulated[1] < 10.0 * articulated[0], "{short}\n{long}");
}

#[test]
fn where_no_digits_are_lost_the_cheaper_method_is_chosen() {
    let (method, _) = method(&chain(&[(OFF, Z, BODY), (OFF, Y, BODY), (OFF, X, BODY), (OFF, Z, BODY)]), Scalar::F64);
    let factorisation = method.factorisation.expect("four joints are few");
    assert!(factorisation.operations < method.articulated.operations && !method.articulated_bodies, "{method}");
}
