//! A scene where it meets the equations: which inputs are left, what stands for the others, which results are wanted.

use crate::equations::Robot;
use crate::function::{Extent, Forms, ForwardDynamicsMethod, Function, Output, Parts, Quantity, SelectedRows};
use crate::scene::free_drive::FreeDrive;
use crate::scene::{Gravity, Parameter, ResultPart, Scene, Selection};
use straightline_core::model::{Frame, Joint, Load, Model};
use straightline_core::reduced::ReducedModel;
use straightline_core::spatial::{SpatialInertia, Sym3, Vec3};
use straightline_core::{Dd, Real};
use straightline_graph::expr::Port;

/// The bodies, as a function of them sees them.
pub struct BoundRobot<T> {
    /// The robot.
    pub model: Model<T>,
    /// Its reduced form.
    pub reduced: ReducedModel<T>,
    /// Its reduced form for the mass matrix.
    pub composite: ReducedModel<T>,
    /// The function's arguments, whole.
    pub arguments: Vec<Vec<T>>,
}

impl<T: Real> BoundRobot<T> {
    /// The forms that functions are evaluated on; by the reduced robots, if it is to be and they serve this one.
    pub(crate) fn forms<'a>(
        &'a self,
        reduced: bool,
        frames: &'a [&'a Frame<T>],
        rows: SelectedRows,
        method: ForwardDynamicsMethod,
    ) -> Forms<'a, T> {
        let serves = reduced && self.reduced.serves(&self.model);
        Forms {
            reduced: serves.then_some([&self.reduced, &self.composite]),
            rows,
            ..Forms::plain(&self.model, frames, method)
        }
    }
}

impl Scene {
    /// The input ports of a function: its own without those that are zero, then gravity and parameters where they are
    /// inputs. Those of the latter that the function turns out not to need are dropped after tracing. `frames` are those of the whole program.
    pub fn ports(&self, function: Function, model: &Model<Dd>, frames: &[String]) -> Vec<Port> {
        let own = function.quantities(model).into_iter().filter(|quantity| !self.is_zero(*quantity));
        let gravity = (self.gravity == Gravity::Input).then_some(Quantity::Gravity);
        let parameters =
            self.parameters.iter().map(|p| Port::wrapped(&p.input_name(), &[p.scalars(model)], &p.type_name()));
        let frames = self.frames_of(function, frames).len();
        own.chain(gravity).map(|quantity| quantity.port(model, frames)).chain(parameters).collect()
    }

    fn is_zero(&self, input: Quantity) -> bool {
        input.rate().is_some_and(|order| if order == 1 { self.zero.qd } else { self.zero.qdd })
    }

    /// What a trace or an evaluation starts from, given what stands for [`Scene::ports`].
    pub fn bind<T: Real>(&self, function: Function, robot: &Robot, inputs: &[Vec<T>]) -> BoundRobot<T> {
        let mut model: Model<T> = robot.model.cast();
        let mut reduced = robot.reduced.map(T::constant);
        let mut composite = robot.composite.map(T::constant);
        let mut given = inputs.iter();
        let whole = function.quantities(&robot.model);
        let arguments = whole.iter().map(|quantity| {
            let mut values = match self.is_zero(*quantity) {
                true => vec![T::zero(); quantity.len(&robot.model, 0)],
                false => given.next().expect("a port per input").clone(),
            };
            if quantity.rate().is_some() {
                for joint in robot.model.independent_joints() {
                    if self.zero.joints_at_rest.contains(&joint.name) {
                        values[joint.iv..joint.iv + joint.kind.nv()].fill(T::zero());
                    }
                }
            }
            values
        });
        let arguments: Vec<Vec<T>> = arguments.collect();
        if self.gravity == Gravity::Input {
            let g = given.next().expect("a port for gravity");
            model.gravity = Vec3::new(g[0], g[1], g[2]);
            reduced.gravity = model.gravity;
        }
        for parameter in &self.parameters {
            let values = given.next().expect("a port per parameter");
            if let Some(drive) = FreeDrive::new(parameter, &robot.model) {
                drive.put(&mut model, values);
            }
            let Some(body) = parameter.body(&robot.model) else { continue };
            let (canonical, in_reduced) = (load(&values[..10]), load(&values[10..]));
            model.bodies[body].carry(canonical);
            for r in [&mut reduced.bodies[body], &mut composite.bodies[body]] {
                r.mass = r.mass + in_reduced.mass;
                r.first_moment = r.first_moment + in_reduced.first_moment;
                r.second_moment = r.second_moment + in_reduced.second_moment;
            }
        }
        BoundRobot { model, reduced, composite, arguments }
    }

