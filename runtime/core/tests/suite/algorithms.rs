//! The laws of mechanics, as claims about the algorithms, on random robots.
//!
//! The robots are asymmetric on purpose: revolute and prismatic joints on oblique axes, offsets, full inertia tensors,
//! branches, coordinates in an order of their own; every second one floats. Time derivatives are exact: the algorithms
//! run over dual numbers. Most claims are checked in double-double, where a wrong formula has nowhere to hide.

use core::ops::{Add, Div, Mul, Neg, Sub};
use straightline_core::algorithms::*;
use straightline_core::joint::Measure;
use straightline_core::model::{Body, Coulomb, Frame, Joint, JointEffects, JointKind, Limits, Model};
use straightline_core::spatial::{Mat3, SpatialInertia, Sym3, Transform, Vec3};
use straightline_core::{Dd, Real};

/// Of the largest entry. Double-double has 1e-32; some hundred operations of mixed signs lose two digits (the worst of all
/// these cases is 3e-30), and other cases may lose two more.
const DD: f64 = 1e-28;

/// After a solve: the mass matrices have condition numbers up to 1e5, though the worst case here is 5e-30.
const DD_SOLVED: f64 = 1e-25;

// -------------------------------------------------------------------------------------------------------- dual numbers

/// x + ẋ ε with ε² = 0: a value with its time derivative.
#[derive(Clone, Copy, Debug)]
struct Dual<T> {
    value: T,
    rate: T,
}

impl<T: Real> Add for Dual<T> {
    type Output = Self;
    fn add(self, b: Self) -> Self {
        Dual { value: self.value + b.value, rate: self.rate + b.rate }
    }
}
impl<T: Real> Sub for Dual<T> {
    type Output = Self;
    fn sub(self, b: Self) -> Self {
        Dual { value: self.value - b.value, rate: self.rate - b.rate }
    }
}
impl<T: Real> Mul for Dual<T> {
    type Output = Self;
    fn mul(self, b: Self) -> Self {
        Dual { value: self.value * b.value, rate: self.rate * b.value + self.value * b.rate }
    }
}
impl<T: Real> Div for Dual<T> {
    type Output = Self;
    fn div(self, b: Self) -> Self {
        let value = self.value / b.value;
        Dual { value, rate: (self.rate - value * b.rate) / b.value }
    }
}
impl<T: Real> Neg for Dual<T> {
    type Output = Self;
    fn neg(self) -> Self {
        Dual { value: -self.value, rate: -self.rate }
    }
}
impl<T: Real> Real for Dual<T> {
    fn constant(value: Dd) -> Self {
        Dual { value: T::constant(value), rate: T::zero() }
    }
    fn sin_cos(self) -> (Self, Self) {
        let (s, c) = self.value.sin_cos();
        (Dual { value: s, rate: c * self.rate }, Dual { value: c, rate: -(s * self.rate) })
    }
    fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        Dual { value: root, rate: self.rate / (root + root) }
    }
    fn sign(self) -> Self {
        Dual { value: self.value.sign(), rate: T::zero() }
    }
}

/// A double-double number with its time derivative.
type Rate = Dual<Dd>;

// ------------------------------------------------------------------------------------------------------- random robots

/// A source of numbers; its own number is the seed.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        straightline_core::random::split_mix_64(&mut self.0)
    }
    fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }
    /// Uniform in (−1, 1), an f64.
    fn symmetric(&mut self) -> Dd {
        Dd::from((self.next() >> 11) as f64 / (1u64 << 52) as f64 - 1.0)
    }
    fn vector(&mut self) -> Vec3<Dd> {
        Vec3::new(self.symmetric(), self.symmetric(), self.symmetric())
    }
    fn numbers(&mut self, n: usize) -> Vec<Dd> {
        (0..n).map(|_| self.symmetric()).collect()
    }
    fn quaternion(&mut self) -> [Dd; 4] {
        let q = [self.symmetric(), self.symmetric(), self.symmetric(), self.symmetric() + Dd::from(1.5)];
        let norm = q.iter().fold(Dd::ZERO, |sum, &x| sum + x * x).sqrt();
        q.map(|x| x / norm)
    }
    /// Oblique, about one axis, a quarter turn, or none.
    fn rotation(&mut self) -> Mat3<Dd> {
        let (o, i) = (Dd::ZERO, Dd::ONE);
        match self.below(4) {
            0 => Mat3::identity(),
            1 => Mat3 { rows: [[i, o, o], [o, o, -i], [o, i, o]] },
            2 => {
                let (s, c) = self.symmetric().sin_cos();
                Mat3 { rows: [[i, o, o], [o, c, -s], [o, s, c]] }
            }
            _ => rotation_of(self.quaternion()),
        }
    }
    fn pose(&mut self) -> Transform<Dd> {
        Transform { rotation: self.rotation(), translation: self.vector() }
    }
    /// Four random point masses: a full tensor that a rigid body can have.
    fn inertia(&mut self) -> SpatialInertia<Dd> {
        let mut j = Sym3::zero();
        for _ in 0..4 {
            let r = self.vector();
            let point =
                Sym3 { xx: r.x * r.x, xy: r.x * r.y, xz: r.x * r.z, yy: r.y * r.y, yz: r.y * r.z, zz: r.z * r.z };
            j = j + point.second_moment_to_inertia();
        }
        SpatialInertia::new(self.symmetric() + Dd::from(1.5), self.vector(), j)
    }
}

/// As R(x) = x + 2 w (u × x) + 2 u × (u × x), not as the algorithms write it.
fn rotation_of([x, y, z, w]: [Dd; 4]) -> Mat3<Dd> {
    let u = Vec3::new(x, y, z);
    let two = Dd::from(2.0);
    let turned = |e: [f64; 3]| {
        let e = Vec3::from(e.map(Dd::from));
        e + (u.cross(e).scale(w) + u.cross(u.cross(e))).scale(two)
    };
    Mat3::from_columns(turned([1.0, 0.0, 0.0]), turned([0.0, 1.0, 0.0]), turned([0.0, 0.0, 1.0]))
}

fn shuffled(random: &mut Random, n: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..n).collect();
    for i in (1..n).rev() {
        order.swap(i, random.below(i + 1));
    }
    order
}

