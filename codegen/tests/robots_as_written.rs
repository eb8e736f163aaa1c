//! Robots as people and exporters write them, all functions in f64 and f32: the program with all optimisations loses at most so
//! many times what the plain program of the same robot loses, against the second author in double-double.
//!
//! Nothing is compiled by rustc: programs are run operation by operation in their own arithmetic. More robots, or others:
//! `ROBOTS=500 SEED=7 STYLES=exported,digits4 cargo test --release -p straightline-codegen --test robots_as_written -- --ignored --nocapture`

#[path = "../../generated_tests/src/written/mod.rs"]
#[allow(dead_code)] // other tests use the rest
mod written;

#[path = "support/as_written.rs"]
mod as_written;

use as_written::{survey, Case};
use written::{Random, Shape, Style};

/// Arms of two and three joints with numbers of 1 to 4 decimals.
fn small_arms(count: usize, seed: u64) -> Vec<Case> {
    let arm = |k: usize| {
        let mut random = Random(seed + k as u64);
        let shape = Shape { sliding: random.one_of(&[0, 4]), ..Shape::arm(2 + random.below(2)) };
        Case::new(Style::Digits(1 + k % 4), shape, seed + k as u64)
    };
    (0..count).map(arm).collect()
}

/// Robots of any shape whose numbers an exporter wrote.
fn exported(count: usize, seed: u64) -> Vec<Case> {
    any_shape(&[Style::Exported], count, seed)
}

/// Robots of any shape in turn in these styles.
fn any_shape(styles: &[Style], count: usize, seed: u64) -> Vec<Case> {
    let case = |k: usize| {
        let shape = Shape::any(&mut Random(seed + k as u64), 9);
        Case::new(styles[k % styles.len()], shape, seed + k as u64)
    };
    (0..count).map(case).collect()
}

/// A number from the environment.
fn asked(name: &str, otherwise: u64) -> u64 {
    std::env::var(name).map_or(otherwise, |text| text.parse().unwrap_or_else(|e| panic!("{name}={text}: {e}")))
}

#[test]
#[ignore = "2000 robots, an hour"]
fn thousands_of_robots() {
    let (count, seed) = (asked("ROBOTS", 2000) as usize, 1_000_000 * asked("SEED", 1));
    let cases = match std::env::var("STYLES") {
        Ok(names) => {
            let named = |name: &str| {
                let found = Style::all().into_iter().find(|style| style.name() == name);
                found.unwrap_or_else(|| panic!("STYLES={names}: no style `{name}`"))
            };
            any_shape(&names.split(',').map(named).collect::<Vec<_>>(), count, seed)
        }
        Err(_) => [
            small_arms(count * 2 / 5, seed),
            exported(count * 3 / 10, seed),
            any_shape(&Style::all(), count * 3 / 10, seed),
        ]
        .concat(),
    };
    survey(cases);
}
