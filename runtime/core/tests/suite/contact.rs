//! Laws of mechanics for a robot in contact, on the generic runtime: energy, impact, drift, and constraints that are nearly or
//! wholly redundant.

use straightline_core::algorithms::{
    applied_rows, baumgarte, bias_force, constrained_coordinates, constrained_forward_dynamics, functional_coordinates,
    impact, inverse_dynamics, kinetic_energy, mass_matrix, potential_energy, projection, relative_motion,
    ConstrainedMotion, Environment, FunctionalCoordinates, Ltdl, SpringDamper, Struck, Support,
};
use straightline_core::contact::{Contact, Coordinate, Friction, Object, Surface};
use straightline_core::model::{Body, Frame, Joint, JointEffects, JointKind, Limits, Model};
use straightline_core::phases::{ContactTask, Simulation};
use straightline_core::spatial::{Mat3, SpatialInertia, Sym3, Transform, Vec3};
use straightline_core::{Dd, Real};
use Coordinate::{Px, Py, Pz};

const RIDGE: f64 = 1e-12;
const GRAVITY: f64 = 9.81;

fn at(x: f64, y: f64, z: f64) -> Transform<f64> {
    Transform { rotation: Mat3::identity(), translation: Vec3::new(x, y, z) }
}

fn body(
    name: &str,
    kind: JointKind,
    parent: Option<usize>,
    iv: usize,
    placement: Transform<f64>,
    mass: f64,
) -> Body<f64> {
    let inertia = Sym3 { xx: 0.02, xy: 0.003, xz: -0.002, yy: 0.05, yz: 0.004, zz: 0.06 };
    Body {
        name: name.into(),
        parent,
        joint: Joint { name: name.into(), kind, iq: iv, iv, limits: Limits::default() },
        placement,
        inertia: SpatialInertia::new(mass, Vec3::new(0.45, 0.03, 0.02), inertia),
        link_frame: Transform::identity(),
        dense: false,
        effects: JointEffects::none(),
        load: None,
    }
}

/// A chain in the x-y plane of links of 1 m, y up, frame `tip` at its end.
fn chain(n: usize) -> Model<f64> {
    let link = |i: usize| {
        let (parent, x) = if i == 0 { (None, 0.0) } else { (Some(i - 1), 1.0) };
        body("link", JointKind::Revolute, parent, i, at(x, 0.0, 0.0), 2.0 - 0.3 * i as f64)
    };
    Model {
        name: "chain".into(),
        bodies: (0..n).map(link).collect(),
        gravity: Vec3::new(0.0, -GRAVITY, 0.0),
        couplings: vec![],
        closure: Default::default(),
        frames: vec![Frame { name: "tip".into(), body: Some(n - 1), placement: at(1.0, 0.0, 0.0) }],
        drives: vec![],
        base_parameters: Default::default(),
    }
}

fn contact(model: &Model<f64>, frame: usize, pose: Transform<f64>, constrained: &[Coordinate]) -> Contact<f64> {
    Contact {
        name: "contact".into(),
        frame: model.frames[frame].clone(),
        axis: Vec3::new(0.0, 0.0, 1.0),
        second_axis: Vec3::new(1.0, 0.0, 0.0),
        object: Object::Fixed(pose),
        surface: Surface::Plane,
        constrained: constrained.to_vec(),
        free: vec![],
        friction: None,
    }
}

/// What stands in for the equations of a scene: constrained coordinates at a state.
fn coordinates(model: &Model<f64>, contacts: &[Contact<f64>], q: &[f64], qd: &[f64]) -> FunctionalCoordinates<f64> {
    let all = contacts.iter().map(|c| constrained_coordinates(model, c, q, qd));
    all.fold(FunctionalCoordinates::default(), FunctionalCoordinates::and)
}

fn factor(model: &Model<f64>, q: &[f64]) -> Ltdl<f64> {
    Ltdl::factor(model, &mass_matrix(model, q))
}