/// A tree of 2 to 9 joints, on a floating base if the seed is odd; those after the written ones have ball joints.
fn random_robot(seed: u64) -> Model<Dd> {
    let random = &mut Random(seed);
    let count = 2 + random.below(8);
    let mut bodies: Vec<Body<Dd>> = Vec::new();
    for i in 0..count {
        let kind = match (i, seed % 2, random.below(3)) {
            (0, 1, _) => JointKind::Floating,
            _ if seed > WRITTEN && !(i + seed as usize).is_multiple_of(3) => JointKind::Spherical,
            (_, _, 0) => JointKind::Prismatic,
            _ => JointKind::Revolute,
        };
        // mostly chains, with some branches, and on a fixed base sometimes a second root
        let parent = match (i, random.below(4)) {
            (0, _) => None,
            (_, 0) if seed.is_multiple_of(6) => None,
            (_, 1) => Some(random.below(i)),
            _ => Some(i - 1),
        };
        let mut placement = random.pose();
        let mut link_frame = random.pose();
        if kind == JointKind::Floating {
            (placement, link_frame) = (Transform::identity(), Transform::identity());
        }
        let joint = Joint { name: format!("joint{i}"), kind, iq: 0, iv: 0, limits: Limits::default() };
        let dense = composing_pays(parent, &placement.rotation);
        let inertia = random.inertia();
        bodies.push(Body {
            name: format!("link{i}"),
            parent,
            joint,
            placement,
            inertia,
            link_frame,
            dense,
            effects: JointEffects::none(),
            load: None,
        });
    }
    for which in 0..2 {
        let mut next = 0;
        for b in shuffled(random, count) {
            let joint = &mut bodies[b].joint;
            let (index, size) =
                if which == 0 { (&mut joint.iq, joint.kind.nq()) } else { (&mut joint.iv, joint.kind.nv()) };
            *index = next;
            next += size;
        }
    }
    let mut frames = vec![Frame { name: "tip".into(), body: Some(count - 1), placement: random.pose() }];
    frames.push(Frame { name: "side".into(), body: Some(random.below(count)), placement: random.pose() });
    if (OBLIQUE + 1..=WRITTEN).contains(&seed) {
        write_down(&mut bodies, &mut frames, seed, random);
    }
    Model {
        couplings: vec![],
        closure: Default::default(),
        name: format!("robot{seed}"),
        bodies,
        gravity: random.vector().scale(Dd::from(9.81)),
        frames,
        drives: vec![],
        base_parameters: Default::default(),
    }
}

/// So many robots have sixteen random digits, those after them numbers as people and exporters write them.
const OBLIQUE: u64 = 24;

/// So many robots have joints of one coordinate behind the base.
const WRITTEN: u64 = OBLIQUE + 10;

/// Few digits, dust beside right angles that are cut anywhere, links of 1e-6 kg, masses in ratios of 1e8, millimetres: by the seed.
fn write_down(bodies: &mut [Body<Dd>], frames: &mut [Frame<Dd>], seed: u64, random: &mut Random) {
    let style = seed % 5;
    let (length, mass) = [(1.0, 1.0), (1.0, 1.0), (1e-3, 1e-6), (1.0, 1.0), (1e3, 1.0)][style as usize];
    let digits = 1 + random.below(4) as i32;
    let mut written = |x: Dd, unit: f64| {
        let tens = 10f64.powi(digits);
        let cut = Dd::from((x.to_f64() * tens).round() / tens * unit);
        let dust = random.symmetric() * Dd::from(10f64.powi(-10 - random.below(9) as i32));
        if style == 1 {
            cut + dust
        } else {
            cut
        }
    };
    let pose = |pose: &mut Transform<Dd>, written: &mut dyn FnMut(Dd, f64) -> Dd| {
        pose.translation = Vec3::from(pose.translation.to_array().map(|x| written(x, length)));
        if style == 1 {
            // π/2 with few digits about an axis
            let angle = (written(Dd::from(core::f64::consts::FRAC_PI_2), 1.0)).sin_cos();
            let ((s, c), o, i) = (angle, Dd::ZERO, Dd::ONE);
            pose.rotation = Mat3 { rows: [[i, o, o], [o, c, -s], [o, s, c]] };
        }
    };
    for (k, body) in bodies.iter_mut().enumerate() {
        if body.joint.kind != JointKind::Floating {
            pose(&mut body.placement, &mut written);
            pose(&mut body.link_frame, &mut written);
            body.dense = composing_pays(body.parent, &body.placement.rotation);
        }
        let heavy = if style == 3 && k % 2 == 0 { 1e8 } else { mass };
        let old = body.inertia;
        let com = old.com.to_array().map(|x| written(x, length));
        let least = Dd::from(0.1);
        let m = (written(old.mass, 1.0) + least) * Dd::from(heavy);
        let j = old.inertia_com.map(|x| written(x, 1.0) * Dd::from(heavy * length * length));
        body.inertia = SpatialInertia::new(m, Vec3::from(com), j);
    }
    frames.iter_mut().for_each(|frame| pose(&mut frame.placement, &mut written));
}

/// A robot in a state of motion.
struct Case {
    seed: u64,
    model: Model<Dd>,
    q: Vec<Dd>,
    qd: Vec<Dd>,
    qdd: Vec<Dd>,
}

impl Case {
    fn new(seed: u64) -> Case {
        let model = random_robot(seed);
        let random = &mut Random(!seed);
        let mut q: Vec<Dd> = random.numbers(model.nq()).iter().map(|&x| x + x + x).collect();
        for joint in model.bodies.iter().map(|b| &b.joint) {
            if let Some(first) = joint.kind.row().quaternion {
                q[joint.iq + first..joint.iq + first + 4].copy_from_slice(&random.quaternion());
            }
        }
        let (qd, qdd) = (random.numbers(model.nv()), random.numbers(model.nv()));
        Case { seed, model, q, qd, qdd }
    }

    fn nv(&self) -> usize {
        self.model.nv()
    }

    /// dq/dt and d²q/dt²: not q̇ and q̈ of a floating base and of ball joints.
    fn configuration_rates(&self) -> (Vec<Dd>, Vec<Dd>) {
        let (mut rate, mut second) = (vec![Dd::ZERO; self.q.len()], vec![Dd::ZERO; self.q.len()]);
        let at = |x: &[Dd], i: usize| Vec3::new(x[i], x[i + 1], x[i + 2]);
        for body in &self.model.bodies {
            let Joint { kind, iq, iv, .. } = body.joint;
            let Some(first) = kind.row().quaternion else {
                (rate[iq], second[iq]) = (self.qd[iv], self.qdd[iv]);
                continue;
            };
            let quat: [Dd; 4] = self.q[iq + first..iq + first + 4].try_into().unwrap();
            let w = at(&self.qd, iv + first);
            if kind == JointKind::Floating {
                let (r, v) = (rotation_of(quat), at(&self.qd, iv));
                rate[iq..iq + 3].copy_from_slice(&(r * v).to_array());
                second[iq..iq + 3].copy_from_slice(&(r * (at(&self.qdd, iv) + w.cross(v))).to_array());
            }
            // d/dt quat = ½ quat ⊗ ω
            let quat_rate = half_product(quat, w);
            rate[iq + first..iq + first + 4].copy_from_slice(&quat_rate);
            let (a, b) = (half_product(quat_rate, w), half_product(quat, at(&self.qdd, iv + first)));
            (0..4).for_each(|k| second[iq + first + k] = a[k] + b[k]);
        }
        (rate, second)
    }

    /// q(t) and q̇(t) with their time derivatives.
    fn moving(&self) -> (Model<Rate>, Vec<Rate>, Vec<Rate>) {
        let dual = |x: &[Dd], rates: &[Dd]| x.iter().zip(rates).map(|(&value, &rate)| Dual { value, rate }).collect();
        (self.model.cast(), dual(&self.q, &self.configuration_rates().0), dual(&self.qd, &self.qdd))
    }

