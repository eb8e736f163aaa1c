//! From a [`Description`] to a [`Model`]: the tree checked, fixed joints merged, everything in canonical joint frames.
//!
//! All numbers are computed in double-double from the nearest f64 of what is written, so that a constant of the generated
//! code is rounded once. Entries of rotations that are 0 or ±1 are exactly that.
//!
//! ```
//! use straightline_codegen::diagnostic::Source;
//! use straightline_codegen::model::{load, ModelOptions};
//! let pendulum = r#"
//!     [robot]
//!     name = "pendulum"
//!     [[link]]
//!     name = "world"
//!     [[link]]
//!     name = "bob"
//!     mass = 1.5
//!     com = [0.0, 0.0, -0.4]
//!     inertia = [0.02, 0.02, 0.001]
//!     [[joint]]
//!     name = "pivot"
//!     kind = "continuous"
//!     parent = "world"
//!     child = "bob"
//!     axis = "y"
//! "#;
//! let (model, diagnostics) = load(&Source::new("pendulum.toml", pendulum), &ModelOptions::default());
//! assert!(diagnostics.is_empty(), "{diagnostics}");
//! assert_eq!(model.unwrap().bodies[0].joint.name, "pivot");
//! ```

mod bodies;
mod centres_of_mass;
mod check;
mod couplings;
pub(crate) mod drives;
mod dyads;
mod flexible;
pub mod limbs;
mod loops;
mod oscillations;
pub mod singular;
pub mod states;

use self::flexible::Carrier;
use crate::description::flexible::{BaseSupport, Flexible};
use crate::description::{self, messages, Angle, Description, Noted, Rotation, WrittenCoupling, WrittenPose};
pub(crate) use crate::description::{angle, geometry, merge};
use crate::diagnostic::{Diagnostics, Place, Source};
use angle::transform;
use geometry::{compose, vector};
pub(crate) use loops::pose_of_file;
use std::collections::{BTreeMap, HashMap};
use straightline_core::closure::Closure;
use straightline_core::coupling::Coupling;
use straightline_core::model::{Body, BodyId, Frame, Joint, Model};
use straightline_core::spatial::Transform;
use straightline_core::Dd;

/// Links of a robot that is compiled.
const MOST_LINKS: usize = 10_000;

/// What is asked for beyond what the file says.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelOptions {
    /// The root link moves freely in the world; also if the file states it.
    pub floating_base: bool,
    /// Names of all joints that move, in the order in which they stand in q, qd and tau; `None`: depth first, in the
    /// order of the file. The joint of a floating base may be left out and then comes first.
    pub joint_order: Option<Vec<String>>,
    /// So near to a multiple of π/4 or π/6 \[rad\] an angle is taken as that. The default, 1e-15, covers rounding only;
    /// 0 takes every angle in radians literally.
    pub angle_tolerance: f64,
    /// Acceleration due to gravity in the world \[m/s²\]; `None`: the file's, or else (0, 0, −9.81).
    pub gravity: Option<[f64; 3]>,
    /// Further frames.
    pub frames: Vec<FrameOption>,
    /// Links that bend, in place of what the file says of them.
    pub flexible: Vec<Flexible>,
    /// Springs and dampers below the root link.
    pub support: Option<BaseSupport>,
    /// All links and the support are rigid, whatever file and options say.
    pub rigid_links: bool,
    /// Joints that follow others, beside those of the file.
    pub couplings: Vec<WrittenCoupling>,
    /// Every joint has a coordinate of its own, whatever file and options say.
    pub uncoupled: bool,
    /// The robot is the tree that is left where its loops are cut.
    pub open_loops: bool,
}

impl Default for ModelOptions {
    fn default() -> Self {
        ModelOptions {
            floating_base: false,
            joint_order: None,
            angle_tolerance: angle::ROUNDING,
            gravity: None,
            frames: Vec::new(),
            flexible: Vec::new(),
            support: None,
            rigid_links: false,
            couplings: Vec::new(),
            uncoupled: false,
            open_loops: false,
        }
    }
}

/// A frame that is asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameOption {
    /// What functions of frames call it.
    pub name: String,
    /// The link that carries it.
    pub link: String,
    /// Its position in the link frame \[m\].
    pub xyz: [f64; 3],
    /// Its roll, pitch and yaw \[rad\].
    pub rpy: [f64; 3],
}

