//! The exported package as a stranger uses it: written by the command, built by cargo, called from C.

use crate::in_c::{is_there, succeeds, Library};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use straightline_codegen::model::{load, FrameOption, ModelOptions};
use straightline_codegen::{ForwardDynamicsMethod, Function, Source};
use straightline_core::model::Frame;
use straightline_core::Dd;

const ARM: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../runtime/examples/arm.toml");

/// A state that nothing is special about.
const STATE: [(&str, [f64; 10]); 4] = [
    ("q", [0.3, -0.2, 0.5, 0.1, -0.5, 0.7, 0.5, 0.4, -1.1, 0.9]),
    ("qd", [0.2, -0.4, 0.3, 1.1, -0.7, 0.6, 0.8, -1.3, 1.7, 0.0]),
    ("qdd", [1.2, -2.4, 0.7, 3.1, -1.7, 2.6, -1.8, 2.3, -0.7, 0.0]),
    ("tau", [5.2, -1.4, 3.7, 1.6, -2.7, 0.6, 7.8, -3.3, 1.7, 0.0]),
];

fn scratch(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    fs::create_dir_all(&path).unwrap();
    path
}

#[test]
fn c_calls_every_function_and_gets_what_the_generic_runtime_computes() {
    let scratch = scratch("export");
    let package = scratch.join("arm");
    succeeds(
        Command::new(env!("CARGO_BIN_EXE_straightline"))
            .args(["export", ARM, "--c-abi", "--prefix", "Arm3", "--floating-base"])
            .args(["--frame", "forearm", "--frame", "column", "--lanes", "standalone", "-o"])
            .arg(&package),
    );
    // truth: the generic algorithms in double-double
    let options = ModelOptions { floating_base: true, ..ModelOptions::default() };
    let (model, _) = load(&Source::new(ARM, fs::read_to_string(ARM).unwrap()), &options);
    let model = model.unwrap();
    let frames: Vec<&Frame<Dd>> = ["forearm", "column"].iter().map(|name| model.frame(name).unwrap()).collect();
    let state = |name: &str| STATE.iter().find(|(n, _)| *n == name).unwrap().1;
    let mut calls = String::new();
    let mut truth = Vec::new();
    for function in Function::all() {
        let inputs = function.inputs(&model, frames.len());
        let numbers: Vec<Vec<Dd>> =
            inputs.iter().map(|p| state(&p.name)[..p.len()].iter().map(|x| Dd::from(*x)).collect()).collect();
        let method = ForwardDynamicsMethod::Factorisation;
        let outputs = function.evaluate(&model, &frames, method, &numbers);
        let (name, n) = (function.name(), outputs.len());
        let arguments: Vec<_> = inputs.iter().map(|p| p.name.as_str()).chain(["out"]).collect();
        calls.push_str(&format!(
            "    {{ double out[{n}]; Arm3_{name}({0}); show(\"{name}\", out, {n});\n      \
             double batch[{n}]; Arm3_{name}_batch_soa(1, {1}); if (memcmp(out, batch, sizeof out)) return 4;\n      \
             Arm3_{name}_batch_aos(1, {1}); if (memcmp(out, batch, sizeof out)) return 5;\n      \
             Arm3_{name}_batch_aos(0, {2}); }}\n",
            arguments.join(", "),
            arguments.join(", ").replace("out", "batch"),
            vec!["NULL"; arguments.len()].join(", ")
        ));
        truth.extend(outputs.into_iter().enumerate().map(|(k, x)| (format!("{name} {k}"), x)));
    }
    let arrays: String = STATE
        .iter()
        .map(|(name, x)| {
            let numbers: Vec<String> = x.iter().map(|x| format!("{x:?}")).collect();
            format!("    static const double {name}[] = {{{}}};\n", numbers.join(", "))
        })
        .collect();
    let program = format!(
        r#"#include "arm3_dynamics.h"
#include <stdio.h>
#include <string.h>
static void show(const char *name, const double *x, int n) {{
    for (int k = 0; k < n; k++) printf("%s %d %.17g\n", name, k, x[k]);
}}
int main(void) {{
{arrays}    if (Arm3_nq() != ARM3_NQ || Arm3_nv() != ARM3_NV) return 1;
    if (Arm3_joint_count() != ARM3_JOINT_COUNT || Arm3_frame_count() != ARM3_FRAME_COUNT) return 2;
    if (Arm3_joint_name(-1) || Arm3_frame_name(ARM3_FRAME_COUNT)) return 3;
    printf("%s %s %s\n", Arm3_joint_name(3), Arm3_frame_name(0), Arm3_frame_name(1));
{calls}    return 0;
}}
"#
    );
    let printed = crate::in_c::printed(&package, "arm3_dynamics", Library::SharedRelease, &program);
    if is_there("c++") {
        let strict = ["-Wall", "-Wextra", "-Werror", "-pedantic", "-fsyntax-only", "-x", "c++"];
        succeeds(Command::new("c++").args(strict).arg(package.join("include/arm3_dynamics.h")));
    }
    let Some(printed) = printed else { return };
    let mut lines = printed.lines();
    assert_eq!(lines.next(), Some("elbow forearm column"));
    assert_eq!(lines.clone().count(), truth.len());
    for (line, (name, expected)) in lines.zip(truth) {
        let (found, value) = line.rsplit_once(' ').unwrap();
        assert_eq!(found, name);
        let error = (Dd::from(value.parse::<f64>().unwrap()) - expected).to_f64().abs();
        // values up to 100, condition number of H near 100: 1e-16 times both, and room for a few roundings
        assert!(error < 1e-11, "{name}: {value}, off by {error:e}");
    }
}