    fn without_gravity(&self) -> Model<Dd> {
        Model { gravity: Vec3::zero(), ..self.model.clone() }
    }

    fn inverse_dynamics(&self) -> Vec<Dd> {
        inverse_dynamics(&self.model, &self.q, &self.qd, &self.qdd)
    }

    #[track_caller]
    fn agree(&self, actual: &[Dd], expected: &[Dd], tolerance: f64) {
        assert_eq!(actual.len(), expected.len());
        let scale = expected.iter().fold(1.0f64, |m, x| m.max(x.abs().to_f64()));
        for (i, (&a, &e)) in actual.iter().zip(expected).enumerate() {
            let error = (a - e).abs().to_f64() / scale;
            let hi = |x: &[Dd]| x.iter().map(|x| x.to_f64()).collect::<Vec<_>>();
            assert!(
                error <= tolerance,
                "seed {}: entry {i}: {a:?} is not {e:?}: {error:e}\nq = {:?}\nqd = {:?}\nqdd = {:?}",
                self.seed,
                hi(&self.q),
                hi(&self.qd),
                hi(&self.qdd)
            );
        }
    }
}

/// ½ (quat ⊗ ω), quaternions as (x, y, z, w).
fn half_product([x, y, z, w]: [Dd; 4], omega: Vec3<Dd>) -> [Dd; 4] {
    let u = Vec3::new(x, y, z);
    let v = omega.scale(w) + u.cross(omega);
    [v.x, v.y, v.z, -u.dot(omega)].map(|x| x * Dd::HALF)
}

fn cases() -> impl Iterator<Item = Case> {
    (1..=WRITTEN + 12).map(Case::new)
}

fn product(h: &[Dd], x: &[Dd]) -> Vec<Dd> {
    h.chunks(x.len()).map(|row| dot(row, x)).collect()
}

fn dot(a: &[Dd], b: &[Dd]) -> Dd {
    a.iter().zip(b).fold(Dd::ZERO, |sum, (&a, &b)| sum + a * b)
}

fn sum(a: &[Dd], b: &[Dd]) -> Vec<Dd> {
    a.iter().zip(b).map(|(&a, &b)| a + b).collect()
}

fn unit(n: usize, i: usize) -> Vec<Dd> {
    let mut e = vec![Dd::ZERO; n];
    e[i] = Dd::ONE;
    e
}

fn rates<const N: usize>(x: [Rate; N]) -> [Dd; N] {
    x.map(|x| x.rate)
}

// ---------------------------------------------------------------------------------------------- forces and mass matrix

#[test]
fn a_column_of_the_mass_matrix_is_what_one_unit_of_acceleration_takes() {
    for case in cases() {
        let (n, model) = (case.nv(), case.without_gravity());
        let h = mass_matrix(&case.model, &case.q);
        for j in 0..n {
            let column: Vec<Dd> = (0..n).map(|i| h[i * n + j]).collect();
            let rest = vec![Dd::ZERO; n];
            case.agree(&column, &inverse_dynamics(&model, &case.q, &rest, &unit(n, j)), DD);
        }
    }
}

#[test]
fn torques_are_affine_in_the_acceleration() {
    for case in cases() {
        let (m, q, qd) = (&case.model, &case.q, &case.qd);
        let bias = bias_force(m, q, qd);
        let linear = product(&mass_matrix(m, q), &case.qdd);
        case.agree(&case.inverse_dynamics(), &sum(&linear, &bias), DD);
        case.agree(&sum(&velocity_force(m, q, qd), &gravity_force(m, q)), &bias, DD);
    }
}

#[test]
fn the_mass_matrix_is_positive_definite() {
    for case in cases() {
        let (n, h) = (case.nv(), mass_matrix(&case.model, &case.q));
        let mut a: Vec<Vec<Dd>> = h.chunks(n).map(<[Dd]>::to_vec).collect();
        for k in 0..n {
            assert!(a[k][k].to_f64() > 0.0, "seed {}: pivot {k} is {:?}", case.seed, a[k][k]);
            let pivot_row = a[k].clone();
            for row in &mut a[k + 1..] {
                let factor = row[k] / pivot_row[k];
                for (entry, &above) in row.iter_mut().zip(&pivot_row) {
                    *entry = *entry - factor * above;
                }
            }
        }
    }
}

#[test]
fn joints_on_different_branches_share_no_inertia() {
    for case in cases() {
        let (n, h, bodies) = (case.nv(), mass_matrix(&case.model, &case.q), &case.model.bodies);
        let carries = |a: usize, b: usize| core::iter::successors(Some(b), |&b| bodies[b].parent).any(|x| x == a);
        for a in 0..bodies.len() {
            for b in (0..bodies.len()).filter(|&b| !carries(a, b) && !carries(b, a)) {
                assert_eq!(h[bodies[a].joint.iv * n + bodies[b].joint.iv], Dd::ZERO, "seed {}", case.seed);
            }
        }
    }
}

#[test]
fn forward_dynamics_undoes_inverse_dynamics() {
    for case in cases() {
        let (m, q, qd, tau) = (&case.model, &case.q, &case.qd, &case.inverse_dynamics());
        case.agree(&forward_dynamics_aba(m, q, qd, tau), &case.qdd, DD_SOLVED);
        case.agree(&forward_dynamics_ltdl(m, q, qd, tau), &case.qdd, DD_SOLVED);
    }
}

#[test]
fn the_factored_mass_matrix_solves() {
    for case in cases() {
        let h = mass_matrix(&case.model, &case.q);
        let x = Ltdl::factor(&case.model, &h).solve(&case.qd);
        case.agree(&product(&h, &x), &case.qd, DD_SOLVED);
        case.agree(&solve_articulated(&case.model, &case.q, &case.qd), &x, DD_SOLVED);
    }
}

#[test]
fn branches_that_a_column_leaves_alone_follow_what_carries_them() {
    let mut followed = 0;
    for case in cases() {
        let (nv, h) = (case.model.nv(), mass_matrix(&case.model, &case.q));
        let (factor, responses) = (Ltdl::factor(&case.model, &h), BranchResponses::default());
        for k in 0..nv {
            let on_branch = |i: &usize| h[i * nv + k] != Dd::ZERO;
            let right: Vec<Dd> = (0..nv).map(|i| if on_branch(&i) { case.qd[i] } else { Dd::ZERO }).collect();
            followed += (0..nv).filter(|i| !on_branch(i)).count();
            let x = factor.solve_on_branch(k, &right, &responses);
            case.agree(&product(&h, &x), &right, DD_SOLVED);
            case.agree(&x, &factor.solve(&right), DD_SOLVED);
        }
        for inverse in [factor.inverse(), factor.inverse_by(&responses)] {
            for k in 0..nv {
                case.agree(&product(&h, &inverse[k * nv..(k + 1) * nv]), &unit(nv, k), DD_SOLVED);
            }
        }
        let mut all = factor.branches().concat();
        all.sort_unstable();
        assert_eq!(all, (0..nv).collect::<Vec<_>>(), "each coordinate is on one branch");
    }
    assert!(followed > 100, "{followed} entries are of other branches");
}

