//! Contact, impact and environment on the generic runtime and in the chapter's formulation: both against data with 25 digits,
//! and against each other on random robots with objects that move.

use nalgebra::{Matrix3, Vector3};
use straightline_codegen::equations::Robot as Loaded;
use straightline_codegen::expr;
use straightline_codegen::function::ContactFunction;
use straightline_codegen::options::Options;
use straightline_codegen::program::contact::{graph, Mode};
use straightline_codegen::scene::contact::{ContactItem, SurfaceItem};
use straightline_codegen::scene::{Scene, SceneContacts};
use straightline_core::algorithms::{Environment, FunctionalCoordinates, Ltdl, SpringDamper, Struck, Support};
use straightline_core::contact::{Contact, Coordinate, Object, ObjectMotion, Surface};
use straightline_core::model::Model;
use straightline_core::reference::{CentreOfMassTree, Component, ContactFrames, Derivatives};
use straightline_core::spatial::{Mat3, MotionVector, Transform, Vec3};
use straightline_core::{algorithms as alg, reference as chapter, Dd, Real};
use straightline_generated_tests::bounds::{CONTACT, CONTACT_AUTHORS, CONTACT_DATA};
use straightline_generated_tests::contact_cases::{cases, robot, Case};
use straightline_generated_tests::random::{Kind, Random, RandomRobot};
use straightline_generated_tests::written::{Shape, Style};

const RIDGE: f64 = 1e-12;
/// In double-double the ridge is so small that its square is not seen beside the data's digits.
const WIDE_RIDGE: f64 = 1e-16;

fn wide(values: &[f64]) -> Vec<Dd> {
    values.iter().map(|x| Dd::from(*x)).collect()
}

/// All quantities of a case, by key of the data, on the generic runtime.
fn runtime<T: Real>(
    case: &Case,
    model: &Model<T>,
    contact: &Contact<T>,
    file: &str,
    ridge: f64,
) -> Vec<(&'static str, Vec<T>)> {
    let c = |x: f64| T::constant(Dd::from(x));
    let input = |key: &str| case.input(key).into_iter().map(c).collect::<Vec<T>>();
    let (q, qd, ridge) = (input("q"), input("qd"), c(ridge));
    let s = alg::constrained_coordinates(model, contact, &q, &qd);
    let factor = Ltdl::factor(model, &alg::mass_matrix(model, &q));
    let drive = || {
        let h = alg::bias_force(model, &q, &qd);
        input("tau").into_iter().zip(h).map(|(t, h)| t - h).collect::<Vec<T>>()
    };
    match file {
        "contact" => {
            let supports = vec![Support::Rigid(T::zero()); s.len()];
            let motion = alg::constrained_forward_dynamics(&factor, &drive(), &s, None, &supports, ridge);
            vec![
                ("s", s.value),
                ("sd", s.rate),
                ("J_c", s.jacobian.concat()),
                ("A_c", s.bias),
                ("qdd", motion.qdd),
                ("F", motion.force),
            ]
        }
        "impact" => {
            let blow = alg::impact(&factor, &qd, &s, None, &vec![Struck::Rigid; s.len()], T::zero(), ridge);
            let after = qd.iter().zip(&blow.dqd).map(|(a, b)| *a + *b).collect();
            vec![
                ("dqd", blow.dqd),
                ("impulse", blow.impulse),
                ("qd_after", after),
                ("energy_loss", vec![blow.energy_loss]),
            ]
        }
        "environment" => {
            let [mass, stiffness, damping] = ["me", "k", "b"].map(|key| c(case.parameter(key)));
            let object = Environment::Mass { mass, support: SpringDamper { stiffness, damping } };
            let own = (T::zero(), T::zero());
            let support = [object.support((s.value[0], s.rate[0]), own)];
            let motion = alg::constrained_forward_dynamics(&factor, &drive(), &s, None, &support, ridge);
            vec![
                ("s", s.value),
                ("sd", s.rate),
                ("J_6", s.jacobian.concat()),
                ("A_6", s.bias),
                ("qdd", motion.qdd),
                ("sdd", motion.sdd),
                ("F", motion.force),
            ]
        }
        _ => {
            let struck = [Struck::Mass { mass: c(case.parameter("me")), velocity: c(case.parameter("sd_env_before")) }];
            let blow = alg::impact(&factor, &qd, &s, None, &struck, T::zero(), ridge);
            vec![("dqd", blow.dqd), ("dsd6", blow.dsd), ("impulse", blow.impulse), ("sd_after", blow.struck_velocity)]
        }
    }
}

