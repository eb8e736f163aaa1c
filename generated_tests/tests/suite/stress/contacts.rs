//! Contacts: more points than can be told apart, constraints next to singular, a million steps of a closed one, stacks.
//!
//! On the generic runtime, whose algorithms are those that are traced: redundant and singular constraints are a matter of the
//! ridge relative to each row, not of the code that computes it.

use super::outcome::{Outcome, Size};
use straightline_core::algorithms::{
    baumgarte, bias_force, constrained_coordinates, constrained_forward_dynamics, impact, mass_matrix, projection,
    ConstrainedMotion, FunctionalCoordinates, Ltdl, Struck, Support,
};
use straightline_core::contact::{Contact, Coordinate, Object, Surface};
use straightline_core::model::{Body, Frame, Joint, JointEffects, JointKind, Limits, Model};
use straightline_core::spatial::{Mat3, SpatialInertia, Sym3, Transform, Vec3};
use straightline_core::{Dd, Real};
use Coordinate::{Px, Py, Pz};

const GRAVITY: f64 = 9.81;

fn at(x: f64, y: f64, z: f64) -> Transform<f64> {
    Transform { rotation: Mat3::identity(), translation: Vec3::new(x, y, z) }
}

fn body(kind: JointKind, parent: Option<usize>, index: usize, placement: Transform<f64>, mass: f64) -> Body<f64> {
    let name = format!("body{index}");
    let inertia = Sym3 { xx: 0.02, xy: 0.003, xz: -0.002, yy: 0.05, yz: 0.004, zz: 0.06 };
    Body {
        joint: Joint { name: name.clone(), kind, iq: index, iv: index, limits: Limits::default() },
        name,
        parent,
        placement,
        inertia: SpatialInertia::new(mass, Vec3::new(0.45, 0.03, 0.02), inertia),
        link_frame: Transform::identity(),
        dense: false,
        effects: JointEffects::none(),
        load: None,
    }
}

fn robot(bodies: Vec<Body<f64>>, frames: Vec<(usize, Transform<f64>)>, gravity: Vec3<f64>) -> Model<f64> {
    let frame = |(k, (body, placement))| Frame { name: format!("frame{k}"), body: Some(body), placement };
    Model {
        name: "robot".into(),
        bodies,
        gravity,
        couplings: vec![],
        closure: Default::default(),
        frames: frames.into_iter().enumerate().map(frame).collect(),
        drives: vec![],
        base_parameters: Default::default(),
    }
}

fn contact<T: Real>(frame: &Frame<T>, object: Object<T>, constrained: &[Coordinate]) -> Contact<T> {
    let (o, i) = (T::zero(), T::one());
    Contact {
        name: "contact".into(),
        frame: frame.clone(),
        axis: Vec3::new(o, o, i),
        second_axis: Vec3::new(i, o, o),
        object,
        surface: Surface::Plane,
        constrained: constrained.to_vec(),
        free: vec![],
        friction: None,
    }
}

fn c<T: Real>(x: f64) -> T {
    T::constant(Dd::from(x))
}

fn coordinates<T: Real>(model: &Model<T>, contacts: &[Contact<T>], q: &[T], qd: &[T]) -> FunctionalCoordinates<T> {
    let all = contacts.iter().map(|c| constrained_coordinates(model, c, q, qd));
    all.fold(FunctionalCoordinates::default(), FunctionalCoordinates::and)
}

fn factor<T: Real>(model: &Model<T>, q: &[T]) -> Ltdl<T> {
    Ltdl::factor(model, &mass_matrix(model, q))
}

fn held<T: Real>(
    model: &Model<T>,
    s: &FunctionalCoordinates<T>,
    wanted: &[T],
    [q, qd, tau]: [&[T]; 3],
    ridge: f64,
) -> ConstrainedMotion<T> {
    let drive: Vec<T> = tau.iter().zip(bias_force(model, q, qd)).map(|(t, h)| *t - h).collect();
    let support: Vec<Support<T>> = wanted.iter().map(|w| Support::Rigid(*w)).collect();
    constrained_forward_dynamics(&factor(model, q), &drive, s, None, &support, c(ridge))
}

