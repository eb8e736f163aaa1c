//! Functions generic over the scalar: the bits of the program in every scalar, and derivatives by dual numbers.

use straightline::{Dual, Real};
use straightline_codegen::options::Options;
use straightline_codegen::program::TracedProgram;
use straightline_codegen::Function;
use straightline_core::Dd;
use straightline_generated_tests::bounds::{GRAVITY_SYMMETRY, IDENTITY, MOTION_DERIVATIVE, TORQUE_DERIVATIVE};
use straightline_generated_tests::compiled;
use straightline_generated_tests::compiled::generic_panda as panda;
use straightline_generated_tests::compiled::generic_ur5 as ur5;
use straightline_generated_tests::inputs;
use straightline_generated_tests::programs::{self, cast, program};
use straightline_generated_tests::random::Random;
use straightline_generated_tests::reference::Robot;

fn program_of(robot: &str, function: Function) -> (straightline_codegen::equations::Robot, TracedProgram) {
    let robot = Robot::load(robot);
    // constant angles are cut into parts that f32 has, too
    let options = Options { generic: true, ..programs::options(&robot) };
    let loaded = programs::load(&programs::source(&robot), &options.model);
    let program = program(&loaded, &robot.frames, function, &options);
    (loaded, program)
}

/// A function of three vectors, over any scalar.
macro_rules! calls {
    ($name:ident, $robot:ident::$function:ident, $n:literal) => {
        fn $name<T: Real>(x: &[Vec<T>]) -> Vec<T> {
            let array = |k: usize| -> &[T; $n] { x[k].as_slice().try_into().expect("a number per joint") };
            let mut y = [T::zero(); $n];
            $robot::$function(array(0), array(1), array(2), &mut y);
            y.to_vec()
        }
    };
}
calls!(panda_torques, panda::inverse_dynamics, 7);
calls!(ur5_torques, ur5::inverse_dynamics, 6);
calls!(ur5_motion, ur5::forward_dynamics, 6);

/// The complex step (Squire and Trapp 1998): the imaginary part carries a derivative times a step so small that its square is
/// nothing beside one. A scalar as a user writes one: what the trait provides is not overridden.
#[derive(Clone, Copy, Debug, PartialEq)]
struct ComplexStep {
    re: f64,
    im: f64,
}

const STEP: f64 = 1e-30;

impl std::ops::Add for ComplexStep {
    type Output = Self;
    fn add(self, b: Self) -> Self {
        ComplexStep { re: self.re + b.re, im: self.im + b.im }
    }
}

impl std::ops::Sub for ComplexStep {
    type Output = Self;
    fn sub(self, b: Self) -> Self {
        ComplexStep { re: self.re - b.re, im: self.im - b.im }
    }
}

impl std::ops::Mul for ComplexStep {
    type Output = Self;
    fn mul(self, b: Self) -> Self {
        ComplexStep { re: self.re * b.re - self.im * b.im, im: self.re * b.im + self.im * b.re }
    }
}

impl std::ops::Div for ComplexStep {
    type Output = Self;
    fn div(self, b: Self) -> Self {
        let square = b.re * b.re + b.im * b.im;
        let over = self * ComplexStep { re: b.re, im: -b.im };
        ComplexStep { re: over.re / square, im: over.im / square }
    }
}

impl std::ops::Neg for ComplexStep {
    type Output = Self;
    fn neg(self) -> Self {
        ComplexStep { re: -self.re, im: -self.im }
    }
}

impl Real for ComplexStep {
    fn constant(value: Dd) -> Self {
        ComplexStep { re: value.to_f64(), im: 0.0 }
    }
    // sin(a + ib) = sin a cosh b + i cos a sinh b, where cosh b = 1 and sinh b = b
    fn sin_cos(self) -> (Self, Self) {
        let (s, c) = Real::sin_cos(self.re);
        (ComplexStep { re: s, im: c * self.im }, ComplexStep { re: c, im: -s * self.im })
    }
    fn sqrt(self) -> Self {
        let re = Real::sqrt(self.re);
        ComplexStep { re, im: 0.5 * self.im / re }
    }
    fn sign(self) -> Self {
        ComplexStep { re: Real::sign(self.re), im: 0.0 }
    }
}

