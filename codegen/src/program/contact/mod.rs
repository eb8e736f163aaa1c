//! The robot in contact: one module of functions per contact mode, and a mode enum.
//!
//! A mode lists the contacts that are closed together; which mode it is decides the caller, so that nothing in a function
//! branches. Everything about one mode is traced into one program per function, with the reduced robot where it serves: the
//! motion of a contact's frame shares the recursion of the bias force.

mod derivatives;
mod driven_derivatives;
mod equations;

use crate::equations::bind::{is_optional, BoundRobot};
use crate::equations::Robot;
use crate::function::{
    ContactExtent, ContactFunction, ContactPort, ForwardDynamicsMethod, Function, InModes, PerContact, Quantity,
};
use crate::identifier::module_name;
use crate::options::{FormChoices, Optimisations, Options};
use crate::program::choose::choose;
use crate::program::equivalence::{self, Disagreement, Plainer};
use crate::program::{simplified, OF_SYSTEM};
use crate::scene::contact::{ContactItem, EnvironmentKind, LoopItem, ModeItem, SurfaceItem};
use crate::scene::Scene;
use equations::{Added, EquationForm, FormsOfContacts};
use straightline_core::contact::Coordinate;
use straightline_core::model::Model;
use straightline_core::{Dd, Dual, Real};
use straightline_graph::certify::residual::OUTPUTS;
use straightline_graph::expr::{Graph, Port};
use straightline_graph::trace::{trace, Expr};
use straightline_graph::Scalar;

/// A contact mode of a scene, its contacts looked up.
#[derive(Clone, Debug)]
pub struct Mode<'a> {
    /// Its name in generated code.
    pub identifier: String,
    /// Its name in the scene.
    pub name: String,
    /// Its contacts, in order.
    pub contacts: Vec<ClosedContact<'a>>,
    /// The loops of the robot, which every mode has.
    pub loops: &'a [LoopItem],
}

/// A contact that is closed in a mode.
#[derive(Clone, Debug)]
pub struct ClosedContact<'a> {
    /// The contact.
    pub item: &'a ContactItem,
    /// What it constrains in this mode.
    pub constrained: Vec<Coordinate>,
    /// What it leaves.
    pub free: Vec<Coordinate>,
    /// Whether it slides with friction.
    pub slides: bool,
}

impl<'a> Mode<'a> {
    /// The modes of a scene.
    ///
    /// # Panics
    /// If a mode has a contact that the scene has not: scenes are checked before.
    pub fn all(scene: &'a Scene) -> Vec<Mode<'a>> {
        let contacts = &scene.contacts;
        let closed = |mode: &ModeItem, name: &String| {
            let item = contacts.contacts.iter().find(|c| c.name == *name).expect("the contacts of modes were checked");
            let sticks = mode.sticking.contains(name);
            let also = |c: &Coordinate| sticks && matches!(c, Coordinate::Px | Coordinate::Py);
            ClosedContact {
                item,
                constrained: Coordinate::ALL.into_iter().filter(|c| item.constrained.contains(c) || also(c)).collect(),
                free: item.free.iter().copied().filter(|c| !also(c)).collect(),
                slides: item.friction.is_some() && !sticks,
            }
        };
        let mode = |mode: ModeItem| Mode {
            identifier: module_name(&mode.name, "mode"),
            contacts: mode.contacts.iter().map(|name| closed(&mode, name)).collect(),
            name: mode.name,
            loops: &contacts.loops,
        };
        contacts.all_modes().into_iter().map(mode).collect()
    }

    /// The robot alone.
    pub fn alone() -> Mode<'static> {
        Mode { identifier: String::new(), name: String::new(), contacts: Vec::new(), loops: &[] }
    }

    /// Whether nothing is touched or held together.
    pub fn is_alone(&self) -> bool {
        self.contacts.is_empty() && self.loops.is_empty()
    }

