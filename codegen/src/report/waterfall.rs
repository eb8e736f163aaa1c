//! From plain unrolling to the final count: what each optimisation and each item of a scene is worth.
//!
//! Every figure is the difference of two programs that were really compiled: optimisations are switched on one after the
//! other for the robot as its file has it, then the scene's items are added one after the other. What an item saves so
//! depends on those before it; the sum does not.

use crate::diagnostic::Diagnostics;
use crate::equations::Robot;
use crate::function::Function;
use crate::options::{Optimisations, Options};
use crate::program::optimised;
use crate::scene::{apply, Base, CoulombForm, Effects, Gravity, Parameter, ResultPart, Scene};
use straightline_core::model::Model;
use straightline_core::Dd;
use straightline_graph::expr::Counts;

/// How a function came to its operations.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Waterfall {
    /// Plain unrolling: the generic runtime with the robot's numbers, without what multiplies or adds zeros and what no
    /// result needs, and equal subexpressions once.
    pub plain: Counts,
    /// All optimisations, for the whole robot, without a scene.
    pub full: Counts,
    /// The steps from `plain` to the final counts, those that change nothing left out.
    pub savings: Vec<Saving>,
}

/// One step of a waterfall.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Saving {
    /// Such as `joints wrist_1, wrist_2 locked`.
    pub what: String,
    /// Whose it is.
    pub by: By,
    /// Change of multiplications, additions, divisions and square roots; negative for a saving.
    pub operations: i64,
    /// Change of sine-cosine pairs.
    pub sincos: i64,
    /// The counts after it.
    pub after: Counts,
}

/// Who saves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize), serde(rename_all = "lowercase"))]
pub enum By {
    /// An optimisation of the compiler.
    Compiler,
    /// An item of the scene.
    Scene,
}

impl Waterfall {
    /// The steps that the scene makes.
    pub fn of_scene(&self) -> impl Iterator<Item = &Saving> {
        self.savings.iter().filter(|s| s.by == By::Scene)
    }
}

/// A change with its sign: `−412`, `+37`.
pub fn signed(change: i64) -> String {
    match change {
        0 => "0".to_string(),
        1.. => format!("+{change}"),
        _ => format!("−{}", change.unsigned_abs()),
    }
}

/// A scene on the way from none to the whole one.
#[derive(Debug)]
pub struct SceneStop {
    /// What was added last.
    what: ItemKind,
    scene: Scene,
    robot: Robot,
}

/// What a scene's item says.
#[derive(Clone, Debug)]
enum ItemKind {
    Text(String),
    /// The results that are wanted, in the words of each function.
    Selection,
}

/// The stops of a scene for a robot, `whole` as its file has it: first the empty scene, last the scene itself.
pub fn stops(whole: &Model<Dd>, scene: &Scene) -> Vec<SceneStop> {
    // drives belong to the robot, wherever they are written, and columns to a regressor
    let mut now = Scene {
        places: scene.places.clone(),
        drives: scene.drives.clone(),
        regressor: scene.regressor.clone(),
        ..Scene::default()
    };
    let mut stops: Vec<SceneStop> = robot_in(whole, &now)
        .map(|(robot, scene)| SceneStop { what: ItemKind::Text(String::new()), scene, robot })
        .into_iter()
        .collect();
    for (what, change) in items(whole, scene) {
        change(&mut now, scene);
        // a part of a sound scene is sound; if it were not, its step would count with the next
        stops.extend(robot_in(whole, &now).map(|(robot, scene)| SceneStop { what, scene, robot }));
    }
    stops
}

/// Whether there is such a function at a stop.
fn has_function(function: Function, stop: &SceneStop) -> bool {
    function.is_of(&stop.robot.model) && (!function.is_of_scene_parameters() || stop.scene.has_loads())
}