#[test]
fn the_wrench_of_a_joint_does_its_torque_along_the_axis() {
    for case in cases() {
        let (m, tau) = (&case.model, case.inverse_dynamics());
        let wrenches = joint_wrenches(m, &case.q, &case.qd, &case.qdd);
        let mut order: Vec<&Body<Dd>> = m.bodies.iter().collect();
        order.sort_by_key(|body| body.joint.iv);
        for (body, w) in order.into_iter().zip(&wrenches) {
            let (iv, axis) = (body.joint.iv, body.link_frame.rotation.transpose_mul(Vec3::unit_z()));
            match (body.joint.kind.elementary(), body.joint.kind.is_base()) {
                (Some(Measure::Angle), _) => case.agree(&[w.moment.dot(axis)], &[tau[iv]], DD),
                (Some(Measure::Length), _) => case.agree(&[w.force.dot(axis)], &[tau[iv]], DD),
                (None, true) => {
                    let both = [w.force.to_array(), w.moment.to_array()].concat();
                    case.agree(&both, &tau[iv..iv + 6], DD);
                }
                (None, false) => {
                    let moment = body.link_frame.rotation * w.moment;
                    case.agree(&moment.to_array(), &tau[iv..iv + 3], DD);
                }
            }
        }
    }
}

// ---------------------------------------------------------------------------------------------------- energy, momentum

#[test]
fn kinetic_energy_is_half_the_square_of_the_velocity_in_the_mass_matrix() {
    for case in cases() {
        let h_qd = product(&mass_matrix(&case.model, &case.q), &case.qd);
        let energy = kinetic_energy(&case.model, &case.q, &case.qd);
        case.agree(&[energy], &[dot(&case.qd, &h_qd) * Dd::HALF], DD);
    }
}

#[test]
fn energy_grows_by_the_power_of_the_drives() {
    for case in cases() {
        let (model, q, qd) = case.moving();
        let energy = kinetic_energy(&model, &q, &qd) + potential_energy(&model, &q);
        case.agree(&[energy.rate], &[dot(&case.qd, &case.inverse_dynamics())], DD);
    }
}

#[test]
fn gravity_forces_are_the_gradient_of_the_potential_energy() {
    for case in cases() {
        let gradient: Vec<Dd> = (0..case.nv())
            .map(|i| {
                let along = Case { qd: unit(case.nv(), i), ..Case::new(case.seed) };
                let (model, q, _) = along.moving();
                potential_energy(&model, &q).rate
            })
            .collect();
        case.agree(&gravity_force(&case.model, &case.q), &gradient, DD);
    }
}

#[test]
fn the_centre_of_mass_moves_with_the_momentum() {
    for case in cases() {
        let (model, q, qd) = case.moving();
        let moving = momentum(&model, &q, &qd);
        let now = momentum(&case.model, &case.q, &case.qd);
        case.agree(&rates(moving.com.to_array()), &now.com_velocity.to_array(), DD);
        case.agree(&now.com_velocity.scale(now.mass).to_array(), &now.linear.to_array(), DD);
        case.agree(&[now.mass], &[case.model.bodies.iter().fold(Dd::ZERO, |sum, b| sum + b.inertia.mass)], DD);
        let weight = case.model.gravity.scale(now.mass);
        case.agree(&[-weight.dot(now.com)], &[potential_energy(&case.model, &case.q)], DD);
    }
}

#[test]
fn momentum_grows_by_the_wrench_on_the_roots() {
    for case in cases() {
        let (model, q, qd) = case.moving();
        let growth = momentum(&model, &q, &qd);
        let now = momentum(&case.model, &case.q, &case.qd);
        let wrenches = joint_wrenches(&case.model, &case.q, &case.qd, &case.qdd);
        let mut order: Vec<usize> = (0..case.model.bodies.len()).collect();
        order.sort_by_key(|&b| case.model.bodies[b].joint.iv);

        let mut force = case.model.gravity.scale(now.mass);
        let mut moment = Vec3::zero();
        for (b, w) in order.into_iter().zip(&wrenches) {
            if case.model.bodies[b].parent.is_none() {
                let body = &case.model.bodies[b];
                // at the joint's origin, in link axes
                let placement = Transform { rotation: body.link_frame.rotation, translation: Vec3::zero() };
                let joint = Frame { name: String::new(), body: Some(b), placement };
                let x = forward_kinematics(&case.model, &case.q, &[&joint])[0];
                let f = x.rotation * w.force;
                force = force + f;
                moment = moment + x.rotation * w.moment + (x.translation - now.com).cross(f);
            }
        }
        case.agree(&rates(growth.linear.to_array()), &force.to_array(), DD);
        case.agree(&rates(growth.angular.to_array()), &moment.to_array(), DD);
    }
}

// ------------------------------------------------------------------------------------------ rotors, friction, springs

/// The case with an effect of every kind, and none, on its joints.
fn with_effects(mut case: Case) -> Case {
    let random = &mut Random(case.seed ^ 0x5eed);
    for body in case.model.bodies.iter_mut().filter(|b| b.joint.kind.is_single()) {
        let mut size = || random.symmetric().abs() + Dd::from(0.25);
        body.effects = JointEffects {
            rotor_inertia: Some(size()),
            damping: size(),
            coulomb: Coulomb::Sign(size()),
            stiffness: size(),
            spring_rest: size() - Dd::ONE,
        };
        match random.below(4) {
            0 => body.effects = JointEffects::none(),
            1 => body.effects.rotor_inertia = None,
            2 => {
                let speed = random.symmetric().abs() + Dd::from(0.125);
                body.effects.coulomb = Coulomb::Smooth { force: Dd::from(0.7), speed };
            }
            _ => {}
        }
    }
    case
}

/// Force of the dampers and of Coulomb friction on a coordinate, as the handbook writes it.
fn losses(case: &Case) -> Vec<Dd> {
    let mut forces = vec![Dd::ZERO; case.nv()];
    for body in case.model.bodies.iter().filter(|b| b.joint.kind.is_single()) {
        let qd = case.qd[body.joint.iv];
        let magnitude = qd.abs();
        let dry = match body.effects.coulomb {
            Coulomb::Off => Dd::ZERO,
            Coulomb::Sign(f) => f * (qd / magnitude),
            Coulomb::Smooth { force, speed } => force * (qd / (magnitude * magnitude + speed * speed).sqrt()),
        };
        forces[body.joint.iv] = body.effects.damping * qd + dry;
    }
    forces
}

/// How forces change at these rates of q, q̇ and q̈, exactly.
fn force_rates(model: &Model<Dd>, motion: [&[Dd]; 3], rates: [&[Dd]; 3]) -> Vec<Dd> {
    let along =
        |k: usize| motion[k].iter().zip(rates[k]).map(|(&value, &rate)| Dual { value, rate }).collect::<Vec<Rate>>();
    inverse_dynamics(&model.cast(), &along(0), &along(1), &along(2)).into_iter().map(|force| force.rate).collect()
}

