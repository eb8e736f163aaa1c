//! Contact, impact and environment by compiled code: every case of the data to 1e-12 of scale.
//!
//! The modules have objects, tool axes and environments as inputs (see `build.rs`), so that one serves all cases of a robot.

use straightline_core::Dd;
use straightline_generated_tests::bounds::CONTACT;
use straightline_generated_tests::contact_cases::{cases, Case};

/// Values of a case, by key of the data.
type Results = Vec<(&'static str, Vec<f64>)>;
/// A compiled mode: inputs of a case to its results.
type Run = fn(&Case, &Inputs) -> Results;

/// What a case gives to the functions.
struct Inputs {
    axes: [[f64; 3]; 2],
    pose: [[f64; 3]; 4],
}

/// An object that does not move.
const REST: [[f64; 3]; 2] = [[0.0; 3]; 2];

impl Inputs {
    fn of(case: &Case) -> Inputs {
        let (object, a) = (case.object_axes(), case.axis());
        let column = |k: usize| [0, 1, 2].map(|i| object[(i, k)].to_f64());
        let axis = [a.x.to_f64(), a.y.to_f64(), a.z.to_f64()];
        // the second axis plays no part in these contacts
        let axes = [axis, [0.0; 3]];
        Inputs { axes, pose: [case.of_constraint("origin"), column(0), column(1), column(2)] }
    }
}

fn array<const N: usize>(list: Vec<f64>) -> [f64; N] {
    list.try_into().expect("as many numbers as the robot has coordinates")
}

macro_rules! robot {
    ($robot:ident, $file:ident, $n:literal, $($mode:ident: $m:literal $(with $axes:ident)?),*) => {
        use straightline_generated_tests::compiled::$file as $robot;
        impl Modes for $robot::contact::Mode {
            fn run(file: &str, kind: &str) -> Option<Run> {
                Some(match (file, kind) {
                    $(
                    ("contact", stringify!($mode)) => |case, inputs| {
                        use $robot::contact::$mode as mode;
                        let (q, qd) = (array::<$n>(case.input("q")), array::<$n>(case.input("qd")));
                        let tau = array::<$n>(case.input("tau"));
                        let (mut s, mut sd, mut j, mut a) = ([0.0; $m], [0.0; $m], [[0.0; $n]; $m], [0.0; $m]);
                        mode::constrained_coordinates(
                            &q, &qd, $(&inputs.$axes,)? &inputs.pose, &REST, &REST, &mut s, &mut sd, &mut j, &mut a,
                        );
                        let (mut qdd, mut f) = ([0.0; $n], [0.0; $m]);
                        let (mut sdd, mut violation, mut pivot) = ([0.0; $m], [0.0; $m], [0.0]);
                        mode::forward_dynamics(
                            &q, &qd, &tau, $(&inputs.$axes,)? &inputs.pose, &REST, &REST,
                            &mut qdd, &mut f, &mut sdd, &mut violation, &mut pivot,
                        );
                        assert!(pivot[0] > 1e-6, "the constraints of the data are independent: {}", case.id);
                        vec![
                            ("s", s.to_vec()), ("sd", sd.to_vec()), ("J_c", j.concat()), ("A_c", a.to_vec()),
                            ("qdd", qdd.to_vec()), ("F", f.to_vec()),
                        ]
                    },
                    ("impact", stringify!($mode)) => |case, inputs| {
                        use $robot::contact::$mode as mode;
                        let (q, qd) = (array::<$n>(case.input("q")), array::<$n>(case.input("qd")));
                        let (mut dqd, mut impulse, mut dsd) = ([0.0; $n], [0.0; $m], [0.0; $m]);
                        let (mut loss, mut pivot) = ([0.0], [0.0]);
                        mode::impact(
                            &q, &qd, $(&inputs.$axes,)? &inputs.pose, &REST, &[0.0],
                            &mut dqd, &mut impulse, &mut dsd, &mut loss, &mut pivot,
                        );
                        let after = qd.iter().zip(&dqd).map(|(a, b)| a + b).collect();
                        vec![
                            ("dqd", dqd.to_vec()), ("impulse", impulse.to_vec()), ("qd_after", after),
                            ("energy_loss", loss.to_vec()),
                        ]
                    },
                    )*
                    ("environment", _) => |case, inputs| {
                        use $robot::contact::elastic_base as mode;
                        let (q, qd) = (array::<$n>(case.input("q")), array::<$n>(case.input("qd")));
                        let tau = array::<$n>(case.input("tau"));
                        let base = ["me", "k", "b"].map(|key| case.parameter(key));
                        let (mut s, mut sd, mut j, mut a) = ([0.0], [0.0], [[0.0; $n]], [0.0]);
                        mode::constrained_coordinates(
                            &q, &qd, &inputs.pose, &REST, &REST, &mut s, &mut sd, &mut j, &mut a,
                        );
                        let (mut qdd, mut f) = ([0.0; $n], [0.0]);
                        let (mut sdd, mut violation, mut pivot) = ([0.0], [0.0], [0.0]);
                        mode::forward_dynamics(
                            &q, &qd, &tau, &inputs.pose, &REST, &REST, &base,
                            &mut qdd, &mut f, &mut sdd, &mut violation, &mut pivot,
                        );
                        vec![
                            ("s", s.to_vec()), ("sd", sd.to_vec()), ("J_6", j.concat()), ("A_6", a.to_vec()),
                            ("qdd", qdd.to_vec()), ("sdd", sdd.to_vec()), ("F", f.to_vec()),
                        ]
                    },
                    ("environment_impact", _) => |case, inputs| {
                        use $robot::contact::elastic_base as mode;
                        let (q, qd) = (array::<$n>(case.input("q")), array::<$n>(case.input("qd")));
                        let base = [case.parameter("me"), 0.0, 0.0];
                        let before = [case.parameter("sd_env_before")];
                        let (mut dqd, mut impulse, mut dsd) = ([0.0; $n], [0.0], [0.0]);
                        let (mut loss, mut pivot, mut after) = ([0.0], [0.0], [0.0]);
                        mode::impact(
                            &q, &qd, &inputs.pose, &REST, &base, &before, &[0.0],
                            &mut dqd, &mut impulse, &mut dsd, &mut loss, &mut pivot, &mut after,
                        );
                        vec![
                            ("dqd", dqd.to_vec()), ("dsd6", dsd.to_vec()), ("impulse", impulse.to_vec()),
                            ("sd_after", after.to_vec()),
                        ]
                    },
                    _ => return None,
                })
            }
        }
    };
}

/// The modes of a robot.
trait Modes {
    fn run(file: &str, kind: &str) -> Option<Run>;
}

robot!(planar2r, contact_planar2r, 2, surface: 1);
robot!(chapter_cylindrical, contact_chapter_cylindrical, 4, surface: 1, two_surfaces: 2, point: 3);
robot!(
    chapter_stanford, contact_chapter_stanford, 6,
    surface: 1, two_surfaces: 2, point: 3, peg_in_hole: 4 with axes, fixed_direction: 2 with axes
);
robot!(
    chapter_6r, contact_chapter_6r, 6,
    surface: 1, two_surfaces: 2, point: 3, peg_in_hole: 4 with axes, fixed_direction: 2 with axes
);
robot!(
    puma560, contact_puma560, 6,
    surface: 1, two_surfaces: 2, point: 3, peg_in_hole: 4 with axes, fixed_direction: 2 with axes
);
robot!(
    ur5, contact_ur5, 6,
    surface: 1, two_surfaces: 2, point: 3, peg_in_hole: 4 with axes, fixed_direction: 2 with axes
);
robot!(
    panda, contact_panda, 7,
    surface: 1, two_surfaces: 2, point: 3, peg_in_hole: 4 with axes, fixed_direction: 2 with axes
);

fn run(case: &Case, file: &str) -> Results {
    use self as robots;
    let of = match case.robot.as_str() {
        "planar2r" => robots::planar2r::contact::Mode::run,
        "chapter_cylindrical" => chapter_cylindrical::contact::Mode::run,
        "chapter_stanford" => chapter_stanford::contact::Mode::run,
        "chapter_6r" => chapter_6r::contact::Mode::run,
        "puma560" => puma560::contact::Mode::run,
        "ur5" => ur5::contact::Mode::run,
        "panda" => panda::contact::Mode::run,
        other => panic!("{other} was not compiled"),
    };
    let run = of(file, &case.kind).unwrap_or_else(|| panic!("{} was not compiled", case.id));
    run(case, &Inputs::of(case))
}

#[test]
fn compiled_code_meets_every_case_of_the_data() {
    let mut count = 0;
    for file in ["contact", "impact", "environment", "environment_impact"] {
        let mut most: f64 = 0.0;
        for case in cases(file) {
            for (key, value) in run(&case, file) {
                let value: Vec<Dd> = value.into_iter().map(Dd::from).collect();
                let error = case.scaled_error(key, &value);
                assert!(CONTACT.allows(error), "{key} of {}: {error:.1e}", case.id);
                most = most.max(error);
            }
            count += 1;
        }
        println!("{file}: {most:.1e} of scale");
    }
    assert_eq!(count, 288, "no case is left out");
}