fn motion(
    model: &Model<f64>,
    s: &FunctionalCoordinates<f64>,
    q: &[f64],
    qd: &[f64],
    tau: &[f64],
) -> ConstrainedMotion<f64> {
    let drive: Vec<f64> = tau.iter().zip(bias_force(model, q, qd)).map(|(t, h)| t - h).collect();
    let rigid = vec![Support::Rigid(0.0); s.len()];
    constrained_forward_dynamics(&factor(model, q), &drive, s, None, &rigid, RIDGE)
}

/// One step of Runge and Kutta's for a state of any length.
fn step(x: &mut [f64], dt: f64, rate: &mut dyn FnMut(&[f64]) -> Vec<f64>) {
    let along = |x: &[f64], k: &[f64], h: f64| x.iter().zip(k).map(|(x, k)| x + h * k).collect::<Vec<f64>>();
    let k1 = rate(x);
    let k2 = rate(&along(x, &k1, 0.5 * dt));
    let k3 = rate(&along(x, &k2, 0.5 * dt));
    let k4 = rate(&along(x, &k3, dt));
    for i in 0..x.len() {
        x[i] += dt / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]);
    }
}

/// A three-link chain whose tip slides on a tilted plane.
fn on_a_plane() -> (Model<f64>, Contact<f64>, Vec<f64>) {
    let model = chain(3);
    let q = vec![-1.3, -0.4, 0.5];
    // Z of the plane in the x-y plane, through the tip
    let (s, c) = 0.3f64.sin_cos();
    let rotation = Mat3::from_columns(Vec3::new(c, s, 0.0), Vec3::new(0.0, 0.0, -1.0), Vec3::new(-s, c, 0.0));
    let mut contact = contact(&model, 0, Transform { rotation, translation: Vec3::zero() }, &[Pz]);
    let height = coordinates(&model, &[contact.clone()], &q, &[0.0; 3]).value[0];
    contact.object = Object::Fixed(Transform { rotation, translation: Vec3::new(-s, c, 0.0).scale(height) });
    (model, contact, q)
}

/// What keeps a constraint closed.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Hold {
    /// s̈ = 0 alone.
    Nothing,
    /// Baumgarte, at 50 rad/s with a damping ratio of 1: far below what a step of 1 ms can follow.
    Baumgarte,
    /// s and ṡ are brought back after every step, s by two of Newton's steps.
    Projection,
}

/// How a step is made.
#[derive(Clone, Copy, Debug)]
enum Method {
    RungeKutta,
    SemiImplicitEuler,
}

/// The motion on the plane for so many steps: largest |s| up to 1, 10, 100, … steps, and the work of what the equations add to the
/// drives.
fn slide(steps: usize, dt: f64, hold: Hold, method: Method) -> (Vec<f64>, f64) {
    let (model, contact, q) = on_a_plane();
    let contacts = [contact];
    let mut x = [q, vec![0.3, -0.4, 0.2]].concat();
    let blow = |q: &[f64], qd: &[f64]| {
        let s = coordinates(&model, &contacts, q, qd);
        impact(&factor(&model, q), qd, &s, None, &[Struck::Rigid], 0.0, RIDGE).dqd
    };
    let start = blow(&x[..3], &x[3..]);
    (0..3).for_each(|i| x[3 + i] += start[i]);
    let (mut drift, mut drifts, mut work) = (0.0f64, Vec::new(), 0.0f64);
    let rate = |x: &[f64]| {
        let (q, qd) = (&x[..3], &x[3..]);
        let s = coordinates(&model, &contacts, q, qd);
        let wanted = match hold {
            Hold::Baumgarte => baumgarte(&s, 50.0, 1.0),
            _ => vec![0.0],
        };
        let drive: Vec<f64> = bias_force(&model, q, qd).iter().map(|h| -h).collect();
        let support = [Support::Rigid(wanted[0])];
        [qd.to_vec(), constrained_forward_dynamics(&factor(&model, q), &drive, &s, None, &support, RIDGE).qdd].concat()
    };
    for k in 1..=steps {
        if steps <= 10_000 {
            // H q̈ + h − τ with τ = 0 is what the reaction does
            let reaction = inverse_dynamics(&model, &x[..3], &x[3..], &rate(&x)[3..]);
            work += dt * reaction.iter().zip(&x[3..]).map(|(f, qd)| f * qd).sum::<f64>();
        }
        match method {
            Method::RungeKutta => step(&mut x, dt, &mut |x| rate(x)),
            Method::SemiImplicitEuler => {
                let rate = rate(&x);
                (0..3).for_each(|i| x[3 + i] += dt * rate[3 + i]);
                (0..3).for_each(|i| x[i] += dt * x[3 + i]);
            }
        }
        if hold == Hold::Projection {
            for _ in 0..2 {
                let s = coordinates(&model, &contacts, &x[..3], &x[3..]);
                let dq = projection(&factor(&model, &x[..3]), &s, &s.value, RIDGE);
                (0..3).for_each(|i| x[i] += dq[i]);
            }
            let dqd = blow(&x[..3], &x[3..]);
            (0..3).for_each(|i| x[3 + i] += dqd[i]);
        }
        drift = drift.max(coordinates(&model, &contacts, &x[..3], &x[3..]).value[0].abs());
        if k == 10usize.pow(drifts.len() as u32) {
            drifts.push(drift);
        }
    }
    drifts.push(drift);
    (drifts, work.abs())
}

