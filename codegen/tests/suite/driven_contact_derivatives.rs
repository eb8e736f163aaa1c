//! Derivatives of contact modes by the states and inputs of drives. Truth is the motion's own program, which other tests hold to 25 digits, in dual numbers
//! over double-double: on rigid planes, sliding, sticking, on objects that give way and on a loop, by motors with and without inductance, through gears with
//! losses, elastic transmissions, and rotors that turn in space.

use crate::contact_derivatives::{allowed, contact, greatest, list, run, Case, Moving, State, OBJECT};
use straightline_codegen::function::ContactFunction;
use straightline_codegen::program::contact::{graph, Mode};
use straightline_core::random::Random;
use straightline_core::{Dd, Dual};

const MOTOR: &str = "motor = { torque_constant = 0.05, resistance = 1.2, rotor_inertia = 1e-4 }";

fn drive(joint: &str, more: &str) -> String {
    format!("[[drive]]\njoint = \"{joint}\"\n{more}\n")
}

/// A drive of every kind.
fn drives() -> String {
    let windings =
        "motor = { torque_constant = 0.0369, resistance = 0.608, inductance = 4.63e-4, rotor_inertia = 1.81e-5 }";
    [
        drive("shoulder_pan_joint", &format!("{MOTOR}\nratio = 50.0")),
        drive("shoulder_lift_joint", &format!("{windings}\nstages = [{{ ratio = 100.0, stiffness = 1.6e4, input_inertia = 9e-6, output_inertia = 2e-4 }}]")),
        drive("elbow_joint", &format!("{MOTOR}\nratio = 50.0\nrotor = {{ link = \"upper_arm_link\", axis = [0.3, 0.1, 0.9], inertia = 2e-3 }}")),
        drive("wrist_1_joint", &format!("{MOTOR}\nstages = [{{ ratio = 80.0, input_inertia = 3e-6, output_inertia = 6e-5, efficiency = 0.75 }}]")),
        drive("wrist_2_joint", &format!("{MOTOR}\nstages = [{{ ratio = 100.0, stiffness = 7e3, damping = 3.0, input_inertia = 3e-6, output_inertia = 6e-5, efficiency = 0.75 }}]")),
    ]
    .concat()
}

/// The input moves by this, and a column of what follows.
fn column(case: &Case, mode: &Mode, state: &State<Dd>, name: &str, by: &[Dd]) -> State<Moving> {
    let program = graph(&case.robot, &case.options, mode, ContactFunction::DrivenForwardDynamics);
    let held = state.iter().map(|(name, list)| (name.clone(), list.iter().map(|x| Dual::fixed(*x)).collect()));
    let mut moving: State<Moving> = held.collect();
    let input = moving.get_mut(name).expect("an input");
    input.iter_mut().zip(by).for_each(|(x, by)| x.derivatives = [*by]);
    run::<Moving>(&program, &moving)
}

/// Every block of the derivatives in this scene, in double-double and in f64.
fn hold(case: &Case, states: usize) {
    let (mut random, mut failures) = (Random(11), Vec::new());
    for mode in &case.modes() {
        let program = graph(&case.robot, &case.options, mode, ContactFunction::DrivenForwardDynamicsDerivatives);
        let (mut worst, mut least, mut blocks) = ([0.0f64; 2], 1.0f64, 0);
        for _ in 0..states {
            let mut state = case.state(mode, &mut random);
            for port in program.inputs.iter().filter(|port| ["x", "u"].contains(&port.name.as_str())) {
                let numbers = list(&mut random, port.len(), 0.5);
                state.insert(port.name.clone(), numbers.into_iter().map(Dd::from).collect());
            }
            let narrow: State<f64> =
                state.iter().map(|(k, x)| (k.clone(), x.iter().map(|x| x.to_f64()).collect())).collect();
            let (wide, narrow) = (run::<Dd>(&program, &state), run::<f64>(&program, &narrow));
            let pivot = wide["pivot"][0].hi();
            least = least.min(pivot);
            let names = program.inputs.iter().map(|port| (port.name.as_str(), port.len()));
            for (name, length) in
                names.filter(|(name, _)| ["q", "qd", "x", "u"].contains(name) || name.ends_with("_own"))
            {
                let columns = if name == "q" { case.nv() } else { length };
                let unit = |k: usize| (0..length).map(|i| if i == k { Dd::ONE } else { Dd::ZERO }).collect();
                for k in 0..columns {
                    let by: Vec<Dd> = if name == "q" { case.increment(&state["q"], k) } else { unit(k) };
                    let truth = column(case, mode, &state, name, &by);
                    for (of, expected) in &truth {
                        // of the rates of an object's own coordinate there are derivatives by itself
                        let short = match of.strip_suffix("_own_rate") {
                            Some(owner) if name == format!("{owner}_own") => "own",
                            _ => name,
                        };
                        let block = format!("d{of}_d{short}");
                        let Some(found) = wide.get(&block) else { continue };
                        blocks += 1;
                        let values: Vec<Dd> = expected.iter().map(|x| x.value).collect();
                        let size = greatest(found).max(1.0);
                        assert_eq!(found.len(), values.len() * columns, "{block}");
                        for (i, x) in expected.iter().enumerate() {
                            let at = i * columns + k;
                            let off = [found[at], Dd::from(narrow[&block][at])]
                                .map(|found| (found - x.derivatives[0]).abs().hi() / size);
                            for (kind, bound) in allowed(pivot).into_iter().enumerate() {
                                if off[kind].is_nan() || off[kind] > bound {
                                    failures.push(format!(
                                        "{} {block}[{i}][{k}]: {} for {}, {:.1e} of {size:.1e}, pivot {pivot:.1e}",
                                        mode.name,
                                        found[at].hi(),
                                        x.derivatives[0].hi(),
                                        off[kind]
                                    ));
                                }
                                worst[kind] = worst[kind].max(off[kind]);
                            }
                        }
                        // the values beside them
                        if let Some(own) = wide.get(of) {
                            let off = own.iter().zip(&values).map(|(a, b)| (*a - *b).abs().hi());
                            assert!(off.fold(0.0, f64::max) <= 1e-20 * greatest(&values).max(1.0), "{of}");
                        }
                    }
                }
            }
        }
        // q̈, ẋ and F by four inputs at least, a column at a time
        assert!(blocks >= states * 3 * (2 * case.nv() + 2), "{}: {blocks}", mode.name);
        println!(
            "{:<16} {:6} operations, {:.1e} and in f64 {:.1e} of the greatest entries, least pivot {least:.1e}",
            mode.name,
            program.counts().flops(),
            worst[0],
            worst[1]
        );
    }
    assert!(failures.is_empty(), "{} are off:\n{}", failures.len(), failures[..failures.len().min(40)].join("\n"));
}