    /// The wanted results of a function, as indices into the whole of its outputs, and the blocks that they form.
    pub fn select(&self, function: Function, model: &Model<Dd>, frames: usize) -> (Vec<usize>, Vec<Port>) {
        let blocks = function.outputs(model, frames);
        if function.spec().family.is_of_drives() {
            return ((0..blocks.iter().map(Port::len).sum()).collect(), blocks);
        }
        let selection = self.outputs.get(&function).cloned().unwrap_or_default();
        let (mut indices, mut ports, mut first) = (Vec::new(), Vec::new(), 0);
        for (output, block) in function.spec().outputs.iter().zip(&blocks) {
            if !selection.has(output.name) {
                first += block.len();
                continue;
            }
            let (wanted, shape) = self.select_block(output, &selection, model, &block.shape);
            indices.extend(wanted.into_iter().map(|k| first + k));
            ports.push(Port::new(output.name, &shape));
            first += block.len();
        }
        (indices, ports)
    }

    /// Of a block of that shape what a selection wants, axis by axis, in the order of matrices that is asked for.
    fn select_block(
        &self,
        output: &Output,
        selection: &Selection,
        model: &Model<Dd>,
        shape: &[usize],
    ) -> (Vec<usize>, Vec<usize>) {
        let last = shape.len() - 1;
        if selection.part == ResultPart::Diagonal && output.parts == Parts::Diagonal {
            let coordinates = selection.coordinates(model);
            return (coordinates.iter().map(|i| i * shape[last] + i).collect(), vec![coordinates.len()]);
        }
        // the index of every axis, and how far apart its entries stand
        let mut axes: Vec<(Vec<usize>, usize)> = Vec::new();
        for (k, extent) in output.axes.iter().enumerate() {
            let wanted = match extent {
                // of H the columns, of a regressor the rows
                Extent::Velocities if !output.axes[k + 1..].contains(&Extent::Velocities) => {
                    selection.coordinates(model)
                }
                Extent::Positions if k == last => selection.positions(model),
                Extent::State if k == last => selection.state(model),
                Extent::Joints => selection.joints(model),
                Extent::Of(n) if output.parts == Parts::LinearAngular => selection.part.of(0..*n, 3),
                _ => (0..shape[k]).collect(),
            };
            axes.push((wanted, shape[k + 1..].iter().product()));
        }
        if self.by_columns && output.is_by_columns() {
            axes.swap(last - 1, last);
        }
        let mut indices = vec![0];
        for (wanted, stride) in &axes {
            indices = indices.iter().flat_map(|at| wanted.iter().map(move |k| at + k * stride)).collect();
        }
        (indices, axes.iter().map(|(wanted, _)| wanted.len()).collect())
    }

    /// The rows of a function's tasks.
    pub fn rows_of(&self, function: Function) -> SelectedRows {
        match self.outputs.get(&function).map(|selection| selection.part) {
            Some(ResultPart::Linear) => SelectedRows::LINEAR,
            Some(ResultPart::Angular) => SelectedRows::ANGULAR,
            Some(ResultPart::Rows(rows)) => rows,
            Some(ResultPart::Whole | ResultPart::Diagonal) | None => SelectedRows::ALL,
        }
    }

    /// The frames of a function: its own, or those of the whole program.
    pub fn frames_of<'a>(&'a self, function: Function, all: &'a [String]) -> &'a [String] {
        match self.outputs.get(&function) {
            Some(selection) if !selection.frames.is_empty() => &selection.frames,
            _ => all,
        }
    }
}

impl Selection {
    /// The wanted joints, in the order of their coordinates.
    fn joints(&self, model: &Model<Dd>) -> Vec<usize> {
        let joints = model.tree_joints();
        let is_wanted = |i: &usize| self.joints.is_empty() || self.joints.contains(&joints[*i].name);
        (0..joints.len()).filter(is_wanted).collect()
    }