#[test]
fn a_reaction_without_friction_does_no_work() {
    // 10 s, at instants when the constraint holds to rounding
    let (_, work) = slide(10_000, 1e-3, Hold::Projection, Method::RungeKutta);
    assert!(work < 1e-10, "work {work:.1e} J");
}

/// The largest |s| in 2 s.
fn drift_of(hold: Hold, method: Method) -> f64 {
    *slide(2_000, 1e-3, hold, method).0.last().expect("there is the last")
}

#[test]
fn projection_holds_the_constraint_to_rounding_and_baumgarte_bounds_its_drift() {
    for method in [Method::RungeKutta, Method::SemiImplicitEuler] {
        let [free, pulled, projected] =
            [Hold::Nothing, Hold::Baumgarte, Hold::Projection].map(|hold| drift_of(hold, method));
        println!("{method:?}: {free:.1e} m without, {pulled:.1e} m by Baumgarte, {projected:.1e} m by projection");
        // Newton's two steps square Euler's error of a step, 1e-5 m, twice
        assert!(projected < 1e-14 && projected < free && pulled < free, "{method:?}");
    }
}

/// Writes `generated_tests/record/2026-11-21-contact-drift.md`:
/// `cargo test --release -p straightline-core --test suite contact::drift -- --ignored --nocapture`
#[test]
#[ignore = "a million steps, three times"]
fn drift_over_a_million_steps() {
    let mut table = String::from(
        "# Drift of a constraint over 1e6 steps of 1 ms\n\nA frictionless chain of three links whose tip slides on a tilted plane, 1000 s \
         under gravity without drives, by the classical Runge-Kutta\nmethod. The largest |s| \\[m\\] up to the step at the head of \
         the column. Baumgarte: ω = 50 rad/s, ζ = 1. Projection: two of Newton's steps of s\nand one of ṡ after every \
         step.\n\n`cargo test --release -p straightline-core --test suite contact::drift -- --ignored --nocapture`\n\n\
         | held by | 1 | 10 | 100 | 1e3 | 1e4 | 1e5 | 1e6 |\n|---|---|---|---|---|---|---|---|\n",
    );
    for hold in [Hold::Nothing, Hold::Baumgarte, Hold::Projection] {
        let (drifts, _) = slide(1_000_000, 1e-3, hold, Method::RungeKutta);
        let cells: Vec<String> = drifts[..7].iter().map(|d| format!("{d:.1e}")).collect();
        let row = format!("| {} | {} |\n", format!("{hold:?}").to_lowercase(), cells.join(" | "));
        print!("{row}");
        table += &row;
        let bound = match hold {
            Hold::Nothing => f64::INFINITY,
            Hold::Baumgarte => 1e-7,
            Hold::Projection => 1e-9,
        };
        assert!(drifts[6] <= bound, "{hold:?}: {:.1e}", drifts[6]);
    }
    let record = concat!(env!("CARGO_MANIFEST_DIR"), "/../../generated_tests/record/2026-11-21-contact-drift.md");
    std::fs::write(record, table).expect("the record can be written");
}

