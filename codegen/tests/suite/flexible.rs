//! Links cut into elastic segments, and bases on springs: against the formulas of beams, and with masses that add up.

use straightline_codegen::description::flexible::{BaseSupport, WrittenSpring};
use straightline_codegen::description::Noted;
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::model::{self, ModelOptions};
use straightline_codegen::options::scene_file;
use straightline_codegen::{compile, Function, Options};
use straightline_core::algorithms::{forward_dynamics_aba, inverse_dynamics, jacobian, joint_wrenches, mass_matrix};
use straightline_core::model::{JointKind, Model};
use straightline_core::Dd;

const LENGTH: f64 = 0.8;
const MASS: f64 = 0.3;
const BENDING: f64 = 12.0;
const TORSION: f64 = 9.0;

/// A uniform beam along z, clamped in the world, with a frame at its tip; `keys` are those of its `flexible`.
fn beam(keys: &str) -> Model<Dd> {
    // of a thin rod, about its axis nothing unless it twists; half of that counts across, too
    let axial = if keys.contains("torsion") { 1e-5 } else { 0.0 };
    let j = MASS * LENGTH * LENGTH / 12.0 + 0.5 * axial;
    let text = format!(
        "[robot]\nname = \"beam\"\ngravity = [0.0, 0.0, 0.0]\n[[link]]\nname = \"wall\"\n[[link]]\nname = \"beam\"\n\
         mass = {MASS}\ncom = [0.0, 0.0, {}]\ninertia = [{j:?}, {j:?}, {axial:?}]\nflexible = {{ {keys} }}\n\
         [[joint]]\nname = \"clamp\"\nkind = \"fixed\"\nparent = \"wall\"\nchild = \"beam\"\n\
         [[frame]]\nname = \"tip\"\nlink = \"beam\"\nxyz = [0.0, 0.0, {LENGTH}]\n",
        0.5 * LENGTH
    );
    loaded(&text, &ModelOptions::default())
}

fn loaded(text: &str, options: &ModelOptions) -> Model<Dd> {
    let (model, diagnostics) = model::load(&Source::new("beam.toml", text), options);
    assert!(diagnostics.is_empty(), "{diagnostics}");
    model.expect("without complaints there is a model")
}

fn bent(segments: usize) -> Model<f64> {
    beam(&format!("to = [0.0, 0.0, {LENGTH}], segments = {segments}, bending = {{ x = {BENDING} }}")).cast()
}

fn stiffness(model: &Model<f64>) -> Vec<f64> {
    model.bodies.iter().map(|b| b.effects.stiffness).collect()
}

/// The rows of the tip's Jacobian at rest: linear x, y, z, angular x, y, z.
fn tip_rows(model: &Model<f64>) -> Vec<Vec<f64>> {
    let n = model.nv();
    let tip = model.frame("tip").expect("the beam has a tip");
    let flat = jacobian(model, &vec![0.0; n], tip);
    flat.chunks(n).map(<[f64]>::to_vec).collect()
}

#[test]
fn a_force_on_the_tip_bends_it_as_a_beam_but_for_a_quarter_of_the_segments_squared() {
    for n in [1, 2, 5, 20] {
        let model = bent(n);
        let row = &tip_rows(&model)[1];
        let compliance: f64 = row.iter().zip(stiffness(&model)).map(|(j, k)| j * j / k).sum();
        let beam = LENGTH.powi(3) / (3.0 * BENDING);
        let expected = 1.0 - 0.25 / (n * n) as f64;
        assert!((compliance / beam - expected).abs() < 1e-13, "{n} segments: {} of the beam's", compliance / beam);
    }
}