    /// Constrained coordinates as `contact.pz`.
    pub fn constrained_names(&self) -> Vec<String> {
        let of_contacts =
            self.contacts.iter().flat_map(|c| c.constrained.iter().map(|k| format!("{}.{}", c.item.name, k.name())));
        let of_loops = self.loops.iter().flat_map(|l| l.constrained.iter().map(|k| format!("{}.{}", l.name, k.name())));
        of_contacts.chain(of_loops).collect()
    }

    /// An input or a block of results that a function has in this mode, of a contact.
    fn port(&self, port: &ContactPort, contact: &str, model: &Model<Dd>) -> Port {
        let length = |extent: &ContactExtent| match *extent {
            ContactExtent::Robot(extent) => extent.len(model, 0),
            ContactExtent::Constrained => self.constrained_names().len(),
            ContactExtent::Free => self.free_names().len(),
            ContactExtent::Masses => self.contacts.iter().filter(|c| c.has(PerContact::WithMass)).count(),
        };
        Port::new(&port.name_for(contact), &port.axes.iter().map(length).collect::<Vec<_>>())
    }

    /// Free coordinates likewise.
    pub fn free_names(&self) -> Vec<String> {
        self.contacts.iter().flat_map(|c| c.free.iter().map(|k| format!("{}.{}", c.item.name, k.name()))).collect()
    }
}

impl ClosedContact<'_> {
    /// Whether its object has what such inputs and results are about.
    fn has(&self, per: PerContact) -> bool {
        use EnvironmentKind::{BothSides, Cushioned, Mass, TwoMasses};
        let kind = self.item.environment.as_ref().map(|e| e.kind);
        match per {
            PerContact::No => true,
            PerContact::WithOwnCoordinate => matches!(kind, Some(Cushioned | TwoMasses | BothSides)),
            PerContact::WithMass => matches!(kind, Some(Mass | TwoMasses)),
        }
    }
}

/// One function of one mode, between tracing and text.
#[derive(Clone, Debug)]
pub struct ModeProgram {
    /// Which function.
    pub function: ContactFunction,
    /// Its operations.
    pub graph: Graph,
    /// Whether it has another form than it would have had.
    pub plainer: Option<Plainer>,
}

/// All functions of a mode that its scene wants.
///
/// # Errors
/// A function whose programs all differ from its plain equations.
pub fn programs(robot: &Robot, options: &Options, mode: &Mode) -> Result<Vec<ModeProgram>, Disagreement> {
    let wanted = options.scene.contacts.wanted();
    let has_free = !mode.free_names().is_empty();
    let is_driven = !robot.model.drives.is_empty();
    let wanted = wanted.into_iter().filter(|f| match f.spec().modes {
        InModes::WithFreeCoordinates => has_free,
        InModes::OfDrivenRobots => is_driven,
        InModes::All => true,
    });
    wanted.map(|function| checked(robot, options, mode, function)).collect()
}

/// The inputs that a function of a mode may have.
pub(crate) fn ports(robot: &Robot, options: &Options, mode: &Mode, function: ContactFunction) -> Vec<Port> {
    let own = options.scene.ports(function.spec().base, &robot.model, &[]);
    own.into_iter().chain(added_ports(function, mode, &robot.model)).collect()
}

/// A function of a mode in the form with the fewest operations that agrees with its plain equations.
fn checked(
    robot: &Robot,
    options: &Options,
    mode: &Mode,
    function: ContactFunction,
) -> Result<ModeProgram, Disagreement> {
    let plain = || optimised(robot, options, mode, function, options.optimisations().plain());
    let (graph, plainer) = options.optimisations().first_that_agrees(|optimisations| {
        let graph = optimised(robot, options, mode, function, optimisations);
        equivalence::of_contact(robot, options, mode, function, &graph, &plain).map(|()| graph)
    })?;
    Ok(ModeProgram { function, graph, plainer })
}