#[test]
fn a_plastic_impact_loses_what_the_closed_form_says() {
    let model = chain(4);
    let (q, qd) = ([0.4, -0.7, 0.9, -0.3], [0.5, -1.1, 0.8, 1.7]);
    let s = coordinates(&model, &[contact(&model, 0, at(0.2, 0.1, 0.0), &[Px, Py])], &q, &qd);
    let factor = factor(&model, &q);
    let blow = impact(&factor, &qd, &s, None, &[Struck::Rigid; 2], 0.0, RIDGE);
    let after: Vec<f64> = qd.iter().zip(&blow.dqd).map(|(a, b)| a + b).collect();
    let lost = kinetic_energy(&model, &q, &qd) - kinetic_energy(&model, &q, &after);
    // ½ ṡᵀ (J H⁻¹ Jᵀ)⁻¹ ṡ
    let g = |i: usize, j: usize| {
        let column = factor.solve(&s.jacobian[j]);
        s.jacobian[i].iter().zip(&column).map(|(a, b)| a * b).sum::<f64>()
    };
    let determinant = g(0, 0) * g(1, 1) - g(0, 1) * g(1, 0);
    let [a, b] = [s.rate[0], s.rate[1]];
    let closed = 0.5 * (a * a * g(1, 1) - 2.0 * a * b * g(0, 1) + b * b * g(0, 0)) / determinant;
    assert!((blow.energy_loss - closed).abs() < 1e-12 * closed && (lost - closed).abs() < 1e-12 * closed);
    // restitution 1 loses nothing and turns ṡ round
    let elastic = impact(&factor, &qd, &s, None, &[Struck::Rigid; 2], 1.0, RIDGE);
    assert!(elastic.energy_loss.abs() < 1e-12 * closed);
    for (d, v) in elastic.dsd.iter().zip(&s.rate) {
        assert!((d + 2.0 * v).abs() < 1e-12);
    }
}

/// Presses the chain's tip on an object for 0.4 s: the energy of robot, masses and springs, with the heat of the dampers.
fn balance(
    object: &Environment<f64>,
    energy_of_object: &dyn Fn([f64; 4]) -> f64,
    heat: &dyn Fn([f64; 4]) -> f64,
) -> f64 {
    let (model, contact, q) = on_a_plane();
    let contacts = [contact];
    // q, q̇, e, ė, heat
    let mut x = [q, vec![0.2, -0.3, 0.1], vec![0.0; 3]].concat();
    let state = |x: &[f64]| {
        let s = coordinates(&model, &contacts, &x[..3], &x[3..6]);
        [s.value[0], s.rate[0], x[6], x[7]]
    };
    let energy = |x: &[f64]| {
        kinetic_energy(&model, &x[..3], &x[3..6])
            + potential_energy(&model, &x[..3])
            + energy_of_object(state(x))
            + x[8]
    };
    let first = energy(&x);
    for _ in 0..4_000 {
        step(&mut x, 1e-4, &mut |x| {
            let (q, qd) = (&x[..3], &x[3..6]);
            let s = coordinates(&model, &contacts, q, qd);
            let (here, own) = ((s.value[0], s.rate[0]), (x[6], x[7]));
            let drive: Vec<f64> = bias_force(&model, q, qd).iter().map(|h| -h).collect();
            let support = [object.support(here, own)];
            let m = constrained_forward_dynamics(&factor(&model, q), &drive, &s, None, &support, RIDGE);
            let e = object.motion(here, own);
            [qd.to_vec(), m.qdd, vec![e.velocity, e.acceleration, heat([here.0, here.1, x[6], x[7]])]].concat()
        });
    }
    (energy(&x) - first).abs()
}

