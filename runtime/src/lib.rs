//! Robot dynamics as straight-line, allocation-free, `no_std` Rust, generated at build time from a robot file.
//!
//! One attribute names the robot file (URDF or TOML); the type gets constants and functions:
//! ```
//! use straightline::Dynamics;
//!
//! #[derive(Dynamics)]
//! #[robot("examples/arm.toml", functions(inverse_dynamics, gravity_force, forward_dynamics))]
//! struct Arm;
//!
//! // hold the arm still, stretched out to the side
//! let q = [0.0, std::f64::consts::FRAC_PI_2, 0.0];
//! let mut tau = [0.0; Arm::NV];
//! Arm::gravity_force(&q, &mut tau);
//!
//! // and it stays where it is
//! let mut qdd = [0.0; Arm::NV];
//! Arm::forward_dynamics(&q, &[0.0; 3], &tau, &mut qdd);
//! assert!(qdd.iter().all(|a| a.abs() < 1e-12));
//!
//! assert_eq!(Arm::JOINT_NAMES, ["yaw", "shoulder", "elbow"]);
//! assert_eq!(Arm::INVERSE_DYNAMICS_COST.div, 0);
//! ```
//! Arrays are by reference in and out, their sizes are the robot's; there is no allocation, no loop, no branch and no
//! panic in what is generated, and it depends on `core` alone. SI units; conventions stand with every function.
//!
//! # Options
//! After the file's name, in any order:
//!
//! | option | without it |
//! |---|---|
//! | `functions(inverse_dynamics, mass_matrix)`: The functions that are generated | all |
//! | `frames("tool")`: The frames (links) that poses, velocities and Jacobians are asked for | the robot's tips |
//! | `scalar = "f32"`: The scalar type; of several each but the first has a module `single` or `double` with the same items: `"f64"`, `"f32"` | `"f64"` |
//! | `lanes = "runtime"`: Beside every function the same over lanes of states and over batches, and where the drivers of batches come from: `"standalone"`, `"runtime"` | one state at a time |
//! | `fma = "caller"`: Compute a·b + c in one rounding, and by what: `"std"`, `"caller"` | the same bits everywhere |
//! | `generic`: Functions take any scalar that is a `straightline::Real`; the output depends on the package `straightline` | the scalar type alone |
//! | `rules = "exact"`: Which rewrite rules may be used: `"all"`, `"exact"` | `"all"` |
//! | `optimise = "quick"`: How much is tried for programs of few operations; another tier has other bits: `"full"`, `"quick"` | `"full"` |
//! | `forward_dynamics = "articulated-body"`: How forward dynamics is computed: `"cheaper"`, `"articulated-body"`, `"factorisation"` | `"cheaper"` |
//! | `limbs = "auto"`: How identical limbs are computed: `"apart"`, `"lanes"`, `"auto"`, `"rolled"` | `"apart"` |
//! | `columns = "apart"`: How columns that a function solves for are computed: `"auto"`, `"apart"`, `"lanes"` | `"auto"` |
//! | `entries = "nonzeros"`: Which entries of matrices functions write, and whether constants beside them say which can be non-zero: `"all"`, `"patterns"`, `"nonzeros"` | `"all"` |
//! | `target = "cortex-m4f"`: The machine that code is made for: short sines in f32 where it computes one angle at a time, and an order for its registers: `"cortex-m0plus"`, `"cortex-m3"`, `"cortex-m4f"`, `"cortex-m7"`, `"cortex-m33"`, `"rv32imac"`, `"rv32imafc"`, `"aarch64"`, `"x86-64-v3"` | any machine |
//! | `memory = "tcm"`: The memory that code runs from on the machine of `target`: `"flash"`, `"tcm"` | `"flash"` |
//! | `figures`: Beside every function a constant of its instructions, flash, stack and cycles on the machine of `target`, read off the machine code that rustc makes | off |
//! | `self_test`: Write `self_test()` beside the functions, which compares what a machine computes with what the compiler expects, to the bit | off |
//! | `max_part_operations = 100`: Longer functions are cut into parts of at most so many operations | 12000 |
//! | `fixed = "muls"`: A module `fixed` with the same functions over integers of 32 bits, for machines without floating point, and how these multiply: `"mulh"`, `"muls"` | floating point alone |
//! | `fixed_error = 1e-4`: The greatest certified error of results in fixed point, as a part of the greatest magnitude of their array | 1e-6 |
//! | `certify_seconds = 0.5`: Certify bounds of errors, tighter ones, for so long per function and scalar type \[s]; bounds then depend on the machine | as long as it takes |
//! | `certify_boxes = 40`: Certify bounds of errors, tighter ones: the ranges of each result are cut into so many boxes | 1, or as many as `certify_seconds` allows |
//! | `certify_state`: Certify bounds of errors, and beside every function write `…_error_bound`, which bounds the errors at the state at hand | off |
//! | `certify`: Certify a bound of the errors of every function, for the ranges of its inputs | off |
//! | `mixed_precision = 1e-3`: Of f32, compute in f64 what it takes for certified errors up to so much, in the results' units, and nothing else | off |
//! | `floating_base`: The root link moves freely: q begins with its position and quaternion (x y z qx qy qz qw) | as the robot file says |
//! | `joint_order("elbow", "shoulder")`: All joints in the order of their coordinates | depth first, as in the file |
//! | `angle_tolerance = 1e-6`: So near to a multiple of 30 or 45 degrees \[rad] an angle is taken as that; 0: every angle as it is written | 1e-15, rounding only |
//! | `gravity(0, 0, -1.62)`: Acceleration due to gravity in the world \[m/s²] | the robot file's, or 0, 0, -9.81 |
//! | `allow("near-right-angle")`: Say no warnings of this code (`warnings`: none); `straightline explain` lists the codes | every warning is said |
//! | `warn("near-right-angle")`: Say warnings of this code, whatever the scene says | every warning is said |
//! | `deny("near-right-angle")`: Warnings of this code are errors (`warnings`: all) | every warning is said |
//! | `scene = "scenes/still.toml"`: A scene: what is wanted of the robot, and what is held; everything else is skipped | everything is wanted, nothing held |
//! | `module = "arm_dynamics"`: The name of the module that everything stands in (of the derive, beside the type; in a build script of its file) | none; in a build script the robot file's name |
//!
//! Several scalars are `scalar("f64", "f32")`; a flag is switched off by `= false`. A scene can stand in the attribute itself, with the tables and
//! keys of a file: `scene(zero(qd = true), hold(joints = { yaw = 0.5 }))`; what the attribute says of options counts before the scene. `module`
//! is for the derive alone, and needed where a scene has types of its own.
//!
//! The path counts from the package's manifest, or else from the source file. The build runs again when the file changes;
//! complaints about it, and about options, come as compiler errors with the file's line, all in one run, and stay the only ones:
//! constants and functions are there in name, so that whatever uses them compiles.
//!
//! # Frames
//! Every frame is a constant of the type, a [`FrameIndex`], and `pose` takes the [`Pose`] of one out of what `forward_kinematics`
//! gives. These two types are all that the type's items take of this package without being asked to.
//! ```
//! # use straightline::Dynamics;
//! #[derive(Dynamics)]
//! #[robot("examples/arm.toml", frames("upper_arm", "forearm"), functions(forward_kinematics, frame_velocity))]
//! struct Arm;
//!
//! let (q, qd) = ([0.1, 0.2, 0.3], [1.0, 0.0, 0.0]);
//! let (mut poses, mut velocities) = ([[0.0; 12]; 2], [[0.0; 6]; 2]);
//! Arm::forward_kinematics(&q, &mut poses);
//! Arm::frame_velocity(&q, &qd, &mut velocities);
//!
//! let forearm = Arm::pose(&poses, Arm::FOREARM);
//! let [x, y, _z] = forearm.position;
//! let [vx, vy, ..] = velocities[Arm::FOREARM];
//! assert!((vx + y).abs() + (vy - x).abs() < 1e-15); // v = ω × p
//! ```
//!
//! # A module
//! [`dynamics!`] takes the same and makes a module:
//! ```
//! straightline::dynamics! {
//!     /// A three-joint arm in single precision.
//!     pub mod arm = "examples/arm.toml", scalar = "f32", functions(mass_matrix)
//! }
//!
//! let mut h = [[0.0_f32; arm::NV]; arm::NV];
//! arm::mass_matrix(&[0.1, 0.2, 0.3], &mut h);
//! assert_eq!(h[0][1], h[1][0]);
//! ```
//!
//! # Features
//! * `derive` (default): the macros. They run the compiler of dynamics while your crate is built.
//! * `std`: functions over batches use the vector instructions of the machine, found out at run time.
//! * `rayon`: functions over batches on several threads; `std` with it.
//! * `nalgebra`: results as types of nalgebra, `Isometry3::from(pose)` among them; its `std` or `libm` is yours to choose.
//! * `runtime`: the generic numeric algorithms, for robots that are known only at run time; needs an allocator.
//!
//! Without features there is `core` only. Build scripts use `straightline_codegen::Builder`; source to commit, C libraries
//! and reports come from the command `straightline`.
#![no_std]
// `deny`, and allowed in `dispatch` alone: calling a function that is compiled for other instructions is unsafe
#![deny(unsafe_code)]
#[cfg(feature = "std")]
extern crate std;