#[test]
fn a_free_base_feels_neither_gravity_nor_its_own_velocity() {
    let mut free = 0;
    for case in cases().map(with_effects) {
        let (m, q, qd, qdd, nv) = (&case.model, &case.q, &case.qd, &case.qdd, case.nv());
        let Some(base) = FallingBase::of(m, q, qd) else { continue };
        free += 1;
        let (weightless, at_rest, falling) = (case.without_gravity(), base.at_rest(qd), base.falling(qdd));
        case.agree(&inverse_dynamics(&weightless, q, &at_rest, &falling), &case.inverse_dynamics(), DD);
        case.agree(&base.in_world(&falling), qdd, DD);

        // ∂τ/∂x is −H ∂q̈/∂x, and what is left to be solved for
        let (mut by_position, mut by_velocity) = (vec![Dd::ZERO; nv * nv], vec![Dd::ZERO; nv * nv]);
        base.complete(&mut by_position, &mut by_velocity);
        let h = mass_matrix(m, q);
        let less = |a: &[Dd], b: &[Dd]| a.iter().zip(b).map(|(a, b)| *a - *b).collect::<Vec<Dd>>();
        let (still, root) = (vec![Dd::ZERO; nv], m.bodies.iter().find(|body| body.parent.is_none()).unwrap());
        for k in root.joint.iv..root.joint.iv + 6 {
            let along = unit(nv, k);
            let column = |matrix: &[Dd]| (0..nv).map(|i| matrix[i * nv + k]).collect::<Vec<Dd>>();
            let pose = m.configuration_rate(q, &along);
            let of_position = force_rates(m, [q, qd, qdd], [&pose, &still, &still]);
            case.agree(&of_position, &less(&still, &product(&h, &column(&by_position))), DD);
            let (fixed, motion) = (vec![Dd::ZERO; q.len()], [&q[..], &at_rest, &falling]);
            let left = match k < root.joint.iv + 3 {
                true => still.clone(),
                false => force_rates(&weightless, motion, [&fixed, &along, &still]),
            };
            let of_velocity = force_rates(m, [q, qd, qdd], [&fixed, &along, &still]);
            case.agree(&of_velocity, &less(&left, &product(&h, &column(&by_velocity))), DD);
        }
    }
    assert!(free > 2, "{free} of the robots have one root that floats");
}

#[test]
fn forward_dynamics_undoes_inverse_dynamics_with_rotors_friction_and_springs() {
    for case in cases().map(with_effects) {
        let (m, q, qd, tau) = (&case.model, &case.q, &case.qd, &case.inverse_dynamics());
        let needed = |qdd: &[Dd]| sum(&product(&mass_matrix(m, q), qdd), &bias_force(m, q, qd));
        for found in [forward_dynamics_aba(m, q, qd, tau), forward_dynamics_ltdl(m, q, qd, tau)] {
            match case.seed <= OBLIQUE {
                true => case.agree(&found, &case.qdd, DD_SOLVED),
                // rotors on links of 1e-6 kg and 1e-12 kg·m²: judged by what accelerations leave of τ
                false => case.agree(&needed(&found), tau, DD_SOLVED),
            }
        }
        case.agree(tau, &needed(&case.qdd), DD);
    }
}

#[test]
fn energy_grows_by_the_power_of_the_drives_less_what_friction_takes() {
    for case in cases().map(with_effects) {
        let (model, q, qd) = case.moving();
        let energy = kinetic_energy(&model, &q, &qd) + potential_energy(&model, &q);
        let power = dot(&case.qd, &case.inverse_dynamics());
        let lost = dot(&case.qd, &losses(&case));
        assert!(lost.to_f64() >= 0.0, "seed {}", case.seed);
        case.agree(&[energy.rate], &[power - lost], DD);
    }
}

#[test]
fn a_rotor_is_inertia_on_the_diagonal_of_the_mass_matrix_alone() {
    for case in cases() {
        let rigid = mass_matrix(&case.model, &case.q);
        let case = with_effects(case);
        let (n, mut expected) = (case.nv(), rigid);
        for body in &case.model.bodies {
            let iv = body.joint.iv;
            expected[iv * n + iv] = expected[iv * n + iv] + body.effects.rotor_inertia.unwrap_or(Dd::ZERO);
        }
        case.agree(&mass_matrix(&case.model, &case.q), &expected, DD);
        let h_qd = product(&expected, &case.qd);
        case.agree(&[kinetic_energy(&case.model, &case.q, &case.qd)], &[dot(&case.qd, &h_qd) * Dd::HALF], DD);
    }
}

#[test]
fn smooth_coulomb_friction_becomes_the_sign_as_its_speed_vanishes() {
    for case in cases().map(with_effects) {
        let with_coulomb = |coulomb: fn(Dd) -> Coulomb<Dd>| {
            let mut model = case.model.clone();
            for body in model.bodies.iter_mut().filter(|b| b.joint.kind.is_single()) {
                body.effects.coulomb = coulomb(Dd::from(0.7));
            }
            bias_force(&model, &case.q, &case.qd)
        };
        let sign = with_coulomb(Coulomb::Sign);
        // 1 − |q̇|/√(q̇² + w²) ≈ ½ (w/q̇)²; the speeds of these cases are above 1e-4
        case.agree(&with_coulomb(|force| Coulomb::Smooth { force, speed: Dd::from(1e-10) }), &sign, 1e-12);
        case.agree(&with_coulomb(|force| Coulomb::Smooth { force, speed: Dd::from(1e-20) }), &sign, DD);
    }
}

#[test]
fn friction_is_zero_at_rest() {
    for case in cases().map(with_effects) {
        let at_rest = vec![Dd::ZERO; case.nv()];
        let springs = passive_force(&case.model, &case.q, &at_rest);
        for body in case.model.bodies.iter().filter(|b| b.joint.kind.is_single()) {
            let spring = body.effects.stiffness * (case.q[body.joint.iq] - body.effects.spring_rest);
            assert_eq!(springs[body.joint.iv], spring, "seed {}", case.seed);
        }
    }
}

// ---------------------------------------------------------------------------------------------------------- kinematics

#[test]
fn the_velocity_of_a_frame_is_the_rate_of_its_pose() {
    for case in cases() {
        let (model, q, _) = case.moving();
        for (moving, frame) in model.frames.iter().zip(&case.model.frames) {
            let pose = forward_kinematics(&model, &q, &[moving])[0];
            let velocity = frame_velocity(&case.model, &case.q, &case.qd, frame);
            case.agree(&rates(pose.translation.to_array()), &velocity.linear.to_array(), DD);
            // Ṙ = [ω×] R
            for k in 0..3 {
                let axis = pose.rotation.column(k);
                let turned = velocity.angular.cross(axis.map(|x| x.value));
                case.agree(&rates(axis.to_array()), &turned.to_array(), DD);
            }
        }
    }
}