#[test]
fn in_every_scalar_they_are_their_program() {
    type Call<T> = fn(&[Vec<T>]) -> Vec<T>;
    fn agrees<T: Real + PartialEq>() {
        let subjects: [(&str, Function, Call<T>); 3] = [
            ("panda", Function::InverseDynamics, panda_torques),
            ("ur5", Function::InverseDynamics, ur5_torques),
            ("ur5", Function::ForwardDynamics, ur5_motion),
        ];
        for (robot, function, call) in subjects {
            let (loaded, program) = program_of(robot, function);
            let mut random = Random(23);
            for _ in 0..10 {
                let x = cast::<T>(&inputs::random(&mut random, &loaded.model, function));
                assert_eq!(call(&x), programs::run(&program, &x), "{robot} {function:?}");
            }
        }
    }
    agrees::<f64>();
    agrees::<f32>();
    agrees::<Dd>();
    agrees::<Dual<f64, 2>>();
    agrees::<ComplexStep>();
}

#[test]
fn in_f64_they_are_the_plain_functions_bit_for_bit() {
    type Call = fn(&[Vec<f64>]) -> Vec<f64>;
    let subjects: [(&str, Function, Call); 3] = [
        ("panda", Function::InverseDynamics, panda_torques),
        ("ur5", Function::InverseDynamics, ur5_torques),
        ("ur5", Function::ForwardDynamics, ur5_motion),
    ];
    for (robot, function, call) in subjects {
        let (loaded, _) = program_of(robot, function);
        let mut random = Random(29);
        for _ in 0..20 {
            let x = inputs::random(&mut random, &loaded.model, function);
            let plain = compiled::robot(robot).call(function, &x);
            let bits = |y: &[f64]| y.iter().map(|t| t.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(&call(&x)), bits(&plain), "{robot} {function:?}");
        }
    }
}

/// What the rounding of a sum of far angles loses is not lost in any scalar: against double-double, with angles that f32 has.
#[test]
fn sums_of_far_angles_keep_their_digits_in_every_scalar() {
    assert!(include_str!(concat!(env!("OUT_DIR"), "/generic_ur5.rs")).contains("T::sum_of_angles(&[q["));
    fn error<T: Real>(x: &[Vec<f64>], value: impl Fn(T) -> f64) -> f64 {
        let truth: Vec<f64> = ur5_torques(&cast::<Dd>(x)).into_iter().map(Dd::to_f64).collect();
        let largest = truth.iter().fold(0.0, |m: f64, t| m.max(t.abs()));
        let found = ur5_torques(&cast::<T>(x));
        found.into_iter().zip(truth).fold(0.0, |m: f64, (f, t)| m.max((value(f) - t).abs() / largest))
    }
    let mut random = Random(41);
    for _ in 0..50 {
        let mut states = || -> Vec<f64> { (0..6).map(|_| f64::from(random.between(-2.0, 2.0) as f32)).collect() };
        let mut x = vec![states(), states(), states()];
        x[0][1] += 3000.0;
        x[0][2] -= 0.7;
        x[0].iter_mut().for_each(|q| *q = f64::from(*q as f32));
        // some tens of roundings; the sum of the angles alone loses 1.2e-4 in f32, 2e-13 in f64
        assert!(error::<f32>(&x, f64::from) < 40.0 * f64::from(f32::EPSILON), "{x:?}");
        assert!(error::<f64>(&x, |x| x) < 40.0 * f64::EPSILON, "{x:?}");
        assert!(error::<Dual<f64, 1>>(&x, |x| x.value) < 40.0 * f64::EPSILON, "{x:?}");
        assert!(error::<ComplexStep>(&x, |x| x.re) < 40.0 * f64::EPSILON, "{x:?}");
    }
}