/// Over expressions every surface is there.
fn traced_form(function: ContactFunction, optimisations: Optimisations) -> FormsOfContacts<Expr> {
    let (reduced, falls) = (optimisations.reduced, None);
    let is_carried = function.spec().form == Function::ForwardDynamics;
    FormsOfContacts {
        own: EquationForm { reduced, is_carried, surface: SurfaceItem::traced, falls },
        moving: EquationForm { reduced, is_carried, surface: SurfaceItem::traced_moving, falls: None },
    }
}

/// The results of one function of a mode by the robot's own parameters, over any scalar, without a graph: `given` stands for the inputs of
/// [`graph`] by name. `None` where a surface has a scalar of its own. `prepare` may change the robot's numbers; what it returns is added to
/// accelerations and taken away again.
pub(crate) fn evaluate<T: Real>(
    robot: &Robot,
    options: &Options,
    mode: &Mode,
    function: ContactFunction,
    given: &dyn Fn(&Port) -> Vec<T>,
    prepare: &dyn Fn(&mut Model<T>) -> Option<T>,
) -> Option<Vec<T>> {
    let (bound, form, added) = plainly(robot, options, mode, function, given, prepare)?;
    Some(equations::equations(robot, options, mode, function, form, &bound, &added).concat())
}

/// What equations take by the robot's own parameters: the robot bound, their form, and what the
/// function takes beside; none where a surface is not to be had over this scalar.
fn plainly<T: Real>(
    robot: &Robot,
    options: &Options,
    mode: &Mode,
    function: ContactFunction,
    given: &dyn Fn(&Port) -> Vec<T>,
    prepare: &dyn Fn(&mut Model<T>) -> Option<T>,
) -> Option<(BoundRobot<T>, FormsOfContacts<T>, Added<T>)> {
    if mode.contacts.iter().any(|c| c.item.surface.over::<T>().is_none()) {
        return None;
    }
    let own = function.spec().base;
    let inputs: Vec<Vec<T>> = options.scene.ports(own, &robot.model, &[]).iter().map(given).collect();
    let mut bound = options.scene.bind(own, robot, &inputs);
    let falls = prepare(&mut bound.model);
    let added = added_ports(function, mode, &robot.model).into_iter().map(|p| (p.name.clone(), given(&p))).collect();
    let own = plain_form(falls);
    Some((bound, FormsOfContacts { own, moving: plain_form(falls.map(Dual::fixed)) }, added))
}

/// By the robot's own parameters, where surfaces are to be had over this scalar.
fn plain_form<T: Real>(falls: Option<T>) -> EquationForm<T> {
    let surface = |s: &SurfaceItem| s.over().expect("asked for before");
    EquationForm { reduced: false, is_carried: false, surface, falls }
}

/// The operations of one function of a mode.
pub fn graph(robot: &Robot, options: &Options, mode: &Mode, function: ContactFunction) -> Graph {
    optimised(robot, options, mode, function, options.optimisations())
}

/// The same, with these optimisations only.
pub(crate) fn optimised(
    robot: &Robot,
    options: &Options,
    mode: &Mode,
    function: ContactFunction,
    optimisations: Optimisations,
) -> Graph {
    let chosen = chosen(robot, options, function.spec().form, optimisations);
    let robot = chosen.as_ref().unwrap_or(robot);
    let base = function.spec().base;
    let own = options.scene.ports(base, &robot.model, &[]);
    let added = added_ports(function, mode, &robot.model);
    let names: Vec<String> = added.iter().map(|p| p.name.clone()).collect();
    let inputs: Vec<Port> = own.iter().cloned().chain(added).collect();
    let outputs = outputs(function, mode, &robot.model);
    let lengths: Vec<usize> = outputs.iter().map(Port::len).collect();
    let traced = trace(options.rules_of(optimisations), inputs, outputs, |inputs| {
        let (given, added) = inputs.split_at(own.len());
        let given = options.scene.bind(base, robot, given);
        let added = names.iter().cloned().zip(added.iter().cloned()).collect();
        let results =
            equations::equations(robot, options, mode, function, traced_form(function, optimisations), &given, &added);
        assert!(results.iter().map(Vec::len).eq(lengths.iter().copied()), "results fit the outputs");
        results.concat()
    });
    let unused = |port: &Port| {
        use Quantity::{DriveInput, DriveState, Velocity};
        let may_rest = matches!(Quantity::of(port), Some(Velocity | DriveState | DriveInput));
        is_optional(port) || may_rest || names.contains(&port.name)
    };
    let passes = ["contact: traced", "contact: dead code", "contact: unread inputs", "contact: sums"];
    simplified((function.name(), passes), traced, unused, optimisations)
}