/// The same by the second author.
fn second_author(case: &Case, tree: &CentreOfMassTree<Dd>, file: &str) -> Vec<(&'static str, Vec<Dd>)> {
    let (frames, components) = case.reference(tree);
    let (q, qd) = (wide(&case.input("q")), wide(&case.input("qd")));
    let s: Vec<Derivatives<Dd>> =
        components.iter().map(|c| chapter::functional_coordinate(tree, &frames, &q, &qd, *c)).collect();
    let list = |f: &dyn Fn(&Derivatives<Dd>) -> Dd| s.iter().map(f).collect::<Vec<Dd>>();
    let rows = || s.iter().flat_map(|s| s.jacobian.iter().copied()).collect::<Vec<Dd>>();
    let of = |v: nalgebra::DVector<Dd>| v.as_slice().to_vec();
    match file {
        "contact" => {
            let (qdd, force) = chapter::constrained_motion(tree, &s, &q, &qd, &wide(&case.input("tau")));
            vec![
                ("s", list(&|s| s.s)),
                ("sd", list(&|s| s.sd)),
                ("J_c", rows()),
                ("A_c", list(&|s| s.adjoint)),
                ("qdd", of(qdd)),
                ("F", of(force)),
            ]
        }
        "impact" => {
            let (dqd, impulse) = chapter::rigid_impact(tree, &s, &q, &qd, Dd::ZERO);
            vec![("dqd", of(dqd)), ("impulse", of(impulse))]
        }
        "environment" => {
            let parameters = ["me", "k", "b"].map(|key| Dd::from(case.parameter(key)));
            let tau = wide(&case.input("tau"));
            let (qdd, sdd, force) = chapter::environment_motion(tree, &s[0], parameters, &q, &qd, &tau);
            vec![("qdd", of(qdd)), ("sdd", vec![sdd]), ("F", vec![force])]
        }
        _ => {
            let [me, before] = ["me", "sd_env_before"].map(|key| Dd::from(case.parameter(key)));
            let (dqd, dsd, impulse, after) = chapter::environment_impact(tree, &s[0], me, before, &q, &qd);
            vec![("dqd", of(dqd)), ("dsd6", vec![dsd]), ("impulse", vec![impulse]), ("sd_after", vec![after])]
        }
    }
}

#[test]
fn both_authors_meet_every_case_of_the_data() {
    for file in ["contact", "impact", "environment", "environment_impact"] {
        let mut known: Option<(String, (Loaded, CentreOfMassTree<Dd>))> = None;
        let (mut first, mut second, mut rounded) = (0.0f64, 0.0f64, 0.0f64);
        for case in cases(file) {
            if known.as_ref().is_none_or(|(name, _)| *name != case.robot) {
                known = Some((case.robot.clone(), robot(&case.robot)));
            }
            let (loaded, tree) = &known.as_ref().expect("just read").1;
            let contact = case.contact(loaded);
            let ours = runtime(&case, &loaded.model, &contact, file, WIDE_RIDGE);
            let theirs = second_author(&case, tree, file);
            let narrow = runtime(&case, &loaded.model.cast::<f64>(), &contact.map(f64::constant), file, RIDGE);
            for (key, value) in &ours {
                let error = case.scaled_error(key, value);
                assert!(CONTACT_DATA.allows(error), "{key} of {}: {error:.1e}", case.id);
                first = first.max(error);
            }
            for (key, value) in &theirs {
                let error = case.scaled_error(key, value);
                assert!(CONTACT_DATA.allows(error), "{key} of {} by the second author: {error:.1e}", case.id);
                second = second.max(error);
            }
            for (key, value) in &narrow {
                let error = case.scaled_error(key, value);
                assert!(CONTACT.allows(error), "{key} of {} in f64: {error:.1e}", case.id);
                rounded = rounded.max(error);
            }
        }
        println!("{file}: {first:.1e} and {second:.1e} in double-double, {rounded:.1e} in f64");
    }
}