#[test]
fn the_jacobian_maps_velocities() {
    for case in cases() {
        for frame in &case.model.frames {
            let v = frame_velocity(&case.model, &case.q, &case.qd, frame);
            let both = [v.linear.to_array(), v.angular.to_array()].concat();
            case.agree(&product(&jacobian(&case.model, &case.q, frame), &case.qd), &both, DD);
        }
    }
}

#[test]
fn the_acceleration_of_a_frame_is_the_rate_of_its_velocity() {
    for case in cases() {
        let (model, q, qd) = case.moving();
        for (moving, frame) in model.frames.iter().zip(&case.model.frames) {
            let velocity = frame_velocity(&model, &q, &qd, moving);
            let a = frame_acceleration(&case.model, &case.q, &case.qd, &case.qdd, frame);
            case.agree(&rates(velocity.linear.to_array()), &a.linear.to_array(), DD);
            case.agree(&rates(velocity.angular.to_array()), &a.angular.to_array(), DD);
        }
    }
}

#[test]
fn the_acceleration_of_a_frame_is_the_second_derivative_of_its_position() {
    for case in cases() {
        let (rate, second) = case.configuration_rates();
        let jet = |i: usize| Dual {
            value: Dual { value: case.q[i], rate: rate[i] },
            rate: Dual { value: rate[i], rate: second[i] },
        };
        let q: Vec<Dual<Dual<Dd>>> = (0..case.q.len()).map(jet).collect();
        let model: Model<Dual<Dual<Dd>>> = case.model.cast();
        for (moving, frame) in model.frames.iter().zip(&case.model.frames) {
            let pose = forward_kinematics(&model, &q, &[moving])[0];
            let a = frame_acceleration(&case.model, &case.q, &case.qd, &case.qdd, frame);
            case.agree(&pose.translation.to_array().map(|x| x.rate.rate), &a.linear.to_array(), DD);
        }
    }
}

#[test]
fn acceleration_is_the_jacobian_times_qdd_plus_its_bias() {
    for case in cases() {
        for frame in &case.model.frames {
            let (m, q, qd, qdd) = (&case.model, &case.q, &case.qd, &case.qdd);
            let a = frame_acceleration(m, q, qd, qdd, frame);
            let bias = jacobian_bias(m, q, qd, frame);
            let linear = product(&jacobian(m, q, frame), qdd);
            let expected = sum(&linear, &[bias.linear.to_array(), bias.angular.to_array()].concat());
            case.agree(&[a.linear.to_array(), a.angular.to_array()].concat(), &expected, DD);
        }
    }
}

/// Where the six numbers of a frame's motion are taken.
#[derive(Clone, Copy, Debug)]
enum Convention {
    /// Of its origin, along its own axes.
    OwnAxes,
    /// Of what moves with it through the world's origin, along the world's axes.
    WorldOrigin,
}

/// A motion of a frame's origin, linear and angular part, as the six numbers of a convention.
fn in_convention<T: Real>(convention: Convention, pose: &Transform<T>, linear: Vec3<T>, angular: Vec3<T>) -> Vec<T> {
    let [linear, angular] = match convention {
        Convention::OwnAxes => [linear, angular].map(|v| pose.rotation.transpose_mul(v)),
        Convention::WorldOrigin => [linear - angular.cross(pose.translation), angular],
    };
    [linear.to_array(), angular.to_array()].concat()
}

/// The twist of a frame, by its pose and the velocity of its origin.
fn twist<T: Real>(convention: Convention, model: &Model<T>, [q, qd]: [&[T]; 2], frame: &Frame<T>) -> Vec<T> {
    let velocity = frame_velocity(model, q, qd, frame);
    in_convention(convention, &forward_kinematics(model, q, &[frame])[0], velocity.linear, velocity.angular)
}

/// The rates of these six numbers: spatial acceleration, by the classical one of the origin.
fn twist_rate<T: Real>(convention: Convention, model: &Model<T>, [q, qd, qdd]: [&[T]; 3], frame: &Frame<T>) -> Vec<T> {
    let (v, a) = (frame_velocity(model, q, qd, frame), frame_acceleration(model, q, qd, qdd, frame));
    let spatial = a.linear - v.angular.cross(v.linear);
    in_convention(convention, &forward_kinematics(model, q, &[frame])[0], spatial, a.angular)
}

type FrameDerivativesOf = fn(&Model<Dd>, [&[Dd]; 3], &Frame<Dd>) -> FrameDerivativeBlocks<Dd>;

const CONVENTIONS: [(Convention, FrameDerivativesOf); 2] = [
    (Convention::OwnAxes, frame_derivatives_in_own_axes::<Dd>),
    (Convention::WorldOrigin, frame_derivatives_at_world_origin::<Dd>),
];

/// Matrix by rows, from its columns.
fn by_rows(columns: &[Vec<Dd>]) -> Vec<Dd> {
    (0..columns[0].len()).flat_map(|row| columns.iter().map(move |column| column[row])).collect()
}

fn rates_of(x: Vec<Rate>) -> Vec<Dd> {
    x.into_iter().map(|x| x.rate).collect()
}

#[test]
fn derivatives_of_twists_are_rates_of_their_numbers() {
    for case in cases() {
        let model: Model<Rate> = case.model.cast();
        let held = |x: &[Dd]| x.iter().map(|&value| Rate { value, rate: Dd::ZERO }).collect::<Vec<_>>();
        for ((convention, derivatives), (frame, moving)) in
            CONVENTIONS.into_iter().flat_map(|of| case.model.frames.iter().zip(&model.frames).map(move |f| (of, f)))
        {
            let found = derivatives(&case.model, [&case.q, &case.qd, &case.qdd], frame);
            let columns = |of: &dyn Fn(&Case, Vec<Dd>) -> Vec<Dd>| {
                by_rows(&(0..case.nv()).map(|k| of(&case, unit(case.nv(), k))).collect::<Vec<_>>())
            };
            // q as it moves with these velocities
            let along = |qd: &[Dd]| {
                let of = Case {
                    seed: case.seed,
                    model: case.model.clone(),
                    q: case.q.clone(),
                    qd: qd.to_vec(),
                    qdd: case.qdd.clone(),
                };
                of.moving().1
            };
            let with = |x: &[Dd], rates: &[Dd]| {
                x.iter().zip(rates).map(|(&value, &rate)| Rate { value, rate }).collect::<Vec<_>>()
            };
            let [qd, qdd] = [&case.qd, &case.qdd].map(|x| held(x));
            let dv_dq = columns(&|_, e| rates_of(twist(convention, &model, [&along(&e), &qd], moving)));
            case.agree(&found.dv_dq, &dv_dq, DD);
            let da_dq = columns(&|_, e| rates_of(twist_rate(convention, &model, [&along(&e), &qd, &qdd], moving)));
            case.agree(&found.da_dq, &da_dq, DD);
            let q = held(&case.q);
            let da_dqd =
                columns(&|case, e| rates_of(twist_rate(convention, &model, [&q, &with(&case.qd, &e), &qdd], moving)));
            case.agree(&found.da_dqd, &da_dqd, DD);
            let j = columns(&|case, e| twist(convention, &case.model, [&case.q, &e], frame));
            case.agree(&found.jacobian, &j, DD);
            let j_dot = columns(&|case, e| rates_of(twist(convention, &model, [&along(&case.qd), &held(&e)], moving)));
            case.agree(&found.jacobian_rate, &j_dot, DD);
        }
    }
}