/// Two ways to differentiate that share nothing but the function, through divisions and sums of angles.
#[test]
fn dual_numbers_and_the_complex_step_give_the_same_derivatives() {
    let (loaded, _) = program_of("ur5", Function::ForwardDynamics);
    let mut random = Random(43);
    for _ in 0..10 {
        let x = inputs::random(&mut random, &loaded.model, Function::ForwardDynamics);
        for (k, j) in (0..3).flat_map(|k| (0..6).map(move |j| (k, j))) {
            let mut dual: Vec<Vec<Dual<f64, 1>>> =
                x.iter().map(|group| group.iter().map(|x| Dual::fixed(*x)).collect()).collect();
            dual[k][j] = Dual::variable(x[k][j], 0);
            let mut complex = cast::<ComplexStep>(&x);
            complex[k][j].im = STEP;
            let (dual, complex) = (ur5_motion(&dual), ur5_motion(&complex));
            let scale = dual.iter().fold(1.0, |m: f64, y| m.max(y.value.abs()).max(y.derivatives[0].abs()));
            for (d, c) in dual.iter().zip(&complex) {
                assert!(MOTION_DERIVATIVE.allows((d.derivatives[0] - c.im / STEP).abs() / scale), "{x:?}: {d:?} {c:?}");
            }
        }
    }
}

/// ∂τ/∂q̈ = H: inverse dynamics differentiated, against the mass matrix.
#[test]
fn the_derivative_of_torques_by_accelerations_is_the_mass_matrix() {
    let (loaded, _) = program_of("panda", Function::InverseDynamics);
    let mut random = Random(31);
    for _ in 0..10 {
        let x = inputs::random(&mut random, &loaded.model, Function::InverseDynamics);
        let mut seeded: Vec<Vec<Dual<f64, 7>>> =
            x.iter().map(|group| group.iter().map(|x| Dual::fixed(*x)).collect()).collect();
        for (k, qdd) in seeded[2].iter_mut().enumerate() {
            *qdd = Dual::variable(qdd.value, k);
        }
        let tau = panda_torques(&seeded);
        let mut h = [[0.0; 7]; 7];
        panda::mass_matrix(x[0].as_slice().try_into().expect("seven joints"), &mut h);
        for (tau, row) in tau.iter().zip(h) {
            for (d, h) in tau.derivatives.iter().zip(row) {
                assert!(TORQUE_DERIVATIVE.allows((d - h).abs()), "{d} {h}");
            }
        }
    }
}

/// How ∂τᵀ λ changes along a direction: dual numbers through one function, against the product that is a function of its own.
#[test]
fn duals_through_a_product_with_derivatives_are_second_derivatives() {
    let (loaded, program) = program_of("panda", Function::InverseDynamicsHvp);
    let mut random = Random(53);
    for _ in 0..10 {
        let x = inputs::random(&mut random, &loaded.model, Function::InverseDynamicsHvp);
        let along = |k: usize| -> [Dual<f64, 1>; 7] {
            let pair = |j: usize| Dual { value: x[k][j], derivatives: [x[k + 3][j]] };
            std::array::from_fn(pair)
        };
        let multiplier: [Dual<f64, 1>; 7] = std::array::from_fn(|j| Dual::fixed(x[6][j]));
        let mut products = [[Dual::<f64, 1>::zero(); 7]; 3];
        let [of_q, of_qd, of_qdd] = &mut products;
        panda::inverse_dynamics_vjp(&along(0), &along(1), &along(2), &multiplier, of_q, of_qd, of_qdd);
        let expected = programs::run::<f64>(&program, &x);
        for (found, expected) in products.iter().zip(expected.chunks(7)) {
            let greatest = expected.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
            assert!(greatest > 0.1, "{expected:?}");
            for (found, expected) in found.iter().zip(expected) {
                assert!(IDENTITY.allows((found.derivatives[0] - expected).abs() / greatest), "{found:?} {expected}");
            }
        }
    }
}

/// Gravity has a potential, so the derivative of its forces by q is symmetric; and it is not zero.
#[test]
fn the_derivative_of_gravity_forces_is_symmetric() {
    let mut random = Random(37);
    for _ in 0..10 {
        let mut q = [Dual::<f64, 7>::zero(); 7];
        for (k, q) in q.iter_mut().enumerate() {
            *q = Dual::variable(random.between(-2.0, 2.0), k);
        }
        let mut g = q;
        panda::gravity_force(&q, &mut g);
        let mut largest = 0.0_f64;
        for (i, row) in g.iter().enumerate() {
            for (j, column) in g.iter().enumerate() {
                largest = largest.max(row.derivatives[j].abs());
                assert!(GRAVITY_SYMMETRY.allows((row.derivatives[j] - column.derivatives[i]).abs()), "{i} {j}");
            }
        }
        assert!(largest > 1.0);
    }
}