#[test]
fn names_from_the_robot_file_cannot_become_code() {
    let scratch = scratch("names");
    let (robot, package) = (scratch.join("arm.toml"), scratch.join("package"));
    let text = fs::read_to_string(ARM).unwrap();
    let text = text.replace("\"arm\"", r#""x*/\n#error ""#).replace("\"yaw\"", r#""y\"a\n}\u0000 #error\u2028\"w""#);
    let text = text.replace("\"forearm\"", r#""fore\narm }""#);
    fs::write(&robot, text).unwrap();
    succeeds(
        Command::new(env!("CARGO_BIN_EXE_straightline")).args(["export", "--c-abi", "-o"]).args([&package, &robot]),
    );
    succeeds(
        Command::new(env!("CARGO"))
            .args(["check", "--offline", "--manifest-path"])
            .arg(package.join("Cargo.toml"))
            .env("CARGO_TARGET_DIR", package.join("target")),
    );
    if is_there("cc") {
        let header = fs::read_dir(package.join("include")).unwrap().next().unwrap().unwrap().path();
        succeeds(Command::new("cc").args(["-fsyntax-only", "-x", "c"]).arg(header));
    }
}

const DESK: &str = "[outputs]\nfunctions = [\"mass_matrix\", \"bias_force\"]\ncontact = [\"constrained_coordinates\", \"forward_dynamics\"]\n\
                    [[contact]]\nname = \"desk\"\nframe = \"forearm\"\nobject = \"input\"\nconstrained = [\"pz\"]\n";

/// Truth is what motion and reactions have to fulfil: H q̈ + h = τ + Jᵀ F and J q̈ + A = 0.
#[test]
fn c_calls_the_functions_of_a_contact_mode() {
    let scratch = scratch("contact");
    let (scene, package) = (scratch.join("desk.toml"), scratch.join("arm"));
    fs::write(&scene, DESK).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_straightline"));
    command.args(["export", ARM, "--as", "c-abi", "--lanes", "standalone", "--fma", "--scene"]);
    succeeds(command.arg(&scene).arg("-o").arg(&package));
    let program = r#"#include "arm_dynamics.h"
#include <math.h>
#include <stdio.h>
#include <string.h>
int main(void) {
    static const double q[3] = {0.3, -0.8, 1.1}, qd[3] = {0.4, 1.2, -0.7}, tau[3] = {2.0, -3.0, 0.5};
    static const double pose[12] = {0.1, 0.2, 0.3, 1, 0, 0, 0, 0.8, 0.6, 0, -0.6, 0.8}, still[6] = {0};
    double h[9], bias[3], s[1], sd[1], j[3], a[1], qdd[3], f[1], sdd[1], violation[1], pivot[1];
    double again[3], f2[1], sdd2[1], violation2[1], pivot2[1];
    arm_mass_matrix(q, h);
    arm_bias_force(q, qd, bias);
    arm_contact_desk_constrained_coordinates(q, qd, pose, still, still, s, sd, j, a);
    arm_contact_desk_forward_dynamics(q, qd, tau, pose, still, still, qdd, f, sdd, violation, pivot);
    for (int i = 0; i < 3; i++) {
        double left = bias[i] - tau[i] - j[i] * f[0];
        for (int k = 0; k < 3; k++) left += h[3 * i + k] * qdd[k];
        if (!(fabs(left) < 1e-12)) return 1;
    }
    if (!(fabs(j[0] * qdd[0] + j[1] * qdd[1] + j[2] * qdd[2] + a[0]) < 1e-12) || !(fabs(f[0]) > 1e-3)) return 2;
    arm_contact_desk_forward_dynamics_batch_soa(1, q, qd, tau, pose, still, still, again, f2, sdd2, violation2, pivot2);
    if (!(fabs(again[0] - qdd[0]) < 1e-11) || !(fabs(f2[0] - f[0]) < 1e-11)) return 3;
    arm_contact_desk_forward_dynamics_batch_aos(0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0);
    printf("%.17g\n", f[0]);
    return 0;
}
"#;
    let Some(printed) = crate::in_c::printed(&package, "arm_dynamics", Library::SharedRelease, program) else { return };
    assert!(printed.trim().parse::<f64>().is_ok(), "{printed}");
}

const TOOL: &str = "[outputs]\nfunctions = [\"gravity_force\"]\n\
                    [[parameter]]\nkind = \"payload\"\nname = \"tool\"\nframe = \"forearm\"\n";

#[test]
fn c_makes_a_run_time_parameter_and_is_told_why_it_cannot_be() {
    let scratch = scratch("parameter");
    let (scene, package) = (scratch.join("tool.toml"), scratch.join("arm"));
    fs::write(&scene, TOOL).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_straightline"));
    succeeds(command.args(["export", ARM, "--c-abi", "--scene"]).arg(&scene).arg("-o").arg(&package));
    let program = r#"#include "arm_dynamics.h"
#include <stdio.h>
int main(void) {
    static const double q[3] = {0.3, -0.8, 1.1}, com[3] = {0.1, 0.02, -0.05};
    static const double inertia[6] = {1e-3, 0, 0, 2e-3, 0, 1.5e-3}, impossible[6] = {1e-3, 0, 0, 1e-3, 0, 3e-3};
    double tool[20] = {0}, g[3], loaded[3];
    arm_gravity_force(q, tool, g);
    if (arm_tool_new(-1.0, com, inertia, tool) != 2 || arm_tool_new(0.0, com, inertia, tool) != 3) return 1;
    if (arm_tool_new(0.0 / 0.0, com, inertia, tool) != 1 || arm_tool_new(1.0, com, impossible, tool) != 4) return 2;
    for (int i = 0; i < 20; i++) if (tool[i] != 0) return 3;
    if (arm_tool_new(0.7, com, inertia, tool) != 0) return 4;
    arm_gravity_force(q, tool, loaded);
    for (int i = 0; i < 3; i++) printf("%.17g\n", loaded[i] - g[i]);
    return 0;
}
"#;
    let Some(printed) = crate::in_c::printed(&package, "arm_dynamics", Library::StaticDebug, program) else { return };
    // truth: m g · ∂p/∂q of the tool's centre of mass, which is a frame there, by the generic algorithms
    let centre = FrameOption { name: "centre".into(), link: "forearm".into(), xyz: [0.1, 0.02, -0.05], rpy: [0.0; 3] };
    let options = ModelOptions { frames: vec![centre], ..ModelOptions::default() };
    let (model, _) = load(&Source::new(ARM, fs::read_to_string(ARM).unwrap()), &options);
    let model = model.unwrap();
    let q: Vec<Dd> = [0.3, -0.8, 1.1].map(Dd::from).to_vec();
    let frames = [model.frame("centre").unwrap()];
    let jacobian = Function::Jacobian.evaluate(&model, &frames, ForwardDynamicsMethod::Factorisation, &[q]);
    for (i, line) in printed.lines().enumerate() {
        let expected = (Dd::from(0.7 * 9.81) * jacobian[2 * 3 + i]).to_f64();
        let found: f64 = line.parse().unwrap();
        // differences of torques near 10
        assert!((found - expected).abs() < 1e-13, "{i}: {found} is not {expected}");
    }
    assert_eq!(printed.lines().count(), 3);
}

/// In C99 the same functions: the bits of the library that cargo builds, without cargo and without a library.
#[test]
fn a_package_in_c99_computes_the_bits_of_the_library() {
    let scratch = scratch("c99");
    let (rust, c99) = (scratch.join("rust"), scratch.join("c99"));
    for (kind, package) in [("--c-abi", &rust), ("--c99", &c99)] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_straightline"));
        let functions = ["--function", "inverse_dynamics", "--function", "forward_dynamics"];
        succeeds(command.args(["export", ARM, kind, "--prefix", "Arm3"]).args(functions).arg("-o").arg(package));
    }
    let program = r#"#include "arm3_dynamics.h"
#include <stdio.h>
int main(void) {
    static const double q[3] = {0.3, -0.8, 1.1}, qd[3] = {0.4, 1.2, -0.7}, tau[3] = {2.0, -3.0, 0.5};
    double out[3], qdd[3];
    Arm3_forward_dynamics(q, qd, tau, qdd);
    Arm3_inverse_dynamics(q, qd, qdd, out);
    for (int i = 0; i < 3; i++) printf("%a %a\n", qdd[i], out[i]);
    printf("%s %d\n", Arm3_joint_name(2), Arm3_nq());
    return 0;
}
"#;
    let Some(of_rust) = crate::in_c::printed(&rust, "arm3_dynamics", Library::SharedRelease, program) else { return };
    let (main, built) = (scratch.join("main.c"), scratch.join("main"));
    fs::write(&main, program).unwrap();
    let source = c99.join("arm3_dynamics.c");
    succeeds(Command::new("cc").args(["-O2", "-I"]).arg(&c99).arg("-o").args([&built, &main, &source]));
    assert_eq!(succeeds(&mut Command::new(&built)), of_rust);
    // one of them is not the other
    let broken = fs::read_to_string(&source).unwrap().replacen(" + (", " - (", 12);
    fs::write(&source, broken).unwrap();
    succeeds(Command::new("cc").args(["-O2", "-I"]).arg(&c99).arg("-o").args([&built, &main, &source]));
    assert_ne!(succeeds(&mut Command::new(&built)), of_rust);
}

#[test]
fn what_c99_has_not_is_refused_and_nothing_is_written() {
    let package = scratch("c99-refused").join("package");
    let mut command = Command::new(env!("CARGO_BIN_EXE_straightline"));
    let output = command.args(["export", ARM, "--c99", "--fma", "-o"]).arg(&package).output().unwrap();
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(1) && text.contains("libm") && text.contains("leave out `fma`"), "{text}");
    assert!(!package.exists());
}