fn narrow_to(v: Vector3<Dd>) -> Vec3<Dd> {
    Vec3::new(v.x, v.y, v.z)
}

fn unit(random: &mut Random) -> Vector3<Dd> {
    let v = Vector3::from(random.three(1.0).map(Dd::from)) + Vector3::new(Dd::from(0.1), Dd::ZERO, Dd::ZERO);
    v / v.dot(&v).sqrt()
}

fn across(random: &mut Random, a: &Vector3<Dd>) -> Vector3<Dd> {
    let b = unit(random).cross(a);
    b / b.dot(&b).sqrt()
}

/// A contact of a random frame with an object that moves, for both authors.
fn random_contact(
    random: &mut Random,
    robot: &Loaded,
    tree: &CentreOfMassTree<Dd>,
    frame: &str,
) -> (Contact<Dd>, ContactFrames<Dd>) {
    let vector = |random: &mut Random| Vector3::from(random.three(1.0).map(Dd::from));
    let (a, x) = (unit(random), unit(random));
    let (b, y) = (across(random, &a), across(random, &x));
    let object = Matrix3::from_columns(&[x, y, x.cross(&y)]);
    let motion = [(); 4].map(|()| vector(random));
    let origin = vector(random);
    let radius = Dd::from(random.between(0.1, 0.5));
    let rotation = Mat3::from_columns(narrow_to(x), narrow_to(y), narrow_to(x.cross(&y)));
    let [v, w, vd, wd] = motion.map(narrow_to);
    let contact = Contact {
        name: "random".into(),
        frame: robot.model.frame(frame).expect("a frame of the robot").clone(),
        axis: narrow_to(a),
        second_axis: narrow_to(b),
        object: Object::Moving(ObjectMotion {
            pose: Transform { rotation, translation: narrow_to(origin) },
            velocity: MotionVector { angular: w, linear: v },
            acceleration: MotionVector { angular: wd, linear: vd },
        }),
        surface: Surface::Plane,
        constrained: Coordinate::ALL.to_vec(),
        free: vec![],
        friction: None,
    };
    let frame = tree.frame(frame).expect("a frame of the robot").clone();
    (contact, ContactFrames { frame, axes: [a, b], origin, object, motion, radius })
}

fn kinds() -> impl Iterator<Item = Kind> {
    (0..12).map(|i| Kind {
        joints: 2 + i,
        welded: i % 3,
        floating: i % 2 == 1,
        branched: i % 4 > 1,
        right_angled: i % 3 == 0,
    })
}

/// A robot, what it is called where something fails, and the numbers that its test draws.
type Subject = (String, RandomRobot, Random);

/// Robots of the first kinds with numbers of full length, and of these styles as people write them.
fn robots(first_seed: u64, count: usize, styles: Vec<Style>) -> impl Iterator<Item = Subject> {
    let drawn = kinds().take(count).zip(first_seed..).map(|(kind, seed)| {
        let mut random = Random(seed);
        (format!("{kind:?}, seed {seed}"), RandomRobot::new(&mut random, kind), random)
    });
    let written = styles.into_iter().enumerate().map(move |(k, style)| {
        let (branched, floating) = (k % 3 == 1, k % 5 == 2);
        let shape = Shape { joints: 2 + (k * 3) % 6, fixed: 3, branched, floating, sliding: 4 };
        let seed = first_seed + k as u64;
        (format!("{style:?}, {shape:?}, seed {seed}"), RandomRobot::as_written(style, shape, seed), Random(seed))
    });
    drawn.chain(written)
}

