//! Whatever is asked for that divides by an inertia is refused where there is none.

use crate::description::messages;
use crate::diagnostic::{Diagnostic, Diagnostics};
use crate::function::{ContactFunction, Divisor, Function, InModes};
use crate::model::merge::{merge, Part};
use crate::model::singular::{singular_joints, Inertia};
use crate::options::Options;
use crate::program::contact::Mode;
use straightline_core::model::{BodyId, Model};
use straightline_core::spatial::{Sym3, Vec3};
use straightline_core::Dd;

/// What is asked for that divides by an inertia, in words, and what to look at in the scene.
struct Asked {
    inertia: Inertia,
    words: String,
    path: &'static str,
}

/// All that is asked for that divides by what joints feel: functions, their error bounds and stages, and the functions of contact modes.
fn asked(model: &Model<Dd>, options: &Options) -> Vec<Asked> {
    let is_driven = !model.drives.is_empty();
    let of_divisor = |divisor: Divisor| match divisor {
        Divisor::Inertia => Some(Inertia::OfLinks),
        Divisor::InertiaWithDrives => Some(Inertia::WithDrives),
        Divisor::Nothing | Divisor::Mass | Divisor::MassOfEach => None,
    };
    let of_function = |f: &Function| of_divisor(f.spec().divisor);
    let of_contact = |f: &ContactFunction| {
        let is_there = is_driven || f.spec().modes != InModes::OfDrivenRobots;
        of_divisor(f.spec().divisor).filter(|_| is_there)
    };
    let contacts = match Mode::all(&options.scene).is_empty() {
        true => Vec::new(),
        false => options.scene.contacts.wanted(),
    };
    let mut asked = Vec::new();
    for inertia in [Inertia::OfLinks, Inertia::WithDrives] {
        let functions = options.functions.iter().filter(|f| of_function(f) == Some(inertia));
        let functions: Vec<String> = functions.map(|f| f.name().to_string()).collect();
        let modes = contacts.iter().filter(|f| of_contact(f) == Some(inertia));
        let modes: Vec<String> = modes.map(|f| format!("`{}`", f.name())).collect();
        match &functions[..] {
            [] => {}
            [one] if one == "forward_dynamics" => {
                asked.push(Asked { inertia, words: "forward dynamics is".to_string(), path: "options.functions" });
            }
            several => {
                let names: Vec<String> = several.iter().map(|name| format!("`{name}`")).collect();
                let words = format!("{} {}", names.join(", "), if names.len() == 1 { "is" } else { "are" });
                asked.push(Asked { inertia, words, path: "options.functions" });
            }
        }
        if !modes.is_empty() {
            let be = if modes.len() == 1 { "is" } else { "are" };
            let words = format!("{} of contact modes {be}", modes.join(", "));
            asked.push(Asked { inertia, words, path: "outputs.contact" });
        }
    }
    asked
}

/// Whatever is asked for that divides by what a joint feels, while it feels nothing, is an error at that joint. Where the joint feels what
/// a run-time parameter brings, and nothing else, it cannot be decided here, and is a warning.
pub(crate) fn demand_inertia(model: &Model<Dd>, options: &Options, diagnostics: &mut Diagnostics) {
    demand_mass(model, options, diagnostics);
    let full = options.scene.has_loads().then(|| with_parameters(model, options));
    let mut said = Vec::new();
    for asked in asked(model, options) {
        let never = singular_joints(full.as_ref().unwrap_or(model), asked.inertia);
        for &id in &never {
            let complaint = messages::no_forward_dynamics(&asked.words, &model.bodies[id].joint.name);
            place(complaint, &model.bodies[id].joint.name, Some((asked.path, options)), diagnostics);
        }
        if full.is_none() {
            continue;
        }
        for id in singular_joints(model, asked.inertia).into_iter().filter(|id| !never.contains(id)) {
            if said.contains(&id) {
                continue;
            }
            said.push(id);
            let joint = &model.bodies[id].joint.name;
            let names: Vec<String> =
                options.scene.parameters.iter().filter(|p| p.is_load()).map(|p| format!("`{}`", p.name())).collect();
            let complaint = messages::inertia_by_parameters(&asked.words, joint, &names.join(", "));
            place(complaint, joint, Some((asked.path, options)), diagnostics);
        }
    }
}