#[test]
fn the_energy_that_robot_and_environment_lose_is_the_heat_of_the_dampers() {
    let spring = |stiffness, damping| SpringDamper { stiffness, damping };
    // (c)
    let mass = Environment::Mass { mass: 1.7, support: spring(4e3, 30.0) };
    let error = balance(&mass, &|[s, sd, ..]| 0.5 * (1.7 * sd * sd + 4e3 * s * s), &|[_, sd, ..]| 30.0 * sd * sd);
    assert!(error < 1e-8, "(c): {error:.1e} J");
    // (d)
    let cushioned = Environment::Cushioned { mass: 1.7, support: spring(4e3, 30.0), front: spring(9e3, 12.0) };
    let error = balance(
        &cushioned,
        &|[s, _, e, ed]| 0.5 * (1.7 * ed * ed + 4e3 * e * e + 9e3 * (s - e) * (s - e)),
        &|[_, sd, _, ed]| 30.0 * ed * ed + 12.0 * (sd - ed) * (sd - ed),
    );
    assert!(error < 1e-8, "(d): {error:.1e} J");
    // (e)
    let two =
        Environment::TwoMasses { front_mass: 0.4, front: spring(9e3, 12.0), mass: 1.7, support: spring(4e3, 30.0) };
    let error = balance(
        &two,
        &|[s, sd, e, ed]| 0.5 * (0.4 * sd * sd + 1.7 * ed * ed + 4e3 * e * e + 9e3 * (s - e) * (s - e)),
        &|[_, sd, _, ed]| 30.0 * ed * ed + 12.0 * (sd - ed) * (sd - ed),
    );
    assert!(error < 1e-8, "(e): {error:.1e} J");
    // both sides
    let both = Environment::BothSides { tool: spring(9e3, 12.0), surface: spring(4e3, 30.0) };
    let rate = |[s, sd, e, _]: [f64; 4]| both.motion((s, sd), (e, 0.0)).velocity;
    let error = balance(&both, &|[s, _, e, _]| 0.5 * (4e3 * e * e + 9e3 * (s - e) * (s - e)), &|x| {
        let ed = rate(x);
        30.0 * ed * ed + 12.0 * (x[1] - ed) * (x[1] - ed)
    });
    assert!(error < 1e-8, "both sides: {error:.1e} J");
}

/// A stretched arm with its tip held in the plane, over δ = 1 … 1e-12: F, s̈ that is left, and the least pivot.
fn stretched<T: Real + Into<f64>>(ridge: f64) -> Vec<(f64, [f64; 3])> {
    let model = chain(3).map(|x| T::constant(Dd::from(x)));
    let c = |x: f64| T::constant(Dd::from(x));
    let held = contact(&chain(3), 0, at(0.0, 0.0, 0.0), &[Px, Py]).map(c);
    let of = |exponent: i32| {
        let delta = 10f64.powi(-exponent);
        // with δ = 0 the arm is straight and cannot be shortened
        let (q, qd) = ([0.3, delta, -0.6 * delta].map(c), [T::zero(); 3]);
        let s = constrained_coordinates(&model, &held, &q, &qd);
        let factor = Ltdl::factor(&model, &mass_matrix(&model, &q));
        let tau = [1.0, -2.0, 0.5].map(c);
        let drive: Vec<T> = tau.iter().zip(bias_force(&model, &q, &qd)).map(|(t, h)| *t - h).collect();
        let rigid = vec![Support::Rigid(T::zero()); 2];
        let m = constrained_forward_dynamics(&factor, &drive, &s, None, &rigid, c(ridge));
        let all = [&m.qdd, &m.force, &m.sdd, &m.violation].into_iter().flatten();
        assert!(all.chain([&m.pivot]).all(|x| (*x).into().is_finite()), "δ = {delta:e}");
        let greatest = |v: &[T]| v.iter().fold(0.0f64, |m, x| m.max((*x).into().abs()));
        let found = [greatest(&m.force), greatest(&m.violation), m.pivot.into()];
        println!(
            "ε {ridge:.0e}, δ {delta:.0e}: F {:.1e} N, violation {:.1e} m/s², pivot {:.1e}",
            found[0], found[1], found[2]
        );
        (delta, found)
    };
    (0..=12).map(of).collect()
}