/// The waterfall of a function. `frames` are those of the final program, `last` its counts.
pub fn waterfall(
    stops: &[SceneStop],
    frames: &[String],
    function: Function,
    options: &Options,
    last: Counts,
) -> Waterfall {
    // frames that only the scene names are those of every stop
    let frames = if frames.is_empty() { options.scene.frames_of(function, frames) } else { frames };
    // a robot may have a function only as its scene has it, as where drives of several joints are left with one
    let stops: Vec<&SceneStop> = stops.iter().filter(|stop| has_function(function, stop)).collect();
    if stops.is_empty() {
        return Waterfall { plain: last, full: last, savings: Vec::new() };
    }
    let counts = |stop: &SceneStop, optimisations| {
        let options = Options { scene: stop.scene.clone(), ..options.clone() };
        optimised(&stop.robot, frames, function, &options, optimisations).counts()
    };
    let all = options.optimisations();
    let plain = counts(stops[0], Optimisations::default());
    let mut now = plain;
    let mut savings = Vec::new();
    let mut step = |what: &str, by, after: Counts| {
        if after != now {
            let change = |f: fn(&Counts) -> usize| f(&after) as i64 - f(&now) as i64;
            let (operations, sincos) = (change(Counts::flops), change(|c| c.sin_cos));
            savings.push(Saving { what: what.to_string(), by, operations, sincos, after });
            now = after;
        }
        after
    };
    let mut full = plain;
    for (what, optimisations) in all.steps() {
        full = step(what, By::Compiler, counts(stops[0], optimisations));
    }
    for (i, stop) in stops.iter().enumerate().skip(1) {
        let what = match &stop.what {
            ItemKind::Text(text) => text.clone(),
            ItemKind::Selection => selection(function, &stop.scene),
        };
        let after = if i + 1 == stops.len() { last } else { counts(stop, all) };
        step(&what, By::Scene, after);
    }
    Waterfall { plain, full, savings }
}

/// The robot that a scene makes of the whole one, and the scene in its terms.
pub fn robot_in(whole: &Model<Dd>, scene: &Scene) -> Option<(Robot, Scene)> {
    let model = apply(whole.clone(), scene, &mut Diagnostics::new())?;
    let scene = scene.resolved(&model);
    Some((Robot::new(model), scene))
}

/// The items of a scene in words, those of its selected outputs by function.
pub fn items_of(whole: &Model<Dd>, scene: &Scene) -> Vec<String> {
    let words = |(what, _)| match what {
        ItemKind::Text(text) => vec![text],
        ItemKind::Selection => {
            scene.outputs.keys().map(|f| format!("{}: {}", f.name(), selection(*f, scene))).collect()
        }
    };
    items(whole, scene).into_iter().flat_map(words).collect()
}

/// Takes an item of the second scene over to the first.
type SceneChange = Box<dyn Fn(&mut Scene, &Scene)>;
/// Takes an effect from a scene.
type Switch = fn(&mut Effects, &Effects);

