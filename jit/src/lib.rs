//! Robot dynamics by machine code that is made at run time.
//!
//! A [`Robot`] is loaded from the text of its file, as the compiler loads it. Its functions are then executed without rustc: the checked program of
//! the compiler becomes a [tape](tape::ProgramTape), and that the instructions of this machine ([`machine`]: x86-64 by SSE2, AVX or AVX-512, aarch64 by NEON), or, where there
//! are none for it or pages cannot be made executable, what an [interpreter] runs. All of them compute
//! the bits of the program's graph, evaluated node by node, but for the payloads of NaN (`tests/suite/bits.rs`, and for aarch64 on other machines, emulated, `tests/suite/emulated.rs`).
//!
//! ```
//! use straightline_codegen::diagnostic::Source;
//! use straightline_codegen::options::Options;
//! use straightline_codegen::Function;
//!
//! let file = r#"<robot name="pendulum">
//!     <link name="base"/>
//!     <joint name="hinge" type="continuous">
//!         <parent link="base"/><child link="rod"/><axis xyz="0 1 0"/>
//!     </joint>
//!     <link name="rod"><inertial>
//!         <origin xyz="0 0 -0.5"/><mass value="2"/>
//!         <inertia ixx="0.2" iyy="0.2" izz="0.001" ixy="0" ixz="0" iyz="0"/>
//!     </inertial></link>
//! </robot>"#;
//! let options = Options { functions: vec![Function::GravityForce], ..Options::default() };
//! let robot = straightline_jit::Robot::<f64>::load(&Source::new("pendulum.urdf", file), &options).unwrap();
//! let gravity = robot.function("gravity_force").unwrap();
//! let mut torque = [0.0];
//! gravity.call(&[&[0.5]], &mut [&mut torque]).unwrap();
//! // m g l sin q
//! assert!((torque[0] - 2.0 * 9.81 * 0.5 * f64::sin(0.5)).abs() < 1e-3);
//! ```

pub mod allocation;
mod batch;
mod between;
mod engine;
mod function;
pub mod interpreter;
mod lines;
pub mod machine;
#[allow(unsafe_code)]
mod native;
mod number;
mod robot;
mod store;
pub mod tape;

pub use batch::BatchLayout;
pub use engine::ExecutionMode;
pub use function::{CallError, LoadedFunction, Runner};
pub use number::Number;
pub use robot::{LoadError, LoadedRobot as Robot, UnknownFunction};
pub use store::ProgramFolder;

// The code of the guide: compiled and run by `cargo test -p straightline-jit --doc`.
#[cfg(doctest)]
#[doc = include_str!("../../guide/src/run-time.md")]
struct GuideRunTime;

/// What modules test of themselves, for `tests/suite/inside.rs`. As unit tests they would be a second build of the package.
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod internals {
    pub use crate::engine::tests as engine;
    pub use crate::lines::tests as lines;
}