/// What errors of lengths are judged by: the lever of a metre of random objects, or the robot's reach where that is greater \[m\].
fn reach(robot: &Loaded) -> f64 {
    let length = |v: Vec3<Dd>| v.to_array().iter().fold(0.0, |sum: f64, x| sum.hypot(x.hi()));
    let levers = robot.model.bodies.iter().map(|b| length(b.placement.translation));
    let frames = robot.model.frames.iter().map(|f| length(f.placement.translation));
    1f64.max(levers.sum::<f64>() + frames.fold(0.0, f64::max))
}

fn compare(
    what: &str,
    robot: &str,
    found: &FunctionalCoordinates<Dd>,
    expected: &[Derivatives<Dd>],
    [reach, speed]: [f64; 2],
) {
    for (i, s) in expected.iter().enumerate() {
        let row: Vec<Dd> = s.jacobian.iter().copied().collect();
        let errors = [
            (found.value[i] - s.s).abs().hi(),
            (found.rate[i] - s.sd).abs().hi() / speed,
            (found.bias[i] - s.adjoint).abs().hi() / (speed * speed),
            found.jacobian[i].iter().zip(&row).fold(0.0, |m: f64, (a, b)| m.max((*a - *b).abs().hi())),
        ];
        let near = errors.iter().all(|e| CONTACT_AUTHORS.allows(*e / reach));
        assert!(near, "{what} {i} of {robot}: s, ṡ, A, J differ by {errors:?}");
    }
}

#[test]
fn functional_coordinates_of_random_robots_are_those_of_the_second_author() {
    for (name, robot, mut random) in robots(100, 12, Style::all()) {
        let kind = robot.kind;
        let (loaded, tree) = (robot.load_literally(), robot.reference());
        for frame in robot.frames() {
            if loaded.model.frame(&frame).and_then(|f| f.body).is_none() {
                continue;
            }
            let (contact, frames) = random_contact(&mut random, &loaded, &tree, &frame);
            let mut q = wide(&random.configuration(loaded.model.nq(), kind.floating));
            if kind.floating {
                let norm = q[3..7].iter().fold(Dd::ZERO, |sum, x| sum + *x * *x).sqrt();
                q[3..7].iter_mut().for_each(|x| *x /= norm);
            }
            let qd = wide(&random.list(loaded.model.nv(), 2.0));
            let speed = 1.0 + qd.iter().fold(0.0, |sum, x| sum + x.abs().hi());
            let reach = reach(&loaded);
            let coordinate = |c| chapter::functional_coordinate(&tree, &frames, &q, &qd, c);
            let plane = [
                Component::Position(0),
                Component::Position(1),
                Component::Position(2),
                Component::Axis(0),
                Component::Axis(1),
                Component::SecondAxis(1),
            ];
            let expected: Vec<_> = plane.into_iter().map(coordinate).collect();
            let motion = alg::relative_motion(&loaded.model, &contact, &q, &qd);
            let found = alg::functional_coordinates(&contact, &motion, &Coordinate::ALL);
            compare("coordinate", &name, &found, &expected, [reach, speed]);
            // along the path in the reduced robot
            let body = contact.frame.body.expect("checked above");
            let placement = loaded.reduced_frames[body].inverse().compose(&contact.frame.placement);
            let reduced = alg::reduced_relative_motion(&loaded.reduced, &contact, (body, placement), &q, &qd);
            let found = alg::functional_coordinates(
                &contact,
                &reduced.expect("the object is not on the robot"),
                &Coordinate::ALL,
            );
            compare("reduced coordinate", &name, &found, &expected, [reach, speed]);
            // curved
            let radius = frames.radius;
            for (surface, component) in [
                (Surface::Sphere { radius, hollow: false }, Component::Sphere),
                (Surface::Cylinder { radius, hollow: false }, Component::Cylinder),
            ] {
                let curved = Contact { surface, ..contact.clone() };
                let found = alg::functional_coordinates(&curved, &motion, &[Coordinate::Pz]);
                compare("distance", &name, &found, &[coordinate(component)], [reach, speed * 10.0]);
            }
        }
    }
}

