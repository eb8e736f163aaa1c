//! What the figures have to keep, whatever the record says.

use super::Figures;
use std::collections::BTreeMap;

/// On a Cortex-M4F from flash: robot and function; at most so many instructions, bytes of flash and bytes of stack.
const MOST: [(&str, u64, u64, u64); 24] = [
    ("panda::inverse_dynamics", 880, 2900, 320),
    ("ur5::inverse_dynamics", 500, 1400, 160),
    ("puma560::inverse_dynamics", 470, 1500, 136),
    ("solo12::inverse_dynamics", 1820, 5400, 500),
    ("panda::gravity_force", 390, 700, 120),
    ("ur5::gravity_force", 190, 400, 120),
    ("puma560::gravity_force", 250, 500, 120),
    ("solo12::gravity_force", 770, 1100, 120),
    ("panda::mass_matrix", 640, 1800, 110),
    ("ur5::mass_matrix", 390, 900, 110),
    ("puma560::mass_matrix", 370, 1000, 110),
    ("solo12::mass_matrix", 1750, 4200, 400),
    ("panda::forward_dynamics", 1430, 5100, 340),
    ("ur5::forward_dynamics", 600, 1800, 340),
    ("puma560::forward_dynamics", 670, 2300, 340),
    ("solo12::forward_dynamics", 4000, 14600, 900),
    ("panda::mass_matrix_and_gravity_force", 760, 2200, 150),
    ("solo12_rolled::inverse_dynamics", 1820 * 115 / 100, 2600, 500),
    // C by GCC orders and allocates in its own way
    ("panda::inverse_dynamics in C99", 1160, 3800, 400),
    ("ur5::inverse_dynamics in C99", 600, 1700, 250),
    ("puma560::inverse_dynamics in C99", 620, 1900, 250),
    ("solo12::inverse_dynamics in C99", 2250, 6800, 500),
    ("panda::inverse_dynamics_derivatives", 3200, 12500, 700),
    ("solo12::inverse_dynamics_derivatives", 7600, 26000, 1500),
];

/// Loads and stores there.
const ACCESSES: [(&str, u64); 4] = [
    ("panda::inverse_dynamics", 200),
    ("ur5::inverse_dynamics", 90),
    ("solo12::inverse_dynamics", 420),
    ("solo12::forward_dynamics", 1250),
];

/// How many times fewer instructions one function takes than another, machine and memory included.
const TIMES: [(&str, &str, f64); 8] = [
    ("cortex-m4f\tflash\tpanda::inverse_dynamics", "cortex-m4f\tflash\tpanda::inverse_dynamics, loop in C", 2.8),
    ("cortex-m4f\tflash\tur5::inverse_dynamics", "cortex-m4f\tflash\tur5::inverse_dynamics, loop in C", 4.2),
    ("cortex-m4f\tflash\tpuma560::inverse_dynamics", "cortex-m4f\tflash\tpuma560::inverse_dynamics, loop in C", 4.3),
    ("cortex-m4f\tflash\tsolo12::inverse_dynamics", "cortex-m4f\tflash\tsolo12::inverse_dynamics, loop in C", 2.2),
    // legs in a loop take at most 1.15 times as many as legs apart
    ("cortex-m4f\tflash\tsolo12_rolled::inverse_dynamics", "cortex-m4f\tflash\tsolo12::inverse_dynamics", 1.0 / 1.15),
    (
        "rv32imac\tflash\tpanda::fixed::inverse_dynamics, certified to 1e-7",
        "rv32imac\tflash\tpanda::inverse_dynamics",
        25.0,
    ),
    (
        "cortex-m0plus\tflash\tpanda::fixed::inverse_dynamics, certified to 1e-7",
        "cortex-m0plus\tflash\tpanda::inverse_dynamics",
        12.0,
    ),
    ("cortex-m4f\tflash\tpanda::mass_matrix_and_gravity_force", "cortex-m4f\tflash\tpanda::mass_matrix", 0.9),
];

/// What does not keep its limit.
pub(super) fn exceeded(found: &BTreeMap<String, Figures>) -> Vec<String> {
    let mut exceeded = Vec::new();
    let of = |name: &str| found.get(name).unwrap_or_else(|| panic!("{name} was not measured"));
    let on_m4f = |name: &str| of(&format!("cortex-m4f\tflash\t{name}"));
    let mut hold = |name: &str, what: &str, is: u64, most: u64| {
        if is > most {
            exceeded.push(format!("{name}: {is} {what}, at most {most} are allowed"));
        }
    };
    for (name, instructions, flash, stack) in MOST {
        let figures = on_m4f(name);
        hold(name, "instructions", figures.instructions, instructions);
        hold(name, "bytes of flash", figures.flash, flash);
        hold(name, "bytes of stack", figures.stack, stack);
    }
    for (name, most) in ACCESSES {
        hold(name, "loads and stores", on_m4f(name).loads_and_stores, most);
    }
    for (name, other, least) in TIMES {
        let times = of(other).instructions as f64 / of(name).instructions as f64;
        if times < least {
            exceeded.push(format!(
                "{name}: {other} takes {times:.3} times as many instructions, at least {least:.3} are asked"
            ));
        }
    }
    exceeded
}
