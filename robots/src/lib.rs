//! Robots whose dynamics are generated at build time: straight-line, allocation-free, `core` only.
//!
//! One module per robot. All have the same functions, over arrays of the robot's own size, in SI units (m, kg, s, rad,
//! N, N·m, J) with q, qd, qdd and tau in the order of the module's `JOINT_NAMES`:
//!
//! | function | computes |
//! |---|---|
//! | `inverse_dynamics(q, qd, qdd, tau)` | the generalized forces that a motion takes, tau = H qdd + h |
//! | `forward_dynamics(q, qd, tau, qdd)` | the motion that generalized forces cause |
//! | `gravity_force`, `velocity_force`, `bias_force` | g, C qd, and their sum h |
//! | `mass_matrix(q, h)` | H |
//! | `joint_wrenches(q, qd, qdd, w)` | what the joints carry |
//! | `forward_kinematics`, `jacobian`, `jacobian_bias`, `frame_velocity`, `frame_acceleration` | motion of the frames in `FRAME_NAMES` |
//! | `energy`, `centre_of_mass`, `momentum` | of the whole robot |
//!
//! What a function costs is a constant beside it (`INVERSE_DYNAMICS_COST`). The descriptions, each with the source of its
//! numbers, are in `descriptions/`.
//!
//! What a scene makes of one robot is shown in `scenes/README.md`.
#![no_std]
#![forbid(unsafe_code)]

/// A planar 2R arm in a vertical plane: every textbook's first example. 2 revolute joints, nq = nv = 2.
///
/// Description: `descriptions/planar_2r.toml`, joint-frame notation; made-up round numbers.
///
/// ```
/// use straightline_robots::planar_2r;
/// // stretched out horizontally: the weights times their levers
/// let mut g = [0.0; 2];
/// planar_2r::gravity_force(&[0.0, 0.0], &mut g);
/// assert!((g[1] - 0.75 * 9.81 * 0.2).abs() < 1e-14);
/// assert!((g[0] - 9.81 * (1.5 * 0.25 + 0.75 * 0.7)).abs() < 1e-14);
/// ```
#[allow(clippy::all, clippy::pedantic)]
pub mod planar_2r {
    include!(concat!(env!("OUT_DIR"), "/planar_2r.rs"));
}

/// The planar arm with geared DC motors on both joints: voltages in, motion out. The state of the drives is θ, θ̇ and the current of each.
///
/// Scene: `scenes/planar_2r_drives.toml`, with figures of a data sheet.
///
/// ```
/// use straightline_robots::planar_2r_geared as arm;
/// // motors shorted, at rest: the arm begins to fall, held back by its rotors behind the gears
/// let (mut qdd, mut xd) = ([0.0; arm::NV], [0.0; arm::NX]);
/// arm::driven_forward_dynamics(&[0.0; 2], &[0.0; 2], &[0.0; arm::NX], &[0.0; arm::NU], &mut qdd, &mut xd);
/// let (mut free, tau) = ([0.0; 2], [0.0; 2]);
/// arm::forward_dynamics(&[0.0; 2], &[0.0; 2], &tau, &mut free);
/// assert!(qdd[0] < 0.0 && qdd[0] > free[0]);
/// ```
#[allow(clippy::all, clippy::pedantic)]
pub mod planar_2r_geared {
    include!(concat!(env!("OUT_DIR"), "/planar_2r_geared.rs"));
}

/// The planar arm behind elastic transmissions: motors and joints turn independently of each other.
///
/// Scene: `scenes/planar_2r_elastic.toml`, with figures of a data sheet.
///
/// ```
/// use straightline_robots::planar_2r_elastic as arm;
/// // voltages that hold the stretched arm still, and the torques of its springs: its weight
/// let (still, mut u, mut m) = ([0.0; arm::NV], [0.0; arm::NU], [0.0; arm::NU]);
/// let mut x = [0.0; arm::NX];
/// x[3] = 100.0 * (0.75 * 9.81 * 0.2) / 7e3; // the second spring is damped: its stretch is free
/// arm::driven_inverse_dynamics(&[0.0; 2], &still, &still, &still, &still, &still, &x, &mut u, &mut m);
/// let weight = 9.81 * (1.5 * 0.25 + 0.75 * 0.7);
/// assert!((m[0] - weight / 100.0).abs() < 1e-12, "{m:?}");
/// ```
#[allow(clippy::all, clippy::pedantic)]
pub mod planar_2r_elastic {
    include!(concat!(env!("OUT_DIR"), "/planar_2r_elastic.rs"));
}

/// A cylindrical arm: a column that turns, a carriage that climbs it, an arm that slides out, a hand that rolls.
/// 2 revolute and 2 linear joints, nq = nv = 4.
///
/// Description: `descriptions/chapter_cylindrical.toml`, mass-centre notation of the chapter; made-up numbers.
///
/// ```
/// use straightline_robots::cylindrical;
/// // the second drive carries everything above it
/// let mut tau = [0.0; 4];
/// cylindrical::inverse_dynamics(&[0.3, 0.2, 0.1, 0.0], &[0.0; 4], &[0.0; 4], &mut tau);
/// assert!((tau[1] - (7.5 + 4.0 + 0.8) * 9.81).abs() < 1e-12);
/// ```
#[allow(clippy::all, clippy::pedantic)]
pub mod cylindrical {
    include!(concat!(env!("OUT_DIR"), "/cylindrical.rs"));
}