/// a = J q̈ + J̇ q̇, where a is the rate of the six numbers J q̇ along the motion.
#[test]
fn the_rate_of_a_twist_is_the_jacobian_times_qdd_plus_its_rate_times_qd() {
    for case in cases() {
        let (model, q, qd) = case.moving();
        for (convention, derivatives) in CONVENTIONS {
            for (moving, frame) in model.frames.iter().zip(&case.model.frames) {
                let found = derivatives(&case.model, [&case.q, &case.qd, &case.qdd], frame);
                let a = sum(&product(&found.jacobian, &case.qdd), &product(&found.jacobian_rate, &case.qd));
                case.agree(&a, &rates_of(twist(convention, &model, [&q, &qd], moving)), DD);
            }
        }
    }
}

/// The last joint moves its own frame always in the same way as seen from there, the first one as seen from the world.
#[test]
fn the_column_of_the_last_joint_stands_still_in_its_own_axes_and_that_of_the_first_in_the_world() {
    for case in cases() {
        let motion = [&case.q[..], &case.qd, &case.qdd];
        for frame in &case.model.frames {
            let path: Vec<usize> = std::iter::successors(frame.body, |&b| case.model.bodies[b].parent).collect();
            let joint = |at: Option<&usize>| &case.model.bodies[*at.expect("a frame on a body")].joint;
            let (last, first) = (joint(path.first()), joint(path.last()));
            for ((_, derivatives), joint) in CONVENTIONS.into_iter().zip([last, first]) {
                if !joint.kind.is_single() {
                    continue;
                }
                let found = derivatives(&case.model, motion, frame).jacobian_rate;
                let column: Vec<Dd> = found.chunks(case.nv()).map(|row| row[joint.iv]).collect();
                assert_eq!(column, [Dd::ZERO; 6], "seed {}", case.seed);
            }
        }
    }
}

/// q as it moves with coordinate k alone, and everything else at rest.
fn moved_along(case: &Case, k: usize) -> (Model<Rate>, Vec<Rate>) {
    let (model, q, _) = Case { qd: unit(case.nv(), k), ..Case::new(case.seed) }.moving();
    (model, q)
}

/// Momentum about the centre of mass, linear before angular.
fn momentum_numbers<T: Real>(model: &Model<T>, q: &[T], qd: &[T]) -> Vec<T> {
    let all = momentum(model, q, qd);
    [all.linear.to_array(), all.angular.to_array()].concat()
}

/// ∂h/∂q by increments of every joint; ḣ is taken along the motion of a robot whose configuration is moved.
#[test]
fn derivatives_of_momentum_are_rates_of_its_numbers() {
    for case in cases() {
        let held = |x: &[Dd]| x.iter().map(|&value| Rate { value, rate: Dd::ZERO }).collect::<Vec<_>>();
        let found = centroidal_dynamics_derivatives(&case.model, [&case.q, &case.qd, &case.qdd]);
        let (qd, qdd) = (held(&case.qd), held(&case.qdd));
        let column = |k: usize| {
            let (model, q) = moved_along(&case, k);
            rates_of(momentum_numbers(&model, &q, &qd))
        };
        case.agree(&found.dh_dq, &by_rows(&(0..case.nv()).map(column).collect::<Vec<_>>()), DD);
        // A q̈ + Ȧ q̇ at the moved configuration
        let column = |k: usize| {
            let (model, q) = moved_along(&case, k);
            let all = centroidal_derivatives(&model, &q, &qd);
            let row = |(a, b): (&[Rate], &[Rate])| {
                let sum = |row: &[Rate], x: &[Rate]| row.iter().zip(x).fold(Rate::zero(), |sum, (a, x)| sum + *a * *x);
                sum(a, &qdd) + sum(b, &qd)
            };
            rates_of(all.map.chunks(case.nv()).zip(all.rate.chunks(case.nv())).map(row).collect())
        };
        case.agree(&found.dhdot_dq, &by_rows(&(0..case.nv()).map(column).collect::<Vec<_>>()), DD);
    }
}

/// Jᵀ f of a force and a moment that are held in the world.
#[test]
fn the_derivative_of_a_held_force_is_the_rate_of_its_torques() {
    for case in cases() {
        let mut random = Random(case.seed ^ 0xf0);
        let (force, moment) = (random.vector(), random.vector());
        for frame in &case.model.frames {
            let [_, slopes] = jacobian_hessian_product(&case.model, &case.q, &[ForceOnFrame { frame, force, moment }]);
            let column = |k: usize| {
                let (model, q) = moved_along(&case, k);
                let moving = model.frame(&frame.name).expect("the same frames");
                let fixed = |x: Vec3<Dd>| x.map(|value| Rate { value, rate: Dd::ZERO });
                let loaded = ForceOnFrame { frame: moving, force: fixed(force), moment: fixed(moment) };
                let [torques, _] = jacobian_hessian_product(&model, &q, &[loaded]);
                rates_of(torques)
            };
            case.agree(&slopes, &by_rows(&(0..case.nv()).map(column).collect::<Vec<_>>()), DD);
        }
    }
}

#[test]
fn a_frame_on_the_world_stands_still() {
    let case = Case::new(3);
    let frame = Frame { name: "world".into(), body: None, placement: Random(3).pose() };
    assert_eq!(forward_kinematics(&case.model, &case.q, &[&frame])[0], frame.placement);
    assert_eq!(jacobian(&case.model, &case.q, &frame), vec![Dd::ZERO; 6 * case.nv()]);
    assert_eq!(frame_velocity(&case.model, &case.q, &case.qd, &frame).linear, Vec3::zero());
    for (_, derivatives) in CONVENTIONS {
        let found = derivatives(&case.model, [&case.q, &case.qd, &case.qdd], &frame);
        assert_eq!(found.da_dqd, vec![Dd::ZERO; 6 * case.nv()]);
    }
}

// ------------------------------------------------------------------------------------------------- what may not matter

#[test]
fn turning_the_whole_scene_changes_no_torque() {
    for case in cases() {
        let mut random = Random(case.seed);
        let [x, y, z, w] = random.quaternion();
        let (u, turn) = (Vec3::new(x, y, z), rotation_of([x, y, z, w]));
        let mut turned = Case::new(case.seed);
        turned.model.gravity = turn * case.model.gravity;
        for body in turned.model.bodies.iter_mut().filter(|b| b.parent.is_none()) {
            if body.joint.kind == JointKind::Floating {
                let q = &mut turned.q[body.joint.iq..body.joint.iq + 7];
                let position = turn * Vec3::new(q[0], q[1], q[2]);
                let (v, real) = (Vec3::new(q[3], q[4], q[5]), q[6]);
                let imaginary = v.scale(w) + u.scale(real) + u.cross(v);
                q[..3].copy_from_slice(&position.to_array());
                q[3..6].copy_from_slice(&imaginary.to_array());
                q[6] = w * real - u.dot(v);
            } else {
                body.placement = Transform { rotation: turn, translation: Vec3::zero() }.compose(&body.placement);
            }
        }
        case.agree(&turned.inverse_dynamics(), &case.inverse_dynamics(), DD);
    }
}