/// An angle that is taken as a multiple of π/4 or π/6 and is not written exactly so.
#[derive(Clone, Debug, PartialEq)]
pub struct SpecialAngle {
    /// Where it stands.
    pub place: Place,
    /// Whose angle it is, such as ``roll of the origin of joint `elbow` ``.
    pub what: String,
    /// How it is written.
    pub text: String,
    /// As what it is taken, such as `π/2`.
    pub taken_as: String,
    /// What is written less what it is taken as \[rad\].
    pub deviation: f64,
}

/// An angle that is nearly a multiple of π/2 and is taken as it is written.
#[derive(Clone, Debug, PartialEq)]
pub struct DoubtfulAngle {
    /// Where it stands.
    pub place: Place,
    /// Whose angle it is, such as ``roll of the origin of joint `elbow` ``.
    pub what: String,
    /// How it is written.
    pub text: String,
    /// What it is near, such as `π/2`.
    pub near: String,
    /// What is written less what it is near \[rad\].
    pub deviation: f64,
}

/// Reads a robot file and builds its model: [`description::read`], then [`build`].
pub fn load(source: &Source, options: &ModelOptions) -> (Option<Model<Dd>>, Diagnostics) {
    let mut diagnostics = Diagnostics::new();
    let description = description::read(source, &mut diagnostics);
    let model = description.and_then(|description| build(&description, options, &mut diagnostics));
    finish(&mut diagnostics);
    (model, diagnostics)
}

/// Orders the complaints and says how many were dropped.
pub fn finish(diagnostics: &mut Diagnostics) {
    diagnostics.sort();
    let dropped: Vec<_> = diagnostics.dropped().filter(|d| d.0 != "more-complaints").collect();
    for (code, more) in dropped {
        diagnostics.push(messages::more_complaints(code, more));
    }
}

/// Checks a description and builds the model. Complaints go to `diagnostics`; `None` if it holds an error, be it from here
/// or from reading.
pub fn build(description: &Description, options: &ModelOptions, diagnostics: &mut Diagnostics) -> Option<Model<Dd>> {
    check_options(options, diagnostics);
    let tolerance = if options.angle_tolerance >= 0.0 { options.angle_tolerance } else { angle::ROUNDING };
    check::angles(description, &ModelOptions { angle_tolerance: tolerance, ..options.clone() }, diagnostics);
    let mut assembly = bodies::assemble(description, options, tolerance, diagnostics)?;
    if !names_are_free(&assembly, diagnostics) {
        return None;
    }
    check::motion(&assembly, description, diagnostics);
    add_frames(&mut assembly, options, tolerance, diagnostics);
    let couplings = couplings::resolve(description, options, &assembly.bodies, diagnostics);
    order_joints(&mut assembly.bodies, &couplings, &[], options, diagnostics);
    if let Some(gravity) = description.gravity.as_ref().filter(|g| options.gravity.is_none() && !is_gravity(&g.value)) {
        let value = format!("{:?}", gravity.value);
        diagnostics.push(messages::gravity_out_of_range(&value, GRAVITY).at(&gravity.place));
    }
    let gravity = options.gravity.or(description.gravity.as_ref().map(|g| g.value)).unwrap_or([0.0, 0.0, -9.81]);
    let mut bodies = std::mem::take(&mut assembly.bodies);
    oscillations::resolve(description, (options, tolerance), &mut bodies, diagnostics);
    let mut model = Model {
        name: description.name.value.clone(),
        bodies,
        gravity: vector(gravity),
        couplings,
        closure: Closure::default(),
        frames: std::mem::take(&mut assembly.frames),
        drives: Vec::new(),
        base_parameters: Default::default(),
    };
    if !diagnostics.has_errors() {
        close(&mut model, description, options, &assembly, diagnostics);
    }
    if !diagnostics.has_errors() {
        check::singular(&model, &assembly.joint_places, diagnostics);
    }
    drives::add(&description.drives, &mut model, diagnostics);
    (!diagnostics.has_errors()).then_some(model)
}

/// The pose of the child's link frame in the parent's where the joint's coordinate is zero; `None` after a complaint.
pub(crate) fn pose_at_zero(
    joint: &description::WrittenJoint,
    tolerance: f64,
    diagnostics: &mut Diagnostics,
) -> Option<Transform<Dd>> {
    let seat = bodies::Seat::of(joint, tolerance, diagnostics)?;
    Some(compose(&compose(&seat.in_parent, &seat.canonical), &seat.link_frame))
}