#[test]
fn derivatives_by_states_and_inputs_of_drives_are_those_of_the_motion() {
    let mut scene = format!("[outputs]\nfunctions = []\n{}", drives());
    let held = |more: &str| {
        format!("{OBJECT}\nconstrained = [\"pz\"]\nenvironment = {{ {more}, stiffness = 500, damping = 12 }}")
    };
    let front = "front_stiffness = 800, front_damping = 7";
    let cases = [
        ("plane", format!("{OBJECT}\nconstrained = [\"pz\"]")),
        ("peg", format!("{OBJECT}\naxis = [0.3, -0.2, 0.9]\nconstrained = [\"px\", \"py\", \"ax\", \"ay\"]")),
        ("ball", format!("{OBJECT}\nconstrained = [\"pz\"]\nsurface = {{ kind = \"sphere\", radius = 0.25 }}")),
        ("rough", format!("{OBJECT}\nconstrained = [\"pz\"]\nfriction = {{ coefficient = 0.375, speed = 0.25 }}")),
        ("mass", held("kind = \"mass\", mass = 1.5")),
        ("cushioned", held(&format!("kind = \"cushioned\", mass = 1.5, {front}"))),
        ("two_masses", held(&format!("kind = \"two_masses\", mass = 1.5, front_mass = 0.25, {front}"))),
    ];
    for (name, more) in &cases {
        scene += &contact(name, "tool0", more);
    }
    for (name, _) in &cases {
        scene += &format!("[[mode]]\nname = \"{name}\"\ncontacts = [\"{name}\"]\n");
    }
    scene += "[[mode]]\nname = \"sticking\"\ncontacts = [\"rough\"]\nsticking = [\"rough\"]\n";
    hold(&Case::new("ur5.urdf", false, &scene), 2);
}

#[test]
fn derivatives_know_the_stabilisation_and_loops_beside_drives() {
    let scene = format!(
        "[outputs]\nfunctions = []\n{}{}[[loop]]\nname = \"rod\"\nframe = \"tool0\"\nwith = \"upper_arm_link\"\n\
         constrained = [\"px\", \"ay\"]\n[stabilisation]\nfrequency = 15.0\n",
        contact("pen", "forearm_link", &format!("{OBJECT}\nconstrained = [\"pz\"]")),
        drives()
    );
    hold(&Case::new("ur5.urdf", false, &scene), 1);
}

/// On a floating base, by increments of its pose.
#[test]
fn derivatives_of_a_driven_robot_that_floats_are_by_increments() {
    let joints = ["FL_HAA", "HR_KFE"];
    let driven: String = joints.map(|joint| drive(joint, &format!("{MOTOR}\nratio = 9.0"))).concat();
    let ground = "object = { origin = [0.0, 0.0, 0.0], z = [0.05, 0.0, 1.0] }\nconstrained = [\"pz\"]";
    let scene = format!("[outputs]\nfunctions = []\n{}{driven}", contact("foot", "FL_FOOT", ground));
    hold(&Case::new("solo12.urdf", true, &scene), 1);
}