#[test]
fn a_stretched_arm_has_finite_reactions_that_grow_as_one_over_delta_until_the_ridge() {
    // at rest the arm answers τ with δ along itself and feels δ² of inverse mass: F ∝ 1/δ, until δ² meets the ridge, where F is
    // capped: at δ²/ε of 1/δ, and what is not held is the δ with which the arm answers
    for (rows, ridge, held, law, cap) in
        [(stretched::<f64>(RIDGE), RIDGE, 1e-8, 1e-5, 1e7), (stretched::<f32>(1e-6), 1e-6, 1e-4, 1e-2, 1e4)]
    {
        for pair in rows.windows(2) {
            let ((_, [before, ..]), (delta, [force, violation, pivot])) = (pair[0], pair[1]);
            if delta >= law {
                assert!(violation < held, "ε {ridge:e}, δ {delta:e}: {violation:.1e}");
                // the first steps are not small angles yet
                assert!(delta > 0.05 || (8.0..=14.0).contains(&(force / before)), "ε {ridge:e}, δ {delta:e}");
                // the pivot is δ² against a diagonal of the same size
                assert!(pivot > 0.05 * delta * delta - ridge && pivot < 100.0 * (delta * delta + ridge), "{pivot:e}");
            }
            assert!(force < cap, "ε {ridge:e}, δ {delta:e}: {force:.1e}");
            // numerics: at worst what a reaction at the ridge leaves of δ
            assert!(violation < 2.0 * ridge.sqrt(), "ε {ridge:e}, δ {delta:e}: {violation:.1e}");
        }
    }
}

/// A foot that is free in space, with contact frames at its corners.
fn foot() -> Model<f64> {
    let mut foot = body("foot", JointKind::Floating, None, 0, Transform::identity(), 3.0);
    foot.inertia = SpatialInertia::new(3.0, Vec3::new(0.01, 0.02, 0.05), foot.inertia.inertia_com);
    let corner = |i: usize| {
        let (x, y) = ([0.1, 0.1, -0.1, -0.1][i], [0.05, -0.05, 0.05, -0.05][i]);
        Frame { name: format!("corner{i}"), body: Some(0), placement: at(x, y, 0.0) }
    };
    Model {
        name: "foot".into(),
        bodies: vec![foot],
        gravity: Vec3::new(0.0, 0.0, -GRAVITY),
        couplings: vec![],
        closure: Default::default(),
        frames: (0..4).map(corner).collect(),
        drives: vec![],
        base_parameters: Default::default(),
    }
}

#[test]
fn a_flat_foot_on_four_points_stands_on_twelve_constraints_of_rank_six() {
    let model = foot();
    let contacts: Vec<Contact<f64>> =
        (0..4).map(|i| contact(&model, i, Transform::identity(), &[Px, Py, Pz])).collect();
    let (q, qd) = ([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], [0.0; 6]);
    let s = coordinates(&model, &contacts, &q, &qd);
    let m = motion(&model, &s, &q, &qd, &[0.0; 6]);
    let violation = m.violation.iter().fold(0.0f64, |f, x| f.max(x.abs()));
    let carried: f64 = m.force.iter().skip(2).step_by(3).sum();
    println!("violation {violation:.1e} m/s², pivot {:.1e}, carried {carried} N", m.pivot);
    assert!(violation <= 0.36 * RIDGE * GRAVITY, "{violation:.1e}");
    assert!((carried - 3.0 * GRAVITY).abs() < 1e-9 && m.pivot < 1e-11);
    // of all reactions that hold it these are the least, in a norm of the inverse masses: sideways nothing but what shear
    // must balance, and none is larger than the weight
    assert!(m.force.iter().all(|f| f.abs() < 3.0 * GRAVITY));

    // the same contact twice: half of the reaction each
    let one = coordinates(&model, &contacts[..1], &q, &qd);
    let twice = one.clone().and(one.clone());
    let (single, double) = (motion(&model, &one, &q, &qd, &[0.0; 6]), motion(&model, &twice, &q, &qd, &[0.0; 6]));
    for i in 0..3 {
        let both = double.force[i] + double.force[i + 3];
        assert!((both - single.force[i]).abs() < 1e-9 * GRAVITY, "{:?} {:?}", single.force, double.force);
        assert!((double.force[i] - double.force[i + 3]).abs() < 1e-3 * GRAVITY);
    }
}