#[test]
fn a_moment_on_the_tip_turns_and_twists_it_as_a_beam_exactly() {
    for n in [1, 3, 8] {
        let keys = format!("to = [0.0, 0.0, {LENGTH}], segments = {n}, bending = {BENDING}, torsion = {TORSION}");
        let model: Model<f64> = beam(&keys).cast();
        assert_eq!(model.nv(), 3 * n);
        let rows = tip_rows(&model);
        for (row, expected) in [(3, LENGTH / BENDING), (4, LENGTH / BENDING), (5, LENGTH / TORSION)] {
            let angle: f64 = rows[row].iter().zip(stiffness(&model)).map(|(j, k)| j * j / k).sum();
            assert!((angle / expected - 1.0).abs() < 1e-13, "{n} segments, row {row}: {angle} for {expected}");
        }
    }
}

/// The least frequency of H q̈ + K q = 0 at rest: the greatest eigenvalue of K⁻¹ H by powers of it.
fn first_frequency(model: &Model<f64>) -> f64 {
    let n = model.nv();
    let (h, k) = (mass_matrix(model, &vec![0.0; n]), stiffness(model));
    let mut shape: Vec<f64> = (0..n).map(|i| 1.0 + 0.1 * i as f64).collect();
    let mut value = 0.0;
    for _ in 0..200 {
        let moved: Vec<f64> = (0..n).map(|i| (0..n).map(|j| h[i * n + j] * shape[j]).sum::<f64>() / k[i]).collect();
        value = moved.iter().map(|x| x * x).sum::<f64>().sqrt();
        shape = moved.iter().map(|x| x / value).collect();
    }
    1.0 / value.sqrt()
}

#[test]
fn the_first_frequency_of_a_cantilever_comes_nearer_with_the_square_of_the_segments() {
    // the least root of 1 + cos x cosh x = 0, squared
    let beam = 1.875_104_068_711_961f64.powi(2) * (BENDING / (MASS * LENGTH.powi(3))).sqrt();
    let errors: Vec<f64> = [4, 8, 16, 32].iter().map(|n| (first_frequency(&bent(*n)) / beam - 1.0).abs()).collect();
    println!("relative errors of the frequency with 4, 8, 16, 32 segments: {errors:?}");
    assert!(errors[0] < 0.02, "{errors:?}");
    for pair in errors.windows(2) {
        let gain = pair[0] / pair[1];
        assert!((3.5..4.5).contains(&gain), "twice the segments, an error {gain} times smaller: {errors:?}");
    }
}

#[test]
fn under_load_it_finds_the_equilibrium_of_the_elastica_for_small_angles() {
    // statics with the whole equations: springs against the load, not only the linear ones
    let (model, load) = (bent(12), 0.5);
    let (n, k) = (model.nv(), stiffness(&model));
    let tip = model.frame("tip").expect("the beam has a tip");
    let (mut q, still) = (vec![0.0; n], vec![0.0; n]);
    for _ in 0..60 {
        let spring = inverse_dynamics(&model, &q, &still, &still);
        let rows = jacobian(&model, &q, tip);
        (0..n).for_each(|i| q[i] -= (spring[i] - load * rows[n + i]) / k[i]);
    }
    let rows = jacobian(&model, &q, tip);
    let spring = inverse_dynamics(&model, &q, &still, &still);
    let off = (0..n).map(|i| (spring[i] - load * rows[n + i]).abs()).fold(0.0, f64::max);
    assert!(off < 1e-12, "no equilibrium: {off}");
    let deflection = straightline_core::algorithms::forward_kinematics(&model, &q, &[tip])[0].translation.y;
    let beam = load * LENGTH.powi(3) / (3.0 * BENDING);
    // (P L²/EI)² = 7e-4: what the linear theory leaves out
    assert!((deflection / beam - 1.0).abs() < 3e-3, "{deflection} for {beam}");
}