/// Condition number of H in the infinity norm.
fn condition(h: &nalgebra::DMatrix<Dd>) -> f64 {
    let norm = |m: &nalgebra::DMatrix<Dd>| {
        let rows = m.row_iter().map(|row| row.iter().map(|x| x.abs().hi()).sum::<f64>());
        rows.fold(0.0f64, f64::max)
    };
    let n = h.nrows();
    let unit = |k: usize| nalgebra::DVector::from_fn(n, |i, _| if i == k { Dd::ONE } else { Dd::ZERO });
    let columns: Vec<_> = (0..n).map(|k| chapter::solve_symmetric(h, &unit(k))).collect();
    norm(h) * norm(&nalgebra::DMatrix::from_columns(&columns))
}

/// Regularised once with ε and refined: what is left of ε is its square, against the least eigenvalue, which the least pivot
/// bounds from above only. And two authors' rounding.
fn equations(pivot: f64) -> f64 {
    let ridge = RIDGE / pivot;
    1e4 * ridge * ridge + 1e-22 / pivot
}

#[test]
fn generated_contact_modes_of_random_robots_are_the_full_system_of_the_second_author() {
    let (mut compared, mut worst_rounded) = (0, 0.0f64);
    use Style::{Digits, Exported, Ratios, Round, Tiny, Units};
    let styles = vec![Digits(1), Digits(2), Digits(4), Digits(9), Digits(15), Exported, Round, Tiny, Units, Ratios];
    for (name, robot, mut random) in robots(300, 7, styles) {
        let kind = robot.kind;
        let (loaded, tree) = (robot.load_literally(), robot.reference());
        for frame in robot.frames() {
            let Some(body) = loaded.model.frame(&frame).and_then(|f| f.body) else { continue };
            let path = std::iter::successors(Some(body), |b| loaded.model.bodies[*b].parent);
            let movable: usize = path.map(|b| loaded.model.bodies[b].joint.kind.nv()).sum();
            let (contact, frames) = random_contact(&mut random, &loaded, &tree, &frame);
            let mut chosen = Coordinate::ALL.to_vec();
            random.shuffle(&mut chosen);
            chosen.truncate(1 + random.below(movable.saturating_sub(1).clamp(1, 5)));
            chosen.sort();
            let item = ContactItem {
                name: "touch".to_string(),
                frame: frame.clone(),
                axis: None,
                object: None,
                surface: SurfaceItem::Plane,
                constrained: chosen.clone(),
                free: vec![],
                friction: None,
                environment: None,
            };
            let contacts = SceneContacts { contacts: vec![item], ..SceneContacts::default() };
            let options = Options { scene: Scene { contacts, ..Scene::default() }, ..Options::default() };
            let modes = Mode::all(&options.scene);
            let graph = graph(&loaded, &options, &modes[0], ContactFunction::ForwardDynamics);

            let mut q = wide(&random.configuration(loaded.model.nq(), kind.floating));
            if kind.floating {
                let norm = q[3..7].iter().fold(Dd::ZERO, |sum, x| sum + *x * *x).sqrt();
                q[3..7].iter_mut().for_each(|x| *x /= norm);
            }
            let nv = loaded.model.nv();
            let (qd, tau) = (wide(&random.list(nv, 1.0)), wide(&random.list(nv, 10.0)));
            let plane = [
                Component::Position(0),
                Component::Position(1),
                Component::Position(2),
                Component::Axis(0),
                Component::Axis(1),
                Component::SecondAxis(1),
            ];
            let place = |c: &Coordinate| Coordinate::ALL.iter().position(|k| k == c).expect("one of six");
            let s: Vec<_> = chosen
                .iter()
                .map(|c| chapter::functional_coordinate(&tree, &frames, &q, &qd, plane[place(c)]))
                .collect();
            let least = |s: &Derivatives<Dd>| s.jacobian.iter().fold(0.0f64, |m, x| m.max(x.abs().hi()));
            if s.iter().any(|s| least(s) < 1e-3) {
                continue; // no joint moves the coordinate: the full system is singular
            }
            let (qdd, force) = chapter::constrained_motion(&tree, &s, &q, &qd, &tau);

            let Object::Moving(object) = &contact.object else { unreachable!("random objects move") };
            let list = |vectors: &[Vec3<Dd>]| vectors.iter().flat_map(|v| v.to_array()).collect::<Vec<Dd>>();
            let r = &object.pose.rotation;
            let inputs: Vec<Dd> = graph
                .inputs
                .iter()
                .flat_map(|port| match port.name.as_str() {
                    "q" => q.clone(),
                    "qd" => qd.clone(),
                    "tau" => tau.clone(),
                    "touch_axes" => list(&[contact.axis, contact.second_axis]),
                    "touch_pose" => list(&[object.pose.translation, r.column(0), r.column(1), r.column(2)]),
                    "touch_velocity" => list(&[object.velocity.linear, object.velocity.angular]),
                    "touch_acceleration" => list(&[object.acceleration.linear, object.acceleration.angular]),
                    other => panic!("no input `{other}`"),
                })
                .collect();
            let found = expr::evaluate::<Dd>(&graph, &inputs);
            let m = chosen.len();
            let pivot = found[nv + 3 * m].to_f64();
            if pivot < 1e-5 {
                continue; // nearly redundant by chance: the two solve different problems there
            }
            let narrow: Vec<f64> = inputs.iter().map(|x| x.to_f64()).collect();
            let rounded = expr::evaluate::<f64>(&graph, &narrow);
            // reactions are differences: of A and J q̈ without them, over the inverse mass
            let h = chapter::mass_matrix(&tree, &q);
            let fall = chapter::forward_dynamics(&tree, &q, &qd, &tau);
            let scale_of = |s: &Derivatives<Dd>| {
                let terms: f64 = s.jacobian.iter().zip(fall.iter()).map(|(j, x)| (*j * *x).abs().hi()).sum();
                (terms + s.adjoint.abs().hi()) / s.jacobian.dot(&chapter::solve_symmetric(&h, &s.jacobian)).hi()
            };
            let largest = |v: &[Dd]| v.iter().fold(0.0f64, |m, x| m.max(x.abs().hi()));
            let scales = [largest(fall.as_slice()), s.iter().map(scale_of).fold(0.0, f64::max)];
            let error = |found: &[Dd], expected: &[Dd], scale: f64| {
                let error = found.iter().zip(expected).fold(0.0f64, |m, (a, b)| m.max((*a - *b).abs().hi()));
                error / largest(expected).max(scale)
            };
            let rounded: Vec<Dd> = wide(&rounded);
            // a factor of H loses its condition number
            let condition = condition(&h);
            let groups = [("q̈", 0..nv, qdd.as_slice()), ("F", nv..nv + m, force.as_slice())];
            for ((what, at, expected), scale) in groups.into_iter().zip(scales) {
                let exact = error(&found[at.clone()], expected, scale);
                let about =
                    || format!("{what}, condition {condition:.0e}, {name}, {frame}, {chosen:?}, pivot {pivot:.1e}");
                assert!(exact <= equations(pivot), "{exact:.1e}: {}", about());
                let rounded = error(&rounded[at], expected, scale) * pivot;
                assert!(rounded <= CONTACT.most + f64::EPSILON * condition, "{rounded:.1e} in f64: {}", about());
                worst_rounded = worst_rounded.max(rounded);
            }
            compared += 1;
        }
    }
    println!("{compared} contacts, f64 to {worst_rounded:.1e} over the least pivot");
    assert!(compared > 12);
}