/// The robot in the form that takes a function the fewest operations, of those in which contacts can be described.
fn chosen(robot: &Robot, options: &Options, function: Function, optimisations: Optimisations) -> Option<Robot> {
    let factorised = Options { forward_dynamics: ForwardDynamicsMethod::Factorisation, ..options.clone() };
    (optimisations.chosen && optimisations.reduced).then(|| {
        let forms = match function {
            // contact frames are described in the frames that any robot takes
            Function::ForwardDynamics => FormChoices { origins: false, tips: false, ..optimisations.forms },
            _ => optimisations.forms,
        };
        let optimisations = Optimisations { chosen: false, forms, ..optimisations };
        choose(robot, &[], function, &factorised, optimisations)
    })
}

/// What is left of the equations of a mode at a given `qdd` and, if it has contacts, `force`: what
/// [`acceleration_bound`](straightline_graph::certify::residual::acceleration_bound) takes, with the flags of rows that yield. The other inputs are those of
/// forward dynamics. A mode without contacts is the robot alone.
pub fn system(robot: &Robot, options: &Options, mode: &Mode, optimisations: Optimisations) -> (Graph, Vec<bool>) {
    let chosen = chosen(robot, options, Function::ForwardDynamics, optimisations);
    let robot = chosen.as_ref().unwrap_or(robot);
    let (nv, m) = (robot.model.nv(), mode.constrained_names().len());
    let own = options.scene.ports(Function::ForwardDynamics, &robot.model, &[]);
    let added = added_ports(ContactFunction::ForwardDynamics, mode, &robot.model);
    let names: Vec<String> = added.iter().map(|p| p.name.clone()).collect();
    let solution = solution_ports(&robot.model, mode).into_iter().filter(|p| !p.is_empty());
    let inputs: Vec<Port> = own.iter().cloned().chain(added).chain(solution).collect();
    let shapes = [vec![nv], vec![m], vec![nv, nv], vec![m, nv], vec![m, nv], vec![m]];
    let outputs: Vec<Port> = OUTPUTS.iter().zip(&shapes).map(|(name, shape)| Port::new(name, shape)).collect();
    let mut yielding = Vec::new();
    let traced = trace(options.rules_of(optimisations), inputs, outputs, |inputs| {
        let (given, rest) = inputs.split_at(own.len());
        let (added, solution) = rest.split_at(names.len());
        let given = options.scene.bind(Function::ForwardDynamics, robot, given);
        let added = names.iter().cloned().zip(added.iter().cloned()).collect();
        let force = solution.get(1).map_or(&[][..], |f| &f[..]);
        let form = traced_form(ContactFunction::ForwardDynamics, optimisations).own;
        equations::system(robot, options, mode, &given, form, &added, (&solution[0], force)).concat()
    });
    for closed in &mode.contacts {
        let gives_way = closed.item.environment.is_some();
        yielding.extend(closed.constrained.iter().map(|c| gives_way && *c == Coordinate::Pz));
    }
    yielding.resize(m, false);
    let is_velocity = |port: &Port| Quantity::of(port) == Some(Quantity::Velocity);
    let unused = |port: &Port| is_optional(port) || is_velocity(port) || names.contains(&port.name);
    (simplified(("the equations of motion", OF_SYSTEM), traced, unused, optimisations), yielding)
}

/// A system with its flags of rows that yield.
pub(crate) type YieldingSystem = (Graph, Vec<bool>);