/// Whether no joint of what gives way has the name of another one.
fn names_are_free(assembly: &Assembly, diagnostics: &mut Diagnostics) -> bool {
    let mut seen: HashMap<&str, &Place> = HashMap::new();
    let mut is_free = true;
    for (body, place) in assembly.bodies.iter().zip(&assembly.joint_places) {
        if let Some(first) = seen.insert(&body.joint.name, place) {
            let complaint = messages::duplicate_name("joint", &body.joint.name).at(place);
            diagnostics.push(complaint.related(first, "the other one"));
            is_free = false;
        }
    }
    is_free
}

/// The angles of a description that are taken as multiples of π/4 or π/6 and are not written exactly so.
pub fn special_angles(description: &Description, options: &ModelOptions) -> Vec<SpecialAngle> {
    let special = |(what, angle): (String, &Angle)| {
        let reading = angle::read(angle, options.angle_tolerance);
        reading.special.filter(|_| reading.deviation != 0.0).map(|m| SpecialAngle {
            place: angle.place.clone(),
            what,
            text: angle.text.clone(),
            taken_as: angle::name_of_twelfths(m),
            deviation: reading.deviation,
        })
    };
    description.angles().into_iter().filter_map(special).collect()
}

/// The angles of a description that are near a multiple of π/2 and are taken as they are written.
pub fn doubtful_angles(description: &Description, options: &ModelOptions) -> Vec<DoubtfulAngle> {
    let doubtful = |(what, angle): (String, &Angle)| {
        let reading = angle::read(angle, options.angle_tolerance);
        reading.is_doubtful().then(|| DoubtfulAngle {
            place: angle.place.clone(),
            what,
            text: angle.text.clone(),
            near: angle::name_of_twelfths(6 * reading.right_angles),
            deviation: reading.deviation,
        })
    };
    description.angles().into_iter().filter_map(doubtful).collect()
}

/// The tolerance \[rad\] by which all of these are taken as exact: a power of ten.
pub fn tolerance_that_mends(angles: &[DoubtfulAngle]) -> f64 {
    let farthest = angles.iter().map(|a| a.deviation.abs()).fold(0.0, f64::max);
    messages::tolerance_above(farthest)
}

/// What an angle of a file is taken as \[rad\].
pub fn angle_in_radians(angle: &Angle, tolerance: f64) -> Dd {
    angle::in_radians(angle, tolerance)
}

/// Bodies and frames before joints are ordered.
struct Assembly {
    bodies: Vec<Body<Dd>>,
    /// For each body, where its joint is written.
    joint_places: Vec<Place>,
    frames: Vec<Frame<Dd>>,
    /// What carries every link.
    links: BTreeMap<String, Carrier>,
}

/// What [`is_gravity`] takes, in words.
pub(crate) const GRAVITY: &str = "zero or an acceleration from 1e-30 to 1e6 m/s²";

/// Whether gravity is a number that forces can be made of: what is less is zero to every robot, and leaves the range of double-double.
pub(crate) fn is_gravity(vector: &[f64; 3]) -> bool {
    let greatest = vector.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    vector.iter().all(|x| x.is_finite()) && (greatest == 0.0 || (1e-30..=1e6).contains(&greatest))
}

fn check_options(options: &ModelOptions, diagnostics: &mut Diagnostics) {
    let tolerance = options.angle_tolerance;
    if !(0.0..=0.1).contains(&tolerance) {
        diagnostics.push(messages::bad_option("angle tolerance", &format!("{tolerance:?}"), "between 0 and 0.1 rad"));
    }
    let is_fit = |v: &[f64; 3]| v.iter().all(|x| x.abs() <= 1e6);
    if let Some(gravity) = options.gravity.filter(|g| !is_gravity(g)) {
        diagnostics.push(messages::bad_option("gravity", &format!("{gravity:?}"), GRAVITY));
    }
    for frame in &options.frames {
        if !is_fit(&frame.xyz) || !is_fit(&frame.rpy) {
            let value = format!("{:?} {:?}", frame.xyz, frame.rpy);
            diagnostics.push(messages::bad_option(
                &format!("frame {}", frame.name),
                &value,
                "a position and three angles",
            ));
        }
    }
}