#[test]
fn a_constraint_that_nothing_moves_is_finite() {
    // out of the plane of the chain
    let model = chain(2);
    let (q, qd) = ([0.3, 0.5], [0.1, -0.2]);
    let s = coordinates(&model, &[contact(&model, 0, at(0.0, 0.0, 0.1), &[Pz])], &q, &qd);
    let m = motion(&model, &s, &q, &qd, &[1.0, 2.0]);
    assert!(m.qdd.iter().chain(&m.force).chain([&m.pivot]).all(|x| x.is_finite()), "{m:?}");
}

#[test]
fn a_parallelogram_turns_as_its_closed_form() {
    // two cranks of 1 m, 2 m apart, and a coupler on the first whose end is held to the end of the second
    let mut model = chain(2);
    model.bodies[1].placement = at(1.0, 0.0, 0.0);
    model.bodies.push(body("rocker", JointKind::Revolute, None, 2, at(2.0, 0.0, 0.0), 1.4));
    model.frames = vec![
        Frame { name: "coupler end".into(), body: Some(1), placement: at(2.0, 0.0, 0.0) },
        Frame { name: "rocker end".into(), body: Some(2), placement: at(1.0, 0.0, 0.0) },
    ];
    let closed = Contact {
        object: Object::OnRobot(model.frames[1].clone()),
        ..contact(&model, 0, at(0.0, 0.0, 0.0), &[Px, Py])
    };
    let (angle, speed) = (0.8f64, 1.3);
    // the coupler stays parallel to the ground
    let (q, qd) = ([angle, -angle, angle], [speed, -speed, speed]);
    let s = coordinates(&model, &[closed], &q, &qd);
    assert!(s.value.iter().chain(&s.rate).all(|x| x.abs() < 1e-15));
    let tau = [2.0, 0.0, -0.5];
    let m = motion(&model, &s, &q, &qd, &tau);
    // cranks of inertia about their axes, the coupler a mass at a radius of 1 m
    let (inertia, com) = (0.06, 0.45 * 0.45 + 0.03 * 0.03);
    let masses = [2.0, 1.7, 1.4];
    let total = 2.0 * inertia + (masses[0] + masses[2]) * com + masses[1];
    let lever = 0.45 * angle.cos() - 0.03 * angle.sin();
    let weight = GRAVITY * ((masses[0] + masses[2]) * lever + masses[1] * angle.cos());
    let expected = (tau[0] - tau[1] + tau[2] - weight) / total;
    for (qdd, sign) in m.qdd.iter().zip([1.0, -1.0, 1.0]) {
        assert!((qdd - sign * expected).abs() < 1e-12 * expected.abs(), "{:?} against {expected}", m.qdd);
    }
}

/// A block of 2 kg that slides in the x-z plane: two prismatic joints without mass between them.
fn block() -> Model<f64> {
    let turned = |x: Vec3<f64>, y: Vec3<f64>, z: Vec3<f64>| Transform {
        rotation: Mat3::from_columns(x, y, z),
        translation: Vec3::zero(),
    };
    let (x, y, z) = (Vec3::new(1.0, 0.0, 0.0), Vec3::new(0.0, 1.0, 0.0), Vec3::unit_z());
    let mut model = chain(2);
    // z along x of the world; then z along its z
    model.bodies[0] = body("slide", JointKind::Prismatic, None, 0, turned(-z, y, x), 0.0);
    model.bodies[0].inertia = SpatialInertia::zero();
    model.bodies[1] = body("block", JointKind::Prismatic, Some(0), 1, turned(z, y, -x), 2.0);
    model.gravity = Vec3::new(0.0, 0.0, -GRAVITY);
    model.frames = vec![Frame { name: "sole".into(), body: Some(1), placement: Transform::identity() }];
    model
}

/// A block on a slope of this angle, with friction μ = 0.3 that is full above 1 µm/s.
fn slope(angle: f64) -> (Model<f64>, Contact<f64>) {
    let model = block();
    let (s, c) = angle.sin_cos();
    let rotation = Mat3::from_columns(Vec3::new(c, 0.0, s), Vec3::new(0.0, 1.0, 0.0), Vec3::new(-s, 0.0, c));
    let pose = Transform { rotation, translation: Vec3::zero() };
    let sole = contact(&model, 0, pose, &[Pz]);
    (model, Contact { friction: Some(Friction { coefficient: 0.3, speed: 1e-6 }), ..sole })
}