    /// Velocity coordinates of the wanted joints, in the order in which they are named, or all.
    fn coordinates(&self, model: &Model<Dd>) -> Vec<usize> {
        if self.joints.is_empty() {
            return (0..model.nv()).collect();
        }
        self.named(model).flat_map(|j| j.iv..j.iv + j.kind.nv()).collect()
    }

    /// The same of position coordinates.
    fn positions(&self, model: &Model<Dd>) -> Vec<usize> {
        if self.joints.is_empty() {
            return (0..model.nq()).collect();
        }
        self.named(model).flat_map(|j| j.iq..j.iq + j.kind.nq()).collect()
    }

    /// Of the state by its tangent: increments of q of the wanted joints, then their velocities.
    fn state(&self, model: &Model<Dd>) -> Vec<usize> {
        let own = self.coordinates(model);
        own.iter().copied().chain(own.iter().map(|k| model.nv() + k)).collect()
    }

    /// The joints in the order in which they are named.
    fn named<'a>(&'a self, model: &'a Model<Dd>) -> impl Iterator<Item = &'a Joint> {
        let joint = |name: &String| model.independent_joints().find(|j| j.name == *name);
        self.joints.iter().filter_map(joint)
    }
}

impl ResultPart {
    /// The wanted indices of a quantity whose first `linear` entries are linear.
    fn of(self, all: std::ops::Range<usize>, linear: usize) -> Vec<usize> {
        match self {
            ResultPart::Whole | ResultPart::Diagonal => all.collect(),
            ResultPart::Linear => (all.start..linear).collect(),
            ResultPart::Angular => (linear..all.end).collect(),
            ResultPart::Rows(rows) => rows.places().collect(),
        }
    }
}

fn load<T: Copy>(x: &[T]) -> Load<T> {
    Load {
        mass: x[0],
        first_moment: Vec3::new(x[1], x[2], x[3]),
        second_moment: Sym3 { xx: x[4], xy: x[5], xz: x[6], yy: x[7], yz: x[8], zz: x[9] },
    }
}

/// What functions take of a parameter, from what its constructor takes ([`Parameter::given`]): the program of the constructor. Of a body:
/// mass \[kg\], com\[3\] \[m\], inertia about it (xx, xy, xz, yy, yz, zz) \[kg·m²\]; of a drive: its free numbers.
///
/// # Panics
/// If nothing of the robot depends on the parameter, which is refused before.
pub fn constructed<T: Real>(robot: &Robot, parameter: &Parameter, inputs: &[Vec<T>]) -> Vec<T> {
    match FreeDrive::new(parameter, &robot.model) {
        Some(drive) => drive.values(&inputs[0]),
        None => load_parameters(robot, parameter, inputs),
    }
}

/// The ten parameters of a body given by mass, centre of mass and inertia in a frame, in the two frames that the algorithms
/// use. Inputs: mass, com\[3\], inertia about it (xx, xy, xz, yy, yz, zz).
fn load_parameters<T: Real>(robot: &Robot, parameter: &Parameter, inputs: &[Vec<T>]) -> Vec<T> {
    let frame = parameter.frame().and_then(|frame| robot.model.frame(frame));
    let frame = frame.expect("frames were checked against the model");
    let body = frame.body.expect("parameters of the world were refused");
    let regauge = robot.reduced_frames[body].inverse();
    let (mass, com, inertia) = (inputs[0][0], &inputs[1], &inputs[2]);
    let tensor =
        Sym3 { xx: inertia[0], xy: inertia[1], xz: inertia[2], yy: inertia[3], yz: inertia[4], zz: inertia[5] };
    let in_canonical = frame.placement;
    let in_reduced = regauge.compose(&in_canonical);
    [in_canonical, in_reduced]
        .into_iter()
        .flat_map(|pose| {
            let pose = pose.map(T::constant);
            let c = pose.translation + pose.rotation * Vec3::new(com[0], com[1], com[2]);
            let i = SpatialInertia::new(mass, c, tensor.rotated(&pose.rotation));
            let (f, s) = (i.first_moment, i.second_moment);
            [i.mass, f.x, f.y, f.z, s.xx, s.xy, s.xz, s.yy, s.yz, s.zz]
        })
        .collect()
}

/// Whether an input port goes when a function does not read it: gravity and parameters do, coordinates stay.
pub fn is_optional(port: &Port) -> bool {
    Quantity::of(port) == Some(Quantity::Gravity) || port.wrapper.is_some()
}