/// A centre of mass takes some mass; what a run-time parameter brings is not known here.
fn demand_mass(model: &Model<Dd>, options: &Options, diagnostics: &mut Diagnostics) {
    let divides = |f: &&Function| f.spec().divisor == Divisor::Mass;
    let names: Vec<String> = options.functions.iter().filter(divides).map(|f| format!("`{}`", f.name())).collect();
    let has_mass = model.bodies.iter().any(|b| b.inertia.mass != Dd::ZERO);
    if !names.is_empty() && !has_mass && !options.scene.has_loads() {
        let asked = format!("{} {}", names.join(", "), if names.len() == 1 { "is" } else { "are" });
        options.scene.places.complain("options.functions", messages::no_mass(&asked), diagnostics);
    }
    let of_each = options.functions.iter().filter(|f| f.spec().divisor == Divisor::MassOfEach);
    for function in of_each.filter(|_| !options.scene.has_loads()) {
        for id in (0..model.bodies.len()).filter(|id| carries_no_mass(model, *id)) {
            let joint = &model.bodies[id].joint.name;
            let complaint = messages::no_mass_behind(function.name(), joint);
            place(complaint, joint, Some(("options.functions", options)), diagnostics);
        }
    }
}

/// Whether nothing that a joint moves has mass.
pub fn carries_no_mass(model: &Model<Dd>, joint: BodyId) -> bool {
    let carried = |body: BodyId| std::iter::successors(Some(body), |b| model.bodies[*b].parent).any(|b| b == joint);
    model.bodies.iter().enumerate().all(|(b, body)| body.inertia.mass == Dd::ZERO || !carried(b))
}

/// The same of a robot alone, of what is `asked` for in words ("a simulation is").
pub fn demand_inertia_for(asked: &str, model: &Model<Dd>, inertia: Inertia, diagnostics: &mut Diagnostics) {
    for id in singular_joints(model, inertia) {
        let joint = &model.bodies[id].joint.name;
        place(messages::no_forward_dynamics(asked, joint), joint, None, diagnostics);
    }
}

/// A complaint at the joint, where its file was complained of, or at what the scene asks for.
fn place(complaint: Diagnostic, joint: &str, asked: Option<(&str, &Options)>, diagnostics: &mut Diagnostics) {
    let named = format!("joint `{joint}`");
    let warning = diagnostics.iter().find(|d| d.code == "singular-joint" && d.title.starts_with(&named));
    match (warning.and_then(|d| d.place.clone()), asked) {
        (Some(place), _) => diagnostics.push(complaint.at(&place)),
        (None, Some((path, options))) => options.scene.places.complain(path, complaint, diagnostics),
        (None, None) => diagnostics.push(complaint),
    }
}

/// The robot with some inertia in place of every run-time parameter, as much as the robot has of its own.
fn with_parameters(model: &Model<Dd>, options: &Options) -> Model<Dd> {
    let mut full = model.clone();
    let total = model.bodies.iter().map(|b| b.inertia.mass.to_f64()).sum::<f64>();
    let mass = if total > 0.0 { total } else { 1.0 };
    let lengths = model.bodies.iter().map(|b| b.placement.translation.dot(b.placement.translation).to_f64().sqrt());
    let longest = lengths.fold(0.0, f64::max);
    let length = if longest > 0.0 { longest } else { 1.0 };
    for body in options.scene.parameters.iter().filter_map(|p| p.body(model)) {
        let com = Vec3::new(0.31, -0.17, 0.23).map(|x| Dd::from(x * length));
        let moment = |x: f64| Dd::from(x * mass * length * length);
        let inertia_com = Sym3 {
            xx: moment(0.2),
            yy: moment(0.3),
            zz: moment(0.25),
            xy: moment(0.02),
            xz: moment(-0.03),
            yz: moment(0.01),
        };
        let own = Part::of(&full.bodies[body].inertia);
        full.bodies[body].inertia = merge(&[own, Part { mass: Dd::from(mass), com, inertia_com }]);
    }
    full
}