/// An arm like the Stanford arm: two revolute joints, a linear one, a wrist. nq = nv = 6.
///
/// Description: `descriptions/chapter_stanford.toml`, mass-centre notation of the chapter; made-up numbers.
///
/// ```
/// use straightline_robots::stanford;
/// let (q, qd) = ([0.1, -0.8, 0.3, 0.2, 0.5, -0.4], [0.2; 6]);
/// // the bias force is what a motion without accelerations takes
/// let (mut h, mut tau) = ([0.0; 6], [0.0; 6]);
/// stanford::bias_force(&q, &qd, &mut h);
/// stanford::inverse_dynamics(&q, &qd, &[0.0; 6], &mut tau);
/// assert!(h.iter().zip(tau).all(|(h, tau)| (h - tau).abs() < 1e-12));
/// ```
#[allow(clippy::all, clippy::pedantic)]
pub mod stanford {
    include!(concat!(env!("OUT_DIR"), "/stanford.rs"));
}

/// The PUMA 560. 6 revolute joints, nq = nv = 6.
///
/// Description: `descriptions/puma560.urdf`; parameters after Armstrong, Khatib and Burdick (1986) as commonly quoted,
/// with the tensors of links 1 and 3 as published although no rigid body has such moments.
///
/// ```
/// use straightline_robots::puma560;
/// use core::f64::consts::{FRAC_PI_4, PI};
/// // the commonly quoted gravity load in the nominal pose
/// let mut g = [0.0; 6];
/// puma560::gravity_force(&[0.0, FRAC_PI_4, PI, 0.0, FRAC_PI_4, 0.0], &mut g);
/// assert!(g.iter().zip([0.0, 31.640, 6.035, 0.0, 0.028, 0.0]).all(|(g, quoted)| (g - quoted).abs() < 5e-4));
/// ```
#[allow(clippy::all, clippy::pedantic)]
pub mod puma560 {
    include!(concat!(env!("OUT_DIR"), "/puma560.rs"));
}

/// The Universal Robots UR5. 6 revolute joints, nq = nv = 6.
///
/// Description: `descriptions/ur5.urdf`, the numbers of the public description in the example-robot-data package. Its angles
/// of 1.57079632679 are taken as quarter turns.
///
/// ```
/// use straightline_robots::ur5;
/// let (q, qd) = ([0.3, -1.2, 1.5, -0.4, 1.1, 0.7], [0.1, -0.2, 0.3, -0.4, 0.5, -0.6]);
/// // forward after inverse dynamics is the motion again
/// let qdd = [1.0, -2.0, 3.0, -4.0, 5.0, -6.0];
/// let (mut tau, mut again) = ([0.0; 6], [0.0; 6]);
/// ur5::inverse_dynamics(&q, &qd, &qdd, &mut tau);
/// ur5::forward_dynamics(&q, &qd, &tau, &mut again);
/// assert!(qdd.iter().zip(again).all(|(a, b)| (a - b).abs() < 1e-10));
/// ```
#[allow(clippy::all, clippy::pedantic)]
pub mod ur5 {
    include!(concat!(env!("OUT_DIR"), "/ur5.rs"));
}

/// The UR5 in contact: what the four tasks of the example `contact_tasks` take (`scenes/ur5_contact_tasks.toml`).
#[allow(clippy::all, clippy::pedantic)]
pub mod ur5_contact {
    include!(concat!(env!("OUT_DIR"), "/ur5_contact.rs"));
}

/// The Franka Emika Panda without fingers. 7 revolute joints, nq = nv = 7. In f64; in f32: [`panda::single`].
///
/// Description: `descriptions/panda.urdf`, the numbers of the public description in the example-robot-data package.
///
/// ```
/// use straightline_robots::panda;
/// let q = [0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785];
/// let (mut g, mut single) = ([0.0; 7], [0.0; 7]);
/// panda::gravity_force(&q, &mut g);
/// panda::single::gravity_force(&q.map(|x| x as f32), &mut single);
/// // the first axis stands upright; both precisions agree
/// assert_eq!(g[0], 0.0);
/// assert!(g.iter().zip(single).all(|(g, s)| (g - f64::from(s)).abs() < 1e-4));
/// ```
#[allow(clippy::all, clippy::pedantic)]
pub mod panda {
    include!(concat!(env!("OUT_DIR"), "/panda.rs"));

    /// The same robot in f32.
    pub mod single {
        include!(concat!(env!("OUT_DIR"), "/panda_single.rs"));
    }
}

/// The quadruped Solo12: a floating base and 12 revolute joints, nq = 19, nv = 18. In f64; in f32: [`solo12::single`].
///
/// q begins with position and orientation of the base (x, y, z, qx, qy, qz, qw; a unit quaternion), qd with its linear
/// and angular velocity in its own axes, tau with the force and the moment on it, in its own axes.
///
/// Description: `descriptions/solo12.urdf`, the numbers of the public description in the example-robot-data package.
///
/// ```
/// use straightline_robots::solo12;
/// let mut q = [0.0; solo12::NQ];
/// q[6] = 1.0;
/// let mut g = [0.0; solo12::NV];
/// solo12::gravity_force(&q, &mut g);
/// // standing in the air takes the weight of 2.5 kg
/// assert!((g[2] - 2.5 * 9.81).abs() < 0.5);
/// ```
#[allow(clippy::all, clippy::pedantic)]
pub mod solo12 {
    include!(concat!(env!("OUT_DIR"), "/solo12.rs"));

    /// The same robot in f32.
    pub mod single {
        include!(concat!(env!("OUT_DIR"), "/solo12_single.rs"));
    }
}

/// The code of the page on scenes, compiled and run.
#[cfg(doctest)]
#[doc = include_str!("../scenes/README.md")]
struct Scenes;