/// The greatest modulus, infinite if any is no number.
fn greatest<T: Into<f64> + Copy>(values: &[T]) -> f64 {
    values.iter().map(|x| (*x).into().abs()).fold(0.0, |m, x| if x.is_finite() { m.max(x) } else { f64::INFINITY })
}

/// A flat foot on so many points of a circle.
fn foot(points: usize) -> Model<f64> {
    let mut foot = body(JointKind::Floating, None, 0, Transform::identity(), 3.0);
    foot.inertia = SpatialInertia::new(3.0, Vec3::new(0.01, 0.02, 0.05), foot.inertia.inertia_com);
    let place = |k: usize| {
        let (sin, cos) = (k as f64 * std::f64::consts::TAU / points as f64).sin_cos();
        (0, at(0.1 * cos, 0.05 * sin, 0.0))
    };
    robot(vec![foot], (0..points).map(place).collect(), Vec3::new(0.0, 0.0, -GRAVITY))
}

fn standing<T: Real + Into<f64>>(scalar: &str, points: usize, ridge: f64, digits: f64) -> Vec<Outcome> {
    let model = foot(points).map(|x| c::<T>(x));
    let ground = || Object::Fixed(Transform::<T>::identity());
    let contacts: Vec<Contact<T>> = model.frames.iter().map(|f| contact(f, ground(), &[Px, Py, Pz])).collect();
    let (q, qd) = ([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0].map(c::<T>), [T::zero(); 6]);
    let weight = 3.0 * GRAVITY;
    let stand = |contacts: &[Contact<T>]| {
        let s = coordinates(&model, contacts, &q, &qd);
        held(&model, &s, &vec![T::zero(); s.len()], [&q, &qd, &[T::zero(); 6]], ridge)
    };
    let m = stand(&contacts);
    let carried: f64 = m.force.iter().skip(2).step_by(3).map(|f| (*f).into()).sum();
    let [once, twice] = [stand(&contacts[..1]), stand(&[contacts[0].clone(), contacts[0].clone()])];
    let both: Vec<f64> =
        (0..3).map(|i| twice.force[i].into() + twice.force[i + 3].into() - once.force[i].into()).collect();
    let robot = format!("foot on {points} points");
    let line = |what: &str, value, bound| {
        Outcome::new(18, &robot, format!("{scalar}, ridge {ridge:.0e}: {what}"), value, bound)
    };
    vec![
        line("acceleration left at the points over ridge · g", greatest(&m.violation) / ridge / GRAVITY, 1.0),
        line("weight carried, relative error", (carried - weight).abs() / weight, digits),
        line("greatest reaction over the weight", greatest(&m.force) / weight, 1.0),
        line("the same contact twice against once, over the weight", greatest(&both) / weight, digits),
    ]
}

pub fn redundant(size: Size) -> Vec<Outcome> {
    let points = size.pick(&[4, 8][..], &[4, 8, 100][..]);
    let of = |n: &usize| {
        let double = standing::<f64>("f64", *n, 1e-12, 1e-9);
        // three rows per point: in f32 the rounding of 300 of them, 2e-5, is more than the usual ridge of 1e-6, and pivots vanish
        let ridge = if *n < 50 { 1e-6 } else { 1e-4 };
        double.into_iter().chain(standing::<f32>("f32", *n, ridge, 1e-3))
    };
    points.iter().flat_map(of).collect()
}

/// A chain in the x-y plane of links of 1 m, y up, a frame at its end.
fn chain(n: usize) -> Model<f64> {
    let link = |i: usize| {
        let (parent, x) = if i == 0 { (None, 0.0) } else { (Some(i - 1), 1.0) };
        body(JointKind::Revolute, parent, i, at(x, 0.0, 0.0), 2.0 - 0.3 * i as f64)
    };
    robot((0..n).map(link).collect(), vec![(n - 1, at(1.0, 0.0, 0.0))], Vec3::new(0.0, -GRAVITY, 0.0))
}