fn sliding(model: &Model<f64>, sole: &Contact<f64>, q: &[f64], qd: &[f64]) -> ConstrainedMotion<f64> {
    let relative = relative_motion(model, sole, q, qd);
    let s = functional_coordinates(sole, &relative, &sole.constrained);
    let drive: Vec<f64> = bias_force(model, q, qd).iter().map(|h| -h).collect();
    let rows = applied_rows(sole, &relative, &s);
    constrained_forward_dynamics(&factor(model, q), &drive, &s, Some(&rows), &[Support::Rigid(0.0)], RIDGE)
}

#[test]
fn a_block_slides_down_a_slope_as_coulomb_says() {
    for (speed, direction) in [(-0.7, -1.0), (0.7, 1.0)] {
        let angle = 0.5f64;
        let (model, sole) = slope(angle);
        let (s, c) = angle.sin_cos();
        let m = sliding(&model, &sole, &[0.0, 0.0], &[speed * c, speed * s]);
        // along the slope, upwards positive: −g sin α ∓ μ g cos α
        let along = m.qdd[0] * c + m.qdd[1] * s;
        let expected = -GRAVITY * s - direction * 0.3 * GRAVITY * c;
        assert!((along - expected).abs() < 1e-9, "{along} for {expected}");
        assert!((m.force[0] - 2.0 * GRAVITY * c).abs() < 1e-9);
    }
}

/// The block's phases: it slides up, and sticks where its speed along the slope has fallen to zero.
struct Sliding {
    model: Model<f64>,
    sole: Contact<f64>,
    stopped: f64,
}

impl ContactTask<4, 1> for Sliding {
    /// Whether it sticks.
    type Mode = bool;
    fn rate(&mut self, sticks: bool, _: f64, x: &[f64; 4]) -> [f64; 4] {
        let qdd = match sticks {
            true => {
                let held = Contact { constrained: vec![Px, Pz], friction: None, ..self.sole.clone() };
                let s = coordinates(&self.model, &[held], &x[..2], &x[2..]);
                let m = motion(&self.model, &s, &x[..2], &x[2..], &[0.0; 2]);
                // within the cone of friction, so that it does stick: tan α < μ
                assert!(m.force[0].abs() < 0.3 * m.force[1]);
                m.qdd
            }
            false => sliding(&self.model, &self.sole, &x[..2], &x[2..]).qdd,
        };
        [x[2], x[3], qdd[0], qdd[1]]
    }
    fn guards(&mut self, sticks: bool, _: f64, x: &[f64; 4]) -> [f64; 1] {
        [if sticks { f64::INFINITY } else { x[2] }]
    }
    fn event(&mut self, _: bool, _: usize, time: f64, x: &mut [f64; 4]) -> bool {
        self.stopped = time;
        (x[2], x[3]) = (0.0, 0.0);
        true
    }
}

#[test]
fn a_block_that_slides_up_a_flat_slope_stops_in_time_and_sticks() {
    let angle = 0.2f64; // tan 0.2 < 0.3
    let (model, sole) = slope(angle);
    let (s, c) = angle.sin_cos();
    let mut task = Sliding { model, sole, stopped: 0.0 };
    let mut simulation = Simulation { time: 0.0, mode: false, state: [0.0, 0.0, 0.8 * c, 0.8 * s] };
    for _ in 0..5000 {
        simulation.step(&mut task, 1e-4).expect("one event");
    }
    let expected = 0.8 / (GRAVITY * (s + 0.3 * c));
    // the last of the four stages may see friction turned round already: a sixth of the step
    assert!((task.stopped - expected).abs() < 1e-4 / 5.0, "{} for {expected}", task.stopped);
    let way = 0.5 * 0.8 * expected;
    assert!((simulation.state[0] - way * c).abs() < 1e-4 * 0.8 / 5.0 && simulation.state[2].abs() < 1e-9);
}