/// A link with any inertia on a floating base: at rest in its straight form, H of the base is that of the rigid link.
#[test]
fn segments_have_the_mass_the_centre_and_the_inertia_of_the_link() {
    let text = |flexible: &str| {
        format!(
            "[robot]\nname = \"free\"\nbase = \"floating\"\n[[link]]\nname = \"trunk\"\nmass = 2.0\n\
             com = [0.03, -0.1, 0.05]\ninertia = [0.04, 0.05, 0.06]\n[[link]]\nname = \"bar\"\nmass = 1.3\n\
             com = [0.11, 0.17, 0.02]\n\
             inertia = {{ xx = 0.021, yy = 0.017, zz = 0.024, xy = -0.009, xz = 0.002, yz = -0.0013 }}\n{flexible}\n\
             [[link]]\nname = \"hand\"\nmass = 0.7\ncom = [0.0, 0.02, 0.01]\ninertia = [0.001, 0.0012, 0.0009]\n\
             [[joint]]\nname = \"elbow\"\nkind = \"continuous\"\nparent = \"trunk\"\nchild = \"bar\"\naxis = \"y\"\n\
             origin = {{ xyz = [0.2, 0.1, 0.0], rpy_deg = [10, 20, 30] }}\n\
             [[joint]]\nname = \"wrist\"\nkind = \"continuous\"\nparent = \"bar\"\nchild = \"hand\"\naxis = \"x\"\n\
             origin = {{ xyz = [0.2, 0.31, 0.0] }}\n"
        )
    };
    let rigid = loaded(&text(""), &ModelOptions::default());
    let flexible = "flexible = { to = [0.2, 0.31, 0.0], segments = 3, bending = 40.0, torsion = 30.0 }";
    let cut = loaded(&text(flexible), &ModelOptions::default());
    assert_eq!(cut.nv(), rigid.nv() + 9);
    let base = |model: &Model<Dd>| -> Vec<Dd> {
        let mut q = vec![Dd::ZERO; model.nq()];
        let root = model.bodies.iter().find(|b| b.joint.kind == JointKind::Floating).expect("the base floats");
        q[root.joint.iq + 6] = Dd::ONE;
        let (h, n) = (mass_matrix(model, &q), model.nv());
        (0..36).map(|k| h[k / 6 * n + k % 6]).collect()
    };
    for (k, (a, b)) in base(&rigid).iter().zip(base(&cut)).enumerate() {
        // double-double
        assert!((*a - b).to_f64().abs() < 1e-28, "entry {k}: {a} and {b}");
    }
}

#[test]
fn an_effect_of_a_scene_makes_links_and_support_rigid_again() {
    let text = include_str!("../../../robots/descriptions/flexible_arm.toml");
    let robot = Source::new("flexible_arm.toml", text);
    let rigid =
        Source::new("rigid.toml", text.lines().filter(|l| !l.starts_with("flexible")).collect::<Vec<_>>().join("\n"));
    let supported = "[support]\nz = { stiffness = 1e5 }\n[effects]\nelastic_links = false\n";
    let file = scene_file::read(&Source::new("s.toml", supported), &mut Diagnostics::new()).expect("a scene");
    let functions = vec![Function::InverseDynamics];
    let options = Options { functions, ..Options::default() };
    let of_scene = compile(&robot, &file.into_options(options.clone())).expect("it compiles");
    let of_file = compile(&rigid, &options).expect("it compiles");
    let body = |text: &str| text[text.find("pub fn inverse_dynamics").expect("the function")..].to_string();
    assert_eq!(body(&of_scene.text), body(&of_file.text));
}

/// A heavy pendulum on a support that gives along and about all axes.
fn supported() -> Model<f64> {
    let text = "[robot]\nname = \"tower\"\n[[link]]\nname = \"foot\"\nmass = 5.0\ncom = [0.02, 0.0, 0.1]\n\
                inertia = [0.1, 0.12, 0.05]\n[[link]]\nname = \"arm\"\nmass = 2.0\ncom = [0.0, 0.1, 0.3]\n\
                inertia = [0.05, 0.04, 0.01]\n[[joint]]\nname = \"hinge\"\nkind = \"continuous\"\nparent = \"foot\"\n\
                child = \"arm\"\naxis = \"y\"\norigin = { xyz = [0.0, 0.0, 0.4] }\n";
    let spring = |k: usize| {
        let (stiffness, damping) = if k < 3 { (4e4 + 1e3 * k as f64, 90.0) } else { (2e3 + 50.0 * k as f64, 4.0) };
        let (stiffness, damping) = (Noted::assumed(stiffness), Noted::assumed(damping));
        Some(WrittenSpring { stiffness, damping, rest: 0.0 })
    };
    let support =
        BaseSupport { at: [0.0, 0.1, -0.2], directions: std::array::from_fn(spring), place: Noted::assumed(()) };
    loaded(text, &ModelOptions { support: Some(support), ..ModelOptions::default() }).cast()
}