fn stretched<T: Real + Into<f64>>(scalar: &str, ridge: f64) -> Vec<Outcome> {
    let model = chain(3).map(|x| c::<T>(x));
    let hold = contact(&model.frames[0], Object::Fixed(Transform::identity()), &[Px, Py]);
    let mut outcomes = Vec::new();
    for exponent in 0..=12 {
        let delta = 10f64.powi(-exponent);
        let (q, qd) = ([0.3, delta, -0.6 * delta].map(c::<T>), [T::zero(); 3]);
        let s = constrained_coordinates(&model, &hold, &q, &qd);
        let m = held(&model, &s, &[T::zero(); 2], [&q, &qd, &[1.0, -2.0, 0.5].map(c::<T>)], ridge);
        let robot = format!("arm, 1e-{exponent} rad from stretched");
        // F grows as 1/δ until δ² meets the ridge, and is capped there; what is not held is at worst the ridge's root
        let line = |what: &str, value, bound| {
            Outcome::new(19, &robot, format!("{scalar}, ridge {ridge:.0e}: {what}"), value, bound)
        };
        outcomes.push(line("greatest reaction · √ridge, N", greatest(&m.force) * ridge.sqrt(), 20.0));
        outcomes.push(line("acceleration left over √ridge, m/s²", greatest(&m.violation) / ridge.sqrt(), 2.0));
    }
    outcomes
}

pub fn next_to_singular(_: Size) -> Vec<Outcome> {
    [stretched::<f64>("f64", 1e-12), stretched::<f32>("f32", 1e-6)].concat()
}

/// How a loop is kept closed.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Hold {
    Nothing,
    Baumgarte,
    Projection,
}

/// The greatest |s| over so many steps of 1 ms of a four-bar linkage that swings freely: two cranks and a coupler, whose end is
/// held to the end of the second crank.
fn drift(hold: Hold, steps: usize) -> f64 {
    let mut bodies = chain(2).bodies;
    bodies.push(body(JointKind::Revolute, None, 2, at(1.5, 0.2, 0.0), 1.4));
    let ends = vec![(1, at(1.6, 0.0, 0.0)), (2, at(1.0, 0.0, 0.0))];
    let model = robot(bodies, ends, Vec3::new(0.0, -GRAVITY, 0.0));
    let closed = contact(&model.frames[0], Object::OnRobot(model.frames[1].clone()), &[Px, Py]);
    let s_of = |x: &[f64]| constrained_coordinates(&model, &closed, &x[..3], &x[3..]);
    let mut x = vec![1.2, -1.0, 1.0, 0.0, 0.0, 0.0];
    let close = |x: &mut [f64], times: usize| {
        for _ in 0..times {
            let s = s_of(x);
            let dq = projection(&factor(&model, &x[..3]), &s, &s.value, 1e-12);
            (0..3).for_each(|i| x[i] += dq[i]);
        }
        let dqd = impact(&factor(&model, &x[..3]), &x[3..], &s_of(x), None, &[Struck::Rigid; 2], 0.0, 1e-12).dqd;
        (0..3).for_each(|i| x[3 + i] += dqd[i]);
    };
    close(&mut x, 20);
    let rate = |x: &[f64]| -> Vec<f64> {
        let s = s_of(x);
        let wanted = if hold == Hold::Baumgarte { baumgarte(&s, 50.0, 1.0) } else { vec![0.0; 2] };
        let m = held(&model, &s, &wanted, [&x[..3], &x[3..], &[0.0; 3]], 1e-12);
        [&x[3..], &m.qdd].concat()
    };
    let (mut worst, dt) = (0.0f64, 1e-3);
    for _ in 0..steps {
        let along = |x: &[f64], k: &[f64], h: f64| x.iter().zip(k).map(|(x, k)| x + h * k).collect::<Vec<f64>>();
        let k1 = rate(&x);
        let k2 = rate(&along(&x, &k1, 0.5 * dt));
        let k3 = rate(&along(&x, &k2, 0.5 * dt));
        let k4 = rate(&along(&x, &k3, dt));
        (0..6).for_each(|i| x[i] += dt / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]));
        if hold == Hold::Projection {
            close(&mut x, 2);
        }
        worst = worst.max(greatest(&s_of(&x).value));
    }
    worst
}