#[test]
fn far_from_the_origin_no_digit_is_lost() {
    for case in cases().filter(|case| case.model.bodies[0].joint.kind == JointKind::Floating) {
        let numbers = |x: &[Dd]| x.iter().map(|x| x.to_f64()).collect::<Vec<f64>>();
        let (model, q, qd) = (case.model.cast::<f64>(), numbers(&case.q), numbers(&case.qd));
        let (mut far, iq) = (q.clone(), model.bodies[0].joint.iq);
        far[iq..iq + 3].fill(1e15);
        let frame = &model.frames[0];
        assert_eq!(jacobian(&model, &far, frame), jacobian(&model, &q, frame), "seed {}", case.seed);
        assert_eq!(jacobian_bias(&model, &far, &qd, frame), jacobian_bias(&model, &q, &qd, frame));
        assert_eq!(momentum(&model, &far, &qd).angular, momentum(&model, &q, &qd).angular);
        assert_eq!(inverse_dynamics(&model, &far, &qd, &qd), inverse_dynamics(&model, &q, &qd, &qd));
    }
}

#[test]
fn the_form_of_a_rotation_changes_only_rounding() {
    for case in cases() {
        for dense in [false, true] {
            let mut other = Case::new(case.seed);
            other.model.bodies.iter_mut().for_each(|body| body.dense = dense);
            case.agree(&other.inverse_dynamics(), &case.inverse_dynamics(), DD);
            case.agree(&mass_matrix(&other.model, &case.q), &mass_matrix(&case.model, &case.q), DD);
            let solve = |model| solve_articulated(model, &case.q, &case.qd);
            case.agree(&solve(&other.model), &solve(&case.model), DD_SOLVED);
        }
    }
}

#[test]
fn composing_pays_for_oblique_axes_only() {
    let (o, i) = (Dd::ZERO, Dd::ONE);
    let (s, c) = Dd::from(0.4).sin_cos();
    let about_x = Mat3 { rows: [[i, o, o], [o, c, -s], [o, s, c]] };
    let quarter = Mat3 { rows: [[i, o, o], [o, o, -i], [o, i, o]] };
    let oblique = rotation_of(Random(5).quaternion());
    assert_eq!([quarter, about_x, oblique].map(|e| composing_pays(Some(0), &e)), [false, false, true]);
    assert!(!composing_pays(None, &oblique), "on the world a placement meets constants");
}

// ------------------------------------------------------------------------------------------------------- other scalars

/// What the claims above do not see: rounding. The worst of these cases is 7e-16 (f64) and 3.5e-7 (f32) of the largest
/// entry; the bounds leave a factor of five for other cases.
#[test]
fn f64_and_f32_agree_with_double_double() {
    fn worst<T: Real + Into<f64>>(case: &Case) -> f64 {
        let cast = |x: &[Dd]| x.iter().map(|&x| T::constant(x)).collect::<Vec<T>>();
        let (model, q, qd, qdd) = (case.model.cast::<T>(), cast(&case.q), cast(&case.qd), cast(&case.qdd));
        // the exact answer for the rounded input
        let back = |x: &[T]| x.iter().map(|&x| Dd::from(x.into())).collect::<Vec<Dd>>();
        let exact = model.map(|x| Dd::from(x.into()));
        let (q_exact, qd_exact, qdd_exact) = (back(&q), back(&qd), back(&qdd));
        let distance = |a: &[T], e: &[Dd]| {
            let scale = e.iter().fold(1.0f64, |m, x| m.max(x.abs().to_f64()));
            back(a).iter().zip(e).fold(0.0f64, |m, (&a, &e)| m.max((a - e).abs().to_f64() / scale))
        };
        let tau = distance(
            &inverse_dynamics(&model, &q, &qd, &qdd),
            &inverse_dynamics(&exact, &q_exact, &qd_exact, &qdd_exact),
        );
        tau.max(distance(&mass_matrix(&model, &q), &mass_matrix(&exact, &q_exact)))
    }
    for case in cases() {
        let (double, single) = (worst::<f64>(&case), worst::<f32>(&case));
        assert!(double < 3.5e-15, "seed {}: {double:e} in f64", case.seed);
        assert!(single < 1.75e-6, "seed {}: {single:e} in f32", case.seed);
    }
}

// --------------------------------------------------------------------------------------------------------- closed form

#[test]
fn a_pendulum_swings_as_in_the_textbook() {
    // about y of the world, hanging along −z: tau = (J + m l²) q̈ + m g l sin q
    let (mass, length, inertia, g) = (1.25, 0.5, 0.0625, 9.75);
    let d = Dd::from;
    let (o, i) = (d(0.0), d(1.0));
    let placement = // columns: x_j = x, y_j = −z, z_j = y
        Transform { rotation: Mat3 { rows: [[i, o, o], [o, o, i], [o, -i, o]] }, translation: Vec3::zero() };
    let tensor = Sym3 { xx: d(0.125), xy: o, xz: o, yy: d(0.0625), yz: o, zz: d(inertia) };
    let joint = Joint { name: "j".into(), kind: JointKind::Revolute, iq: 0, iv: 0, limits: Limits::default() };
    let body = Body {
        name: "bob".into(),
        parent: None,
        joint,
        placement,
        inertia: SpatialInertia::new(d(mass), Vec3::new(o, d(length), o), tensor),
        link_frame: Transform::identity(),
        dense: false,
        effects: JointEffects::none(),
        load: None,
    };
    let gravity = Vec3::new(0.0, 0.0, -g).map(d);
    let model = Model {
        name: "pendulum".into(),
        bodies: vec![body],
        gravity,
        couplings: vec![],
        closure: Default::default(),
        frames: vec![],
        drives: vec![],
        base_parameters: Default::default(),
    }
    .cast::<f64>();
    let (q, qd, qdd) = (0.7, -1.5, 2.0);
    let expected = (inertia + mass * length * length) * qdd + mass * g * length * f64::sin(q);
    let tau = inverse_dynamics(&model, &[q], &[qd], &[qdd])[0];
    assert!((tau - expected).abs() < 1e-15 * 16.0, "{tau} is not {expected}");
    let energy = kinetic_energy(&model, &[q], &[qd]) + potential_energy(&model, &[q]);
    let expected = 0.5 * (inertia + mass * length * length) * qd * qd - mass * g * length * f64::cos(q);
    assert!((energy - expected).abs() < 1e-15 * 16.0, "{energy} is not {expected}");
}