/// [`system`] in the form with the fewest operations that agrees with its plain equations.
///
/// # Errors
/// What was wrong, if none does.
pub(crate) fn checked_system(
    robot: &Robot,
    options: &Options,
    mode: &Mode,
) -> Result<(YieldingSystem, Option<Plainer>), Disagreement> {
    let plain = || system(robot, options, mode, options.optimisations().plain()).0;
    options.optimisations().first_that_agrees(|optimisations| {
        let made = system(robot, options, mode, optimisations);
        equivalence::of_system(robot, options, mode, &made.0, &plain).map(|()| made)
    })
}

/// The results of a [`system`] by the robot's own parameters, as [`evaluate`] has those of functions.
pub(crate) fn evaluate_system<T: Real>(
    robot: &Robot,
    options: &Options,
    mode: &Mode,
    given: &dyn Fn(&Port) -> Vec<T>,
    prepare: &dyn Fn(&mut Model<T>) -> Option<T>,
) -> Option<Vec<T>> {
    let function = ContactFunction::ForwardDynamics;
    let (bound, form, added) = plainly(robot, options, mode, function, given, prepare)?;
    let [qdd, force] = solution_ports(&robot.model, mode).map(|p| if p.is_empty() { Vec::new() } else { given(&p) });
    Some(equations::system(robot, options, mode, &bound, form.own, &added, (&qdd, &force)).concat())
}

/// What a system judges: accelerations and reactions.
fn solution_ports(model: &Model<Dd>, mode: &Mode) -> [Port; 2] {
    [Quantity::Acceleration.port(model, 0), Port::new("force", &[mode.constrained_names().len()])]
}

/// All inputs that a system may have.
pub(crate) fn system_ports(robot: &Robot, options: &Options, mode: &Mode) -> Vec<Port> {
    let own = ports(robot, options, mode, ContactFunction::ForwardDynamics);
    own.into_iter().chain(solution_ports(&robot.model, mode).into_iter().filter(|p| !p.is_empty())).collect()
}

/// What it takes beside.
fn added_ports(function: ContactFunction, mode: &Mode, model: &Model<Dd>) -> Vec<Port> {
    let mut ports = Vec::new();
    for closed in &mode.contacts {
        let (item, name) = (closed.item, closed.item.identifier());
        if item.axis.is_none() {
            ports.push(Port::new(&format!("{name}_axes"), &[2, 3]));
        }
        if item.object.is_none() {
            ports.push(Port::new(&format!("{name}_pose"), &[4, 3]));
            ports.push(Port::new(&format!("{name}_velocity"), &[2, 3]));
            ports.push(Port::new(&format!("{name}_acceleration"), &[2, 3]));
        }
        if let Some(environment) = item.environment.as_ref().filter(|e| e.values.is_none()) {
            ports.push(Port::new(&format!("{name}_environment"), &[environment.kind.keys().len()]));
        }
        let own = function.spec().inputs.iter().filter(|port| port.per != PerContact::No && closed.has(port.per));
        ports.extend(own.map(|port| mode.port(port, &name, model)));
    }
    let once = function.spec().inputs.iter().filter(|port| port.per == PerContact::No);
    ports.extend(once.map(|port| mode.port(port, "", model)));
    debug_assert!(model.nv() > 0);
    ports.retain(|p| !p.is_empty());
    ports
}

/// What it puts out.
fn outputs(function: ContactFunction, mode: &Mode, model: &Model<Dd>) -> Vec<Port> {
    let of = |port: &ContactPort| match port.per {
        PerContact::No => vec![mode.port(port, "", model)],
        per => {
            let contacts = mode.contacts.iter().filter(|c| c.has(per));
            contacts.map(|c| mode.port(port, &c.item.identifier(), model)).collect()
        }
    };
    function.spec().outputs.iter().flat_map(of).collect()
}

/// ε of the regularisation: what numbers of this format can bear.
pub fn ridge(scalar: Scalar) -> f64 {
    scalar.ridge()
}
