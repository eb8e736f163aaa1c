//! What generated code is compared with: inverse dynamics as a loop over bodies in C (`looped.c`), on the same machine, with the same results.

use super::{harness, mangled, names, Bench, Emulator, Figures, ROBOTS, STATES};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use straightline_codegen::choices::{Memory, TargetMachine};
use straightline_core::model::Model;
use straightline_core::Dd;

/// Results of both may differ by such a part of the greatest torque: roundings of single precision, some 300 in a row.
const AGREE: f32 = 2e-5;
/// What the loop is compiled with: the processor's own, and a product and a sum in one instruction, which rounds once.
const FLAGS: [&str; 9] = [
    "-O3",
    "-mcpu=cortex-m4",
    "-mthumb",
    "-mfloat-abi=hard",
    "-mfpu=fpv4-sp-d16",
    "-ffp-contract=fast",
    "-fno-math-errno",
    "-ffreestanding",
    "-ffunction-sections",
];

impl Bench<'_> {
    /// The figures of the loops, by the robots' names, and those of generated code in the same program.
    pub(super) fn looped(&self, emulator: Emulator, plugin: &Path) -> BTreeMap<String, [Figures; 2]> {
        let (machine, memory) = (TargetMachine::CORTEX_M4F, Memory::Flash);
        let mut text = "#![no_std]\n#![no_main]\n#![allow(warnings)]\n".to_string();
        let (mut externs, mut runs, mut objects) = (String::new(), String::new(), Vec::new());
        for (robot, ..) in ROBOTS {
            let generated = self.compiled(robot, machine, memory);
            writeln!(text, "pub mod {robot} {{\n{}}}", generated.text).expect("a string takes text");
            let c = format!("pub fn {robot}_looped(q: *const f32, qd: *const f32, qdd: *const f32, tau: *mut f32);");
            writeln!(externs, "    {c}").expect("a string takes text");
            writeln!(runs, "    compare! {{ {robot}, {robot}_looped }}").expect("a string takes text");
            objects.push(self.object(robot, &generated.model));
        }
        let text = text + &harness(&names(), &runs, &externs, STATES);
        let program = self.linked(machine, memory, emulator, &text, &objects);
        let symbols: Vec<(String, String)> = ROBOTS
            .iter()
            .flat_map(|(robot, ..)| [mangled(robot, "inverse_dynamics").1, format!("{robot}_looped")])
            .map(|symbol| (symbol.clone(), symbol))
            .collect();
        let (output, counts) = self.run(&program, emulator, plugin, &symbols);
        for line in output.lines() {
            let (robot, bits) = line.split_once(' ').expect("a name and a number");
            let off = f32::from_bits(u32::from_str_radix(bits, 16).expect("digits"));
            // what is no number does not agree
            assert!(off <= AGREE, "{robot}: the loop in C is off by {off:e} of the greatest torque");
        }
        let of_objects = self.figures_of(&program, &symbols);
        let figures = |k: usize| {
            let (symbol, instructions) = &counts[k];
            let own = of_objects.get(symbol).copied().unwrap_or_default();
            Figures { instructions: instructions / STATES, ..own }
        };
        let both = |k: usize| [figures(2 * k), figures(2 * k + 1)];
        ROBOTS.iter().enumerate().map(|(k, (robot, ..))| ((*robot).to_string(), both(k))).collect()
    }

    /// The loop for a robot, compiled.
    fn object(&self, robot: &str, model: &Model<Dd>) -> PathBuf {
        let [source, object] = ["c", "o"].map(|ending| self.folder.join(format!("{robot}.{ending}")));
        std::fs::write(&source, in_c(robot, model)).expect("a file can be written");
        let mut compiler = Command::new(self.cross.join("arm-none-eabi-gcc"));
        let output =
            compiler.args(FLAGS).arg("-c").arg("-o").args([&object, &source]).output().expect("a C compiler runs");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        object
    }
}

/// The source of the loop with the numbers of a robot.
fn in_c(robot: &str, model: &Model<Dd>) -> String {
    let list = |numbers: &[Dd]| {
        let numbers: Vec<String> = numbers.iter().map(|x| format!("{:e}f", x.hi() as f32)).collect();
        format!("{{{}}}", numbers.join(", "))
    };
    let rows: Vec<String> = model
        .bodies
        .iter()
        .map(|body| {
            let parent = body.parent.map_or("-1".to_string(), |parent| parent.to_string());
            let r = body.placement.rotation.rows;
            // c s of a rotation about an axis have these places
            let is = |i: usize, j: usize, x: f64| (r[i][j].hi() - x).abs() < 1e-12;
            let turns_about = |k: usize| (0..3).all(|i| is(k, i, f64::from(i == k)) && is(i, k, f64::from(i == k)));
            let zero = Dd::from(0.0);
            let (kind, [cosine, sine]) = match (turns_about(0), turns_about(1)) {
                (true, true) => ("NONE", [zero; 2]),
                (true, false) => ("ABOUT_X", [r[1][1], r[2][1]]),
                (false, true) => ("ABOUT_Y", [r[0][0], r[0][2]]),
                (false, false) => ("GENERAL", [zero; 2]),
            };
            let inertia = &body.inertia;
            let second = &inertia.second_moment;
            let trace = second.xx + second.yy + second.zz;
            let about_origin =
                [trace - second.xx, trace - second.yy, trace - second.zz, -second.xy, -second.xz, -second.yz];
            let place = body.placement.translation.to_array();
            let [cosine, sine, mass] = [cosine, sine, inertia.mass].map(|x| format!("{:e}f", x.hi() as f32));
            format!(
                "    {{{parent}, {kind}, {cosine}, {sine}, {}, {}, {mass}, {}, {}}},\n",
                list(&r.concat()),
                list(&place),
                list(&inertia.first_moment.to_array()),
                list(&about_origin)
            )
        })
        .collect();
    let floats = model.bodies.first().is_some_and(|body| body.joint.kind.nq() > 1);
    let table = format!("static const struct body bodies[BODIES] = {{\n{}}};\n", rows.concat());
    format!(
        "#define ROBOT {robot}_looped\n#define BODIES {}\n#define FLOATING {}\n#define GRAVITY {}\n{}",
        model.bodies.len(),
        u8::from(floats),
        list(&model.gravity.to_array()),
        include_str!("looped.c").replace("\nTABLE\n", &table)
    )
}