#[test]
fn a_support_sinks_under_the_weight_and_swings_with_the_mass_that_it_carries() {
    let model = supported();
    let names: Vec<&str> = model.bodies.iter().map(|b| b.joint.name.as_str()).collect();
    let elastic = ["support_x", "support_y", "support_z", "support_rx", "support_ry", "support_rz"];
    assert_eq!(names, [&elastic[..], &["hinge"]].concat());
    let (mut q, still) = (vec![0.0; 7], vec![0.0; 7]);
    // the hinge is held; the support goes to its equilibrium
    for _ in 0..100 {
        let off = inverse_dynamics(&model, &q, &still, &still);
        (0..6).for_each(|i| q[i] -= off[i] / model.bodies[i].effects.stiffness);
    }
    let sunk = -7.0 * 9.81 / model.bodies[2].effects.stiffness;
    assert!((q[2] / sunk - 1.0).abs() < 1e-12, "{} for {sunk}", q[2]);
    let h = mass_matrix(&model, &q);
    for i in 0..3 {
        assert!((h[i * 7 + i] - 7.0).abs() < 1e-12, "the support carries 7 kg along its axes: {}", h[i * 7 + i]);
    }
    // at rest there without a torque on the support
    let mut tau = inverse_dynamics(&model, &q, &still, &still);
    tau[..6].fill(0.0);
    let qdd = forward_dynamics_aba(&model, &q, &still, &tau);
    assert!(qdd.iter().all(|x| x.abs() < 1e-9), "{qdd:?}");
}

#[test]
fn elastic_joints_are_passive() {
    let model: Model<f64> = beam("to = [0.0, 0.0, 0.8], bending = 5.0, damping = 1e-3").cast();
    assert_eq!(model.nv(), 10);
    for body in model.bodies.iter().chain(&supported().bodies[..6]) {
        assert_eq!(body.joint.limits.effort, 0.0, "{}", body.joint.name);
        assert!(body.effects.stiffness > 0.0);
    }
    // Kelvin and Voigt: n EI/L and its time constant
    assert_eq!(model.bodies[0].effects.stiffness, 5.0 * 5.0 / 0.8);
    assert!((model.bodies[0].effects.damping - 1e-3 * 5.0 * 5.0 / 0.8).abs() < 1e-16);
}

/// A link that is cut shows what it bears along its axis: a horizontal beam under its weight ρ g per length.
#[test]
fn forces_along_a_link_are_those_in_its_cuts() {
    let model: Model<f64> = beam(&format!("to = [0.0, 0.0, {LENGTH}], segments = 4, bending = {{ x = 1.0 }}")).cast();
    // gravity across the beam, along its y
    let model = Model { gravity: straightline_core::spatial::Vec3::new(0.0, -9.81, 0.0), ..model };
    let still = vec![0.0; 4];
    let weight = MASS * 9.81 / LENGTH;
    for (i, w) in joint_wrenches(&model, &still, &still, &still).iter().enumerate() {
        let beyond = LENGTH - (i as f64 + 0.5) * LENGTH / 4.0;
        let (force, moment) = (w.force.to_array(), w.moment.to_array());
        // shear ρ g l, bending moment ρ g l²/2 of the part beyond the cut
        assert!((force[1] - weight * beyond).abs() < 1e-14, "cut {i}: {force:?}");
        assert!((moment[0] + weight * beyond * beyond / 2.0).abs() < 1e-14, "cut {i}: {moment:?}");
        assert!(force[0].abs() + force[2].abs() + moment[1].abs() + moment[2].abs() < 1e-14, "{force:?} {moment:?}");
    }
}