/// Adds the frames that are asked for.
fn add_frames(assembly: &mut Assembly, options: &ModelOptions, tolerance: f64, diagnostics: &mut Diagnostics) {
    for option in &options.frames {
        if assembly.frames.iter().any(|f| f.name == option.name) {
            diagnostics.push(messages::duplicate_name("frame", &option.name));
            continue;
        }
        let Some(carrier) = assembly.links.get(&option.link) else {
            let owner = format!("frame `{}`", option.name);
            diagnostics.push(messages::unknown_link(&owner, &option.link, assembly.links.keys().map(String::as_str)));
            continue;
        };
        let zero = Angle::zero(Place::none());
        let rpy = option.rpy.map(|value| Angle { value, ..zero.clone() });
        let pose = WrittenPose { xyz: Noted::assumed(option.xyz), rotation: Rotation::RollPitchYaw(rpy) };
        let (body, x_body_link) = carrier.at(vector(option.xyz));
        let placement = compose(&x_body_link, &transform(&pose, tolerance));
        assembly.frames.push(Frame { name: option.name.clone(), body, placement });
    }
}

/// Closes the loops of a tree: the joints that they determine stand behind the independent ones from here on.
fn close(
    model: &mut Model<Dd>,
    description: &Description,
    options: &ModelOptions,
    assembly: &Assembly,
    diagnostics: &mut Diagnostics,
) {
    let closure = loops::resolve(description, options, assembly, model, diagnostics);
    if closure.is_empty() {
        return;
    }
    let dependents: Vec<BodyId> = closure.dependents().collect();
    let mut home = vec![Dd::ZERO; closure.home.len()];
    let before: Vec<Joint> = model.bodies.iter().map(|body| body.joint.clone()).collect();
    order_joints(&mut model.bodies, &model.couplings, &dependents, options, diagnostics);
    for (body, before) in model.free_bodies().zip(model.free_bodies().map(|b| &before[b])) {
        let after = model.bodies[body].joint.iq;
        home[after..after + before.kind.nq()].copy_from_slice(before.coordinates(&closure.home));
    }
    model.closure = Closure { home, ..closure };
    check::loops_move(model, description, diagnostics);
    dyads::keep_assemblies(model, description, diagnostics);
}

/// Gives every joint its place in the coordinate vectors: those that loops determine behind the independent ones, and then those that follow others.
fn order_joints(
    bodies: &mut [Body<Dd>],
    couplings: &[Coupling<Dd>],
    dependents: &[BodyId],
    options: &ModelOptions,
    diagnostics: &mut Diagnostics,
) {
    let mut order: Vec<BodyId> = Vec::new();
    let follows = |id: &BodyId| couplings.iter().any(|coupling| coupling.body == *id);
    match &options.joint_order {
        None => order.extend((0..bodies.len()).filter(|id| !follows(id))),
        Some(names) => {
            let index: HashMap<&str, BodyId> =
                bodies.iter().enumerate().map(|(id, b)| (b.joint.name.as_str(), id)).collect();
            let mut seen: Vec<bool> = (0..bodies.len()).map(|id| follows(&id)).collect();
            let root = bodies.iter().position(|b| b.joint.kind.is_base());
            if let Some(root) = root.filter(|&r| !names.contains(&bodies[r].joint.name)) {
                seen[root] = true;
                order.push(root);
            }
            for name in names {
                match index.get(name.as_str()) {
                    None => {
                        let known = bodies.iter().map(|b| b.joint.name.as_str());
                        diagnostics.push(messages::joint_order_unknown(name, known));
                    }
                    Some(&id) if follows(&id) => diagnostics.push(messages::joint_order_follower(name)),
                    Some(&id) if seen[id] => diagnostics.push(messages::joint_order_twice(name)),
                    Some(&id) => {
                        seen[id] = true;
                        order.push(id);
                    }
                }
            }
            let missing: Vec<&str> =
                bodies.iter().zip(&seen).filter(|(_, seen)| !**seen).map(|(b, _)| b.joint.name.as_str()).collect();
            if !missing.is_empty() {
                diagnostics.push(messages::joint_order_missing(&missing));
            }
        }
    }
    order.sort_by_key(|id| dependents.contains(id));
    order.extend((0..bodies.len()).filter(follows));
    let (mut iq, mut iv) = (0, 0);
    for id in order {
        let joint = &mut bodies[id].joint;
        (joint.iq, joint.iv) = (iq, iv);
        iq += joint.kind.nq();
        iv += joint.kind.nv();
    }
}