/// The items of a scene in the order of the waterfall.
fn items(whole: &Model<Dd>, scene: &Scene) -> Vec<(ItemKind, SceneChange)> {
    let mut items: Vec<(ItemKind, SceneChange)> = Vec::new();
    let mut item = |what: String, change: SceneChange| items.push((ItemKind::Text(what), change));
    match scene.base {
        Base::Fixed => item("base fixed".to_string(), Box::new(|now, s| now.base = s.base)),
        Base::Moving => item("base on a given motion".to_string(), Box::new(|now, s| now.base = s.base)),
        Base::OfRobot | Base::Floating => {}
    }
    match scene.gravity {
        Gravity::OfRobot => {}
        Gravity::Constant([0.0, 0.0, 0.0]) => {
            item("no gravity".to_string(), Box::new(|now, s| now.gravity = s.gravity))
        }
        Gravity::Constant(g) => {
            item(format!("gravity held at {g:?}"), Box::new(|now, s| now.gravity = s.gravity));
        }
        Gravity::Input => item("gravity as an input".to_string(), Box::new(|now, s| now.gravity = s.gravity)),
    }
    for run in locked_runs(whole, scene) {
        let what = format!("{} locked", joints(&run));
        item(what, Box::new(move |now, s| now.locked.extend(s.locked.iter().filter(|l| run.contains(&l.0)).cloned())));
    }
    for (i, payload) in scene.payloads.iter().enumerate() {
        let what = format!("payload {} on {}", payload.name, payload.frame);
        item(what, Box::new(move |now, s| now.payloads.push(s.payloads[i].clone())));
    }
    if scene.zero.qd {
        item("q̇ = 0".to_string(), Box::new(|now, _| now.zero.qd = true));
    }
    if scene.zero.qdd {
        item("q̈ = 0".to_string(), Box::new(|now, _| now.zero.qdd = true));
    }
    if !scene.zero.joints_at_rest.is_empty() {
        let what = format!("{} at rest", joints(&scene.zero.joints_at_rest));
        item(what, Box::new(|now, s| now.zero.joints_at_rest.clone_from(&s.zero.joints_at_rest)));
    }
    let effects = &scene.effects;
    let switched: [(bool, &str, Switch); 7] = [
        (!effects.rotor_inertia, "no rotor inertia", |now, _| now.rotor_inertia = false),
        (!effects.damping, "no viscous friction", |now, _| now.damping = false),
        (effects.coulomb == CoulombForm::Off, "no Coulomb friction", |now, s| now.coulomb = s.coulomb),
        (matches!(effects.coulomb, CoulombForm::Smooth(_)), "smooth Coulomb friction", |now, s| {
            now.coulomb = s.coulomb
        }),
        (!effects.springs, "no springs", |now, _| now.springs = false),
        (!effects.transmission_losses, "no losses in transmissions", |now, _| now.transmission_losses = false),
        (!effects.elastic_transmissions, "rigid transmissions", |now, _| now.elastic_transmissions = false),
    ];
    for (_, what, change) in switched.into_iter().filter(|(is_so, ..)| *is_so) {
        item(what.to_string(), Box::new(move |now, s| change(&mut now.effects, &s.effects)));
    }
    for (i, parameter) in scene.parameters.iter().enumerate() {
        let what = match parameter {
            Parameter::Payload { name, frame } => format!("payload {name} on {frame} at run time"),
            Parameter::Link { link } => format!("inertia of {link} at run time"),
            Parameter::Drive { drive, numbers, .. } => format!("{} of drive {drive} at run time", numbers.join(", ")),
        };
        item(what, Box::new(move |now, s| now.parameters.push(s.parameters[i].clone())));
    }
    if !scene.outputs.is_empty() {
        items.push((ItemKind::Selection, Box::new(|now, s| now.outputs.clone_from(&s.outputs))));
    }
    items
}

/// The locked joints in runs of neighbours, in the order of their coordinates.
fn locked_runs(whole: &Model<Dd>, scene: &Scene) -> Vec<Vec<String>> {
    let is_locked = |name: &str| scene.locked.iter().any(|(locked, _)| locked == name);
    let order = whole.joints();
    let runs = order.chunk_by(|a, b| is_locked(&a.name) == is_locked(&b.name));
    runs.filter(|run| is_locked(&run[0].name)).map(|run| run.iter().map(|j| j.name.clone()).collect()).collect()
}

/// `joint a`, `joints a, b, c`, or of more `5 joints, a to e`.
fn joints(names: &[String]) -> String {
    match names {
        [one] => format!("joint {one}"),
        [.., last] if names.len() > 3 => format!("{} joints, {} to {last},", names.len(), names[0]),
        _ => format!("joints {}", names.join(", ")),
    }
}

/// What of a function is wanted.
fn selection(function: Function, scene: &Scene) -> String {
    let Some(selection) = scene.outputs.get(&function) else { return "the results asked for".to_string() };
    let mut words = Vec::new();
    if !selection.joints.is_empty() {
        words.push(joints(&selection.joints).trim_end_matches(',').to_string());
    }
    if !selection.frames.is_empty() {
        words.push(format!("frames {}", selection.frames.join(", ")));
    }
    if !selection.results.is_empty() {
        words.push(format!("the results {}", selection.results.join(", ")));
    }
    match selection.part {
        ResultPart::Whole => {}
        ResultPart::Linear => words.push("the linear part".to_string()),
        ResultPart::Angular => words.push("the angular part".to_string()),
        ResultPart::Diagonal => words.push("the diagonal".to_string()),
        ResultPart::Rows(rows) => words.push(format!("the rows {}", rows.words().join(", "))),
    }
    format!("only {}", words.join(", "))
}