pub mod batch;
#[cfg(feature = "std")]
mod dispatch;
#[cfg(any(docsrs, test))]
#[rustfmt::skip]
pub mod example;
mod frame;
#[cfg(feature = "nalgebra")]
pub mod nalgebra;
mod pose;

pub use frame::FrameIndex;
pub use pose::Pose;
pub use straightline_core::{control, integrate, phases, Dd, Dual, Real};
#[cfg(feature = "derive")]
pub use straightline_macros::{dynamics, Dynamics};

#[cfg(feature = "runtime")]
pub use straightline_core::{algorithms, model, spatial};

// The code of the guide: compiled and run by `cargo test -p straightline --doc`.
#[cfg(doctest)]
#[doc = include_str!("../../guide/src/first.md")]
struct GuideFirst;
#[cfg(doctest)]
#[doc = include_str!("../../guide/src/control-loop.md")]
struct GuideControlLoop;
#[cfg(doctest)]
#[doc = include_str!("../../guide/src/firmware.md")]
struct GuideFirmware;
#[cfg(doctest)]
#[doc = include_str!("../../guide/src/output.md")]
struct GuideOutput;
#[cfg(doctest)]
#[doc = include_str!("../../guide/src/scenes.md")]
struct GuideScenes;
#[cfg(doctest)]
#[doc = include_str!("../../guide/src/contact.md")]
struct GuideContact;
#[cfg(doctest)]
#[doc = include_str!("../../guide/src/batches.md")]
struct GuideBatches;
#[cfg(doctest)]
#[doc = include_str!("../../guide/src/certificates.md")]
struct GuideCertificates;
#[cfg(doctest)]
#[doc = include_str!("../../guide/src/fixed-point.md")]
struct GuideFixedPoint;
#[cfg(doctest)]
#[doc = include_str!("../../guide/src/drives.md")]
struct GuideDrives;
#[cfg(doctest)]
#[doc = include_str!("../../guide/src/coming-from.md")]
struct GuideComingFrom;
