//! A robot in its scene, and options that fit it: all that is read and checked before anything is computed.

use crate::choices::Choice;
use crate::description::{self, messages, Description};
use crate::diagnostic::{Diagnostics, Source};
use crate::function::{Extent, Function};
use crate::options::{check_options, Options};
use crate::program::demand_inertia::demand_inertia;
use crate::program::range;
use crate::{model, scene};
use straightline_core::model::Model;
use straightline_core::Dd;

/// What is wrong with the file or the options, without compiling: all that [`compile`](super::compile()) would say but what only the finished
/// programs tell, such as exceeded budgets.
pub fn examine(source: &Source, options: &Options) -> Diagnostics {
    match prepare(source, options) {
        Ok(prepared) => prepared.diagnostics,
        Err(diagnostics) => diagnostics,
    }
}

/// A robot in its scene, and options that fit it.
pub(super) struct Prepared {
    /// What the file says.
    pub description: Description,
    /// The robot without its scene.
    pub whole: Model<Dd>,
    pub model: Model<Dd>,
    pub frames: Vec<String>,
    /// The options, whose scene knows the drives of the file.
    pub options: Options,
    /// The same, spelled out for the robot.
    pub resolved: Options,
    /// Warnings.
    pub diagnostics: Diagnostics,
}

/// Reads and checks everything.
pub(super) fn prepare(source: &Source, options: &Options) -> Result<Prepared, Diagnostics> {
    let mut diagnostics = Diagnostics::reporting(&options.reporting);
    let (mut description, mut options) = (description::read(source, &mut diagnostics), options.clone());
    for drives in description.iter_mut().map(|d| &mut d.drives).chain([&mut options.scene.drives]) {
        range::leave_out_lost_limits(drives, &options.scene.parameters, options.scalar);
    }
    let options = &options.knowing_drives(description.as_ref().map_or(&[], |d| &d.drives));
    let build = |d: &Description| model::build(d, &options.scene.model_options(&options.model), &mut diagnostics);
    let whole = description.as_ref().and_then(build);
    model::finish(&mut diagnostics);
    check_options(options, &mut diagnostics);
    let model = whole.clone().and_then(|whole| scene::apply(whole, &options.scene, &mut diagnostics));
    if !diagnostics.has_errors() {
        description.iter().for_each(|d| range::of_robot(d, &options.scene, options.scalar, &mut diagnostics));
    }
    let of_frames = model.as_ref().or(whole.as_ref());
    let frames = of_frames.map(|m| choose_frames(m, &options.frames, &mut diagnostics)).unwrap_or_default();
    let functions = of_frames.map(|m| Function::wanted(&options.functions, m)).unwrap_or_default();
    let path_of = |function: &Function| match options.scene.outputs.contains_key(function) {
        true => format!("outputs.{}", function.name()),
        false => "options.functions".to_string(),
    };
    // functions of contact modes need what the function has whose inputs they take
    let of_contacts = options.scene.contacts.named();
    let of_contacts = of_contacts.map(|f| (f.name(), f.spec().base, format!("outputs.contact.{}", f.name())));
    let named = functions.iter().map(|f| (f.name(), *f, path_of(f))).chain(of_contacts);
    for ((name, function, path), model) in named.filter_map(|f| Some((f, of_frames?))) {
        if !function.is_of(model) {
            let complaint = scene::messages::function_not_of_robot(name, function.lacking(model));
            options.scene.places.complain(&path, complaint, &mut diagnostics);
        }
    }
    let loads = of_frames.is_some_and(|m| options.scene.parameters.iter().any(|p| p.is_load() && p.is_of(m)));
    for function in functions.iter().filter(|function| function.is_of_scene_parameters() && !loads) {
        let complaint = scene::messages::function_not_of_scene(function.name());
        options.scene.places.complain(&path_of(function), complaint, &mut diagnostics);
    }
    let of_joints = [Extent::BaseParameters, Extent::RegressorEntries];
    let has_columns = |function: &Function| of_joints.into_iter().any(|extent| function.has_axis(extent));
    if !options.scene.regressor.is_empty() && !functions.is_empty() && !functions.iter().any(has_columns) {
        let names: Vec<&str> = Function::known().filter(has_columns).map(Function::name).collect();
        options.scene.places.complain("regressor", scene::messages::regressor_unused(&names), &mut diagnostics);
    }
    if options.limbs.needs_limbs() && model.as_ref().is_some_and(|model| model::limbs::limbs(model).is_empty()) {
        let complaint = scene::messages::no_identical_limbs(options.limbs.word());
        options.scene.places.complain("options.limbs", complaint, &mut diagnostics);
    }
    diagnostics.sort();
    let (Some(description), Some(whole), Some(model), false) = (description, whole, model, diagnostics.has_errors())
    else {
        return Err(diagnostics);
    };
    let resolved = Options { scene: options.scene.resolved(&model), functions, ..options.clone() };
    demand_inertia(&model, &resolved, &mut diagnostics);
    match diagnostics.has_errors() {
        true => {
            diagnostics.sort();
            Err(diagnostics)
        }
        false => Ok(Prepared { description, whole, model, frames, options: options.clone(), resolved, diagnostics }),
    }
}

/// The frames asked for, or the tips of the robot: the last frame on every body that carries no other.
fn choose_frames(model: &Model<Dd>, asked: &[String], diagnostics: &mut Diagnostics) -> Vec<String> {
    if asked.is_empty() {
        let carries = |i: usize| model.bodies.iter().any(|b| b.parent == Some(i));
        let last_on = |i: usize| model.frames.iter().rev().find(|f| f.body == Some(i)).map(|f| f.name.clone());
        return (0..model.bodies.len()).filter(|i| !carries(*i)).filter_map(last_on).collect();
    }
    for name in asked.iter().filter(|name| model.frame(name).is_none()) {
        diagnostics.push(messages::unknown_frame(name, model.frames.iter().map(|f| f.name.as_str())));
    }
    asked.to_vec()
}
