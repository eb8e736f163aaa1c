//! Options and scene, where they contradict each other.

use crate::choices::{Choice, Lanes};
use crate::diagnostic::Diagnostics;
use crate::function::Function;
use crate::options::Options;
use crate::scene::{messages as say, Base, Budget, Gravity};
use straightline_graph::expr::Grade;

/// What reading the scene's file found, or else what the scene and the options beside it contradict each other in. Scenes from
/// files are read into options by [`SceneFile::into_options`](crate::options::SceneFile::into_options), which cannot contradict itself.
pub fn check_options(options: &Options, diagnostics: &mut Diagnostics) {
    let scene = &options.scene;
    diagnostics.extend(scene.places.complaints().clone());
    if scene.places.complaints().has_errors() {
        return;
    }
    if let Some(source) = scene.places.source() {
        diagnostics.add_source(source);
    }
    for (i, scalar) in options.also.iter().enumerate() {
        if *scalar == options.scalar || options.also[..i].contains(scalar) {
            scene.places.complain("options.scalar", say::scalar_twice(scalar.name()), diagnostics);
        }
    }
    if scene.gravity != Gravity::OfRobot && options.model.gravity.is_some() {
        scene.places.complain("hold.gravity", say::said_twice("gravity"), diagnostics);
    }
    if scene.base == Base::Fixed && options.model.floating_base {
        scene.places.complain("hold.base", say::said_twice("the base"), diagnostics);
    }
    if scene.base == Base::Moving && options.functions.iter().any(|f| f.spec().solves) {
        scene.places.complain("hold.base", say::moving_base_forward(), diagnostics);
    }
    for (function, _) in scene.budgets.iter().filter(|(_, b)| b.mixed_precision) {
        let path = format!("budget.{}.mixed_precision", function.name());
        let form = format!("`limbs = \"{}\"`", options.limbs.word());
        for (with, is_asked) in
            [("`fma`", options.fma), ("`generic`", options.generic), (&form[..], options.limbs.needs_limbs())]
        {
            if is_asked {
                scene.places.complain(&path, say::mixed_elsewhere(with), diagnostics);
            }
        }
    }
    check_figures(options, diagnostics);
    if options.self_test && options.fma {
        scene.places.complain("options.self_test", say::self_test_fused(), diagnostics);
    }
    if options.limbs.needs_limbs() && options.grade == Grade::Exact {
        scene.places.complain("options.limbs", say::limbs_exact(options.limbs.word()), diagnostics);
    }
    // of a file this was said when it was read, whatever functions of it are asked for
    let is_alone = |function: &&Function| scene.places.source().is_none() && !options.functions.contains(function);
    for function in scene.budgets.keys().filter(is_alone) {
        let name = function.name();
        scene.places.complain(&format!("budget.{name}"), say::budget_alone(name), diagnostics);
    }
}

/// Figures of machine code need a machine, and a text that needs nothing else.
fn check_figures(options: &Options, diagnostics: &mut Diagnostics) {
    let places = &options.scene.places;
    let with = [
        ("`generic`", options.generic),
        ("`fma`", options.fma),
        ("`lanes = \"runtime\"`", options.lanes == Some(Lanes::Runtime)),
    ];
    let ask = |path: &str, what: &str, needs_machine: bool, diagnostics: &mut Diagnostics| match options.target {
        None if needs_machine => places.complain(path, say::target_missing(what), diagnostics),
        None => {}
        Some(_) => with.iter().filter(|(_, is_asked)| *is_asked).for_each(|(with, _)| {
            places.complain(path, say::figures_elsewhere(what, with), diagnostics);
        }),
    };
    if options.figures {
        ask("options.figures", "figures", true, diagnostics);
    }
    for (function, budget) in &options.scene.budgets {
        let unread = options.target.filter(|machine| budget.max_instructions.is_some() && machine.row().code.is_none());
        if let Some(machine) = unread {
            let (name, key) = (function.name(), "max_instructions");
            let why = format!("that of {} is not read", machine.row().name);
            places.complain(&format!("budget.{name}.{key}"), say::figure_unknown(name, key, &why), diagnostics);
        }
        for (key, _) in budget.of_machine_code().into_iter().filter(|(_, most)| most.is_some()) {
            ask(&format!("budget.{}.{key}", function.name()), key, key != Budget::STACK, diagnostics);
        }
    }
}