pub fn closed_loop(size: Size) -> Vec<Outcome> {
    let steps = size.pick(500, 1_000_000);
    let line = |what: &str, value, bound| {
        Outcome::new(
            20,
            "four-bar linkage",
            format!("f64, {steps} steps of 1 ms, {what}: gap of the loop, m"),
            value,
            bound,
        )
    };
    // without correction it may drift as far as it likes: it is there to be compared with
    vec![
        line("nothing but s̈ = 0, a tenth of the steps", drift(Hold::Nothing, steps / 10), 1e3),
        line("Baumgarte", drift(Hold::Baumgarte, steps), 1e-5),
        line("projection", drift(Hold::Projection, steps), 1e-12),
    ]
}

/// Blocks on top of each other, each sliding up and down by itself.
fn stack(masses: [f64; 2]) -> Model<f64> {
    let block = |i: usize| Body {
        inertia: SpatialInertia::new(masses[i], Vec3::zero(), Sym3 { xx: 0.1, yy: 0.1, zz: 0.1, ..Sym3::zero() }),
        ..body(JointKind::Prismatic, None, i, Transform::identity(), masses[i])
    };
    robot(vec![block(0), block(1)], vec![(0, at(0.0, 0.0, 0.0)), (1, at(0.0, 0.0, 0.0))], Vec3::new(0.0, 0.0, -GRAVITY))
}

fn stacked<T: Real + Into<f64>>(scalar: &str, masses: [f64; 2], ridge: f64, digits: f64) -> Vec<Outcome> {
    let model = stack(masses).map(|x| c::<T>(x));
    let ground = contact(&model.frames[0], Object::Fixed(Transform::identity()), &[Pz]);
    let between = contact(&model.frames[1], Object::OnRobot(model.frames[0].clone()), &[Pz]);
    let (q, falling) = ([T::zero(); 2], [-2.0, -3.0].map(c::<T>));
    let s = coordinates(&model, &[ground.clone(), between.clone()], &q, &[T::zero(); 2]);
    let m = held(&model, &s, &[T::zero(); 2], [&q, &[T::zero(); 2], &[T::zero(); 2]], ridge);
    let expected = [(masses[0] + masses[1]) * GRAVITY, masses[1] * GRAVITY];
    let error = (0..2).map(|k| (m.force[k].into() - expected[k]).abs() / expected[k]).collect::<Vec<f64>>();
    let work: Vec<f64> = (0..2).map(|k| m.force[k].into() * m.sdd[k].into() / expected[k]).collect();
    let s = coordinates(&model, &[ground, between], &q, &falling);
    let blow = impact(&factor(&model, &q), &falling, &s, None, &[Struck::Rigid; 2], T::zero(), c(ridge));
    let lost = 0.5 * (masses[0] * 4.0 + masses[1] * 9.0);
    let after: Vec<f64> = (0..2).map(|i| falling[i].into() + blow.dqd[i].into()).collect();
    let robot = format!("{:.0e} kg on {:.0e} kg", masses[1], masses[0]);
    let line = |what: &str, value, bound| {
        Outcome::new(21, &robot, format!("{scalar}, ridge {ridge:.0e}: {what}"), value, bound)
    };
    vec![
        line("reactions at rest, relative error", greatest(&error), digits),
        line("reaction · acceleration (complementarity), over the weight, m/s²", greatest(&work), 1e2 * digits),
        line("speed after a plastic impact, m/s", greatest(&after), 10.0 * digits),
        line("energy lost in it, relative error", (blow.energy_loss.into() - lost).abs() / lost, digits),
    ]
}

pub fn stacks(_: Size) -> Vec<Outcome> {
    let mut outcomes = Vec::new();
    for masses in [[1.0, 1.0], [1.0, 1e4], [1e4, 1.0]] {
        // the ridge of a row is relative to what the row's inverse mass is: of the light block between, and the heavy one on it
        let ratio = f64::max(masses[0] / masses[1], masses[1] / masses[0]);
        outcomes.extend(stacked::<f64>("f64", masses, 1e-12, 1e-14 + 1e-15 * ratio));
        outcomes.extend(stacked::<f32>("f32", masses, 1e-6, 1e-6 + 1e-7 * ratio));
    }
    outcomes
}
