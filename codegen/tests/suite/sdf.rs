//! SDF means what its specification says: random robots, printed with poses in any frame, are those that the same poses make as TOML.

use crate::robots::Random;
use std::f64::consts::{PI, TAU};
use std::fmt::Write;
use straightline_codegen::description::{self, Description};
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::model::{load, ModelOptions};
use straightline_core::algorithms::{forward_kinematics, inverse_dynamics, mass_matrix};
use straightline_core::model::{Frame, Model};
use straightline_core::Dd;

// --- poses in f64, with nothing of the compiler's ---

type Matrix = [[f64; 3]; 3];

/// A pose of a frame in the world.
#[derive(Clone, Copy, Debug)]
struct Pose {
    p: [f64; 3],
    r: Matrix,
}

fn transpose(m: Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| m[j][i]))
}

fn times(a: Matrix, b: Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

fn turned(m: Matrix, v: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| (0..3).map(|k| m[i][k] * v[k]).sum())
}

impl Pose {
    const WORLD: Pose = Pose { p: [0.0; 3], r: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] };

    /// This frame in another one, both given in the world.
    fn within(self, other: Pose) -> Pose {
        let back = transpose(other.r);
        Pose { p: turned(back, [0, 1, 2].map(|i| self.p[i] - other.p[i])), r: times(back, self.r) }
    }

    /// R = Rz(yaw) Ry(pitch) Rx(roll).
    fn rpy(self) -> [f64; 3] {
        let r = self.r;
        [r[2][1].atan2(r[2][2]), (-r[2][0]).atan2(r[0][0].hypot(r[1][0])), r[1][0].atan2(r[0][0])]
    }

    /// x, y, z, w; of any length.
    fn quaternion(self) -> [f64; 4] {
        let r = self.r;
        let squares = [
            1.0 + r[0][0] - r[1][1] - r[2][2],
            1.0 - r[0][0] + r[1][1] - r[2][2],
            1.0 - r[0][0] - r[1][1] + r[2][2],
            1.0 + r[0][0] + r[1][1] + r[2][2],
        ];
        let greatest = (0..4).max_by(|a, b| squares[*a].total_cmp(&squares[*b])).expect("there are four");
        let sum = |i: usize, j: usize| r[i][j] + r[j][i];
        let difference = |i: usize, j: usize| r[i][j] - r[j][i];
        match greatest {
            0 => [squares[0], sum(0, 1), sum(0, 2), difference(2, 1)],
            1 => [sum(0, 1), squares[1], sum(1, 2), difference(0, 2)],
            2 => [sum(0, 2), sum(1, 2), squares[2], difference(1, 0)],
            _ => [difference(2, 1), difference(0, 2), difference(1, 0), squares[3]],
        }
    }

    fn random(random: &mut Random) -> Pose {
        let mut q = [0; 4].map(|_| number(random, 1.0));
        let length = q.iter().map(|x| x * x).sum::<f64>().sqrt();
        q.iter_mut().for_each(|x| *x /= length);
        let [x, y, z, w] = q;
        let r = [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ];
        Pose { p: [0; 3].map(|_| number(random, 0.5)), r }
    }
}

fn number(random: &mut Random, size: f64) -> f64 {
    random.number().to_f64() * size
}

fn words(numbers: &[f64]) -> String {
    numbers.iter().map(|x| format!("{x:?}")).collect::<Vec<_>>().join(" ")
}

// --- a robot that is written twice ---

const KINDS: [&str; 9] =
    ["revolute", "continuous", "prismatic", "ball", "fixed", "universal", "revolute2", "screw", "thread"];

struct Joint {
    kind: &'static str,
    parent: usize,
    /// The joint's frame in the world, which is the child's frame in the TOML.
    frame: Pose,
    /// Directions in the axes of the joint.
    axes: [[f64; 3]; 2],
    /// Damping, friction, stiffness and rest.
    dynamics: [f64; 4],
}

struct Link {
    /// The link's frame in the world.
    frame: Pose,
    mass: f64,
    /// The frame of the mass centre in the world, with the axes of the inertia.
    centre: Pose,
    moments: [f64; 3],
}

struct Robot {
    /// Link 0 has no joint above it; joint k moves link k + 1.
    links: Vec<Link>,
    joints: Vec<Joint>,
    is_floating: bool,
    /// By what the last joint follows the first: multiplier, offset and reference.
    follows: Option<[f64; 3]>,
    /// Frames that are only that: pose, and the link that carries them.
    frames: Vec<(Pose, usize)>,
}

impl Robot {
    fn random(random: &mut Random) -> Robot {
        let n = 2 + random.below(5);
        let link = |random: &mut Random| {
            let [a, b, c] = [0; 3].map(|_| 0.05 + number(random, 1.0).abs());
            let moments = [b + c, a + c, a + b];
            Link {
                frame: Pose::random(random),
                mass: 0.5 + number(random, 1.0).abs(),
                centre: Pose::random(random),
                moments,
            }
        };
        let joint = |random: &mut Random, child: usize| Joint {
            kind: KINDS[random.below(KINDS.len())],
            parent: if random.below(3) == 0 { random.below(child) } else { child - 1 },
            frame: Pose::random(random),
            axes: [0; 2].map(|_| {
                let v = [0; 3].map(|_| number(random, 1.0));
                let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
                v.map(|x| x / length)
            }),
            dynamics: [0; 4].map(|_| number(random, 1.0).abs()),
        };
        let links: Vec<Link> = (0..=n).map(|_| link(random)).collect();
        let mut joints: Vec<Joint> = (1..=n).map(|child| joint(random, child)).collect();
        joints[0].kind = "revolute";
        joints[n - 1].kind = ["revolute", "prismatic"][random.below(2)];
        let follows = (n > 1 && random.below(2) == 0).then(|| [0; 3].map(|_| number(random, 2.0)));
        let frames = (1..=n).map(|link| (Pose::random(random), link)).filter(|(pose, _)| pose.p[0] > 0.0).collect();
        Robot { links, joints, is_floating: random.below(2) == 0, follows, frames }
    }

    /// As TOML: the frame of a link is that of its joint.
    fn toml(&self) -> String {
        let base = if self.is_floating { "floating" } else { "fixed" };
        let mut text = format!("[robot]\nname = \"robot\"\nbase = \"{base}\"\ngravity = [1.0, -2.0, -9.0]\n");
        let own = |link: usize| match link {
            0 if self.is_floating => self.links[0].frame,
            0 => Pose::WORLD,
            k => self.joints[k - 1].frame,
        };
        for (k, link) in self.links.iter().enumerate() {
            let centre = link.centre.within(own(k));
            let _ = write!(
                text,
                "[[link]]\nname = \"l{k}\"\nmass = {:?}\ncom = {:?}\ninertia = {:?}\ninertia_rpy = {:?}\n",
                link.mass,
                centre.p,
                link.moments,
                centre.rpy()
            );
        }
        for (k, joint) in self.joints.iter().enumerate() {
            let origin = joint.frame.within(own(joint.parent));
            let kind = match joint.kind {
                "revolute2" => "universal",
                "screw" | "thread" => "helical",
                kind => kind,
            };
            let _ = write!(
                text,
                "[[joint]]\nname = \"j{k}\"\nkind = \"{kind}\"\nparent = \"l{}\"\nchild = \"l{}\"\norigin = {{ xyz = {:?}, rpy = {:?} }}\n",
                joint.parent,
                k + 1,
                origin.p,
                origin.rpy()
            );
            if !["ball", "fixed"].contains(&kind) {
                let _ = writeln!(text, "axis = {:?}", joint.axes[0]);
            }
            match kind {
                "universal" => {
                    let _ = writeln!(text, "axis2 = {:?}", joint.axes[1]);
                }
                "ball" | "fixed" => {}
                _ => {
                    let [damping, friction, stiffness, rest] = joint.dynamics;
                    let _ = writeln!(
                        text,
                        "damping = {damping:?}\nfriction = {friction:?}\nspring = {{ stiffness = {stiffness:?}, rest = {rest:?} }}"
                    );
                }
            }
            match joint.kind {
                "screw" => text += "lead = 0.25\n",
                "thread" => text += "pitch = -0.125\n",
                _ => {}
            }
        }
        for (k, (pose, link)) in self.frames.iter().enumerate() {
            let pose = pose.within(own(*link));
            let _ = writeln!(
                text,
                "[[frame]]\nname = \"f{k}\"\nlink = \"l{link}\"\nxyz = {:?}\nrpy = {:?}",
                pose.p,
                pose.rpy()
            );
        }
        if let Some([ratio, offset, reference]) = self.follows {
            let offset = offset - ratio * reference;
            let (last, first) = (self.joints.len() - 1, 0);
            let _ = write!(
                text,
                "[[coupling]]\njoint = \"j{last}\"\nfollows = \"j{first}\"\nratio = {ratio:?}\noffset = {offset:?}\n"
            );
        }
        text
    }
}

// --- the same as SDF ---

/// How one file is printed.
struct Printer<'a> {
    random: &'a mut Random,
    robot: &'a Robot,
    /// Where the models stand: the outer one, and the one in it.
    models: [Pose; 2],
    /// The links from this on stand in the inner model.
    inner: usize,
    is_old: bool,
}

impl Printer<'_> {
    /// The model that a joint stands in: one that sees both of its links.
    fn model_of_joint(&self, k: usize) -> usize {
        self.model(k + 1).min(self.model(self.robot.joints[k].parent))
    }

    /// The model that a link stands in.
    fn model(&self, link: usize) -> usize {
        usize::from(link >= self.inner)
    }

    /// A name as a model means it; `None` for what it does not see.
    fn seen(&self, model: usize, owner: usize, name: String) -> Option<String> {
        match (model, owner) {
            (a, b) if a == b => Some(name),
            (0, 1) => Some(format!("limb::{name}")),
            _ => None,
        }
    }

    /// A frame of a model that a pose may be given in, and where it stands; those of links before `before` alone, so that there is no circle.
    fn reference(&mut self, model: usize, before: usize) -> (String, Pose) {
        let link = self.random.below(before.max(1));
        let is_there = before > 0 && (link > 0 || self.robot.is_floating);
        let candidates = [
            is_there
                .then(|| self.seen(model, self.model(link), format!("l{link}")))
                .flatten()
                .map(|name| (name, self.robot.links[link].frame)),
            (is_there && link > 0)
                .then(|| self.seen(model, self.model_of_joint(link - 1), format!("j{}", link - 1)))
                .flatten()
                .map(|name| (name, self.robot.joints[link - 1].frame)),
            Some(("__model__".to_string(), self.models[model])),
        ];
        let known: Vec<(String, Pose)> = candidates.into_iter().flatten().collect();
        known[self.random.below(known.len())].clone()
    }

    /// A pose in a frame, in any of the formats.
    fn pose(&mut self, pose: Pose, reference: Option<(String, Pose)>, otherwise: Pose) -> String {
        let (attribute, other) = match reference {
            Some((name, frame)) => {
                let attribute = if self.is_old { "frame" } else { "relative_to" };
                (format!(" {attribute}='{name}'"), frame)
            }
            None => (String::new(), otherwise),
        };
        let own = pose.within(other);
        let p = words(&own.p);
        match if self.is_old { 2 } else { self.random.below(3) } {
            0 => format!("<pose{attribute} degrees='true'>{p}  {}</pose>\n", words(&own.rpy().map(|x| x * 180.0 / PI))),
            1 => format!("<pose rotation_format=\"quat_xyzw\"{attribute}>{p}\n  {}</pose>\n", words(&own.quaternion())),
            _ => format!("<pose{attribute}>{p} {}</pose>", words(&own.rpy())),
        }
    }

    fn is_said(&mut self) -> bool {
        self.random.below(2) == 0
    }

    fn link(&mut self, k: usize) -> String {
        let Link { frame, mass, centre, moments } = self.robot.links[k];
        let model = self.model(k);
        let reference = self.is_said().then(|| self.reference(model, k));
        let pose = self.pose(frame, reference, self.models[model]);
        let inertial = self.pose(centre, None, frame);
        let [x, y, z] = moments;
        format!(
            "<link name='l{k}'>{pose}<inertial>{inertial}<mass> {mass:?} </mass>\n<inertia><ixx>{x:?}</ixx><iyy>{y:?}</iyy><izz>{z:?}</izz>\
             </inertia></inertial><visual name='v'><pose>1 2 3 4 5 6</pose></visual></link>\n"
        )
    }

    /// A direction in the axes of any frame.
    fn axis(
        &mut self,
        name: &str,
        joint: &Joint,
        direction: [f64; 3],
        (model, k): (usize, usize),
        further: &str,
    ) -> String {
        let in_world = turned(joint.frame.r, direction);
        let (attribute, frame, flag) = match self.random.below(2) {
            0 if self.is_old => {
                (String::new(), self.models[model], "<use_parent_model_frame>1</use_parent_model_frame>")
            }
            0 => {
                let (name, frame) = self.reference(model, k + 2);
                (format!(" expressed_in=\"{name}\""), frame, "")
            }
            _ => (String::new(), joint.frame, ""),
        };
        let own = turned(transpose(frame.r), in_world);
        format!("<{name}><xyz{attribute}>{}</xyz>{flag}{further}</{name}>\n", words(&own))
    }

    fn joint(&mut self, k: usize) -> String {
        let robot = self.robot;
        let joint = &robot.joints[k];
        let (child, model) = (k + 1, self.model_of_joint(k));
        let (kind, further) = match joint.kind {
            "thread" => ("screw", "<thread_pitch>8</thread_pitch>"),
            "screw" => ("screw", "<thread_pitch>-3</thread_pitch><screw_thread_pitch>0.25</screw_thread_pitch>"),
            kind => (kind, ""),
        };
        let mut ends = [joint.parent, child]
            .map(|link| self.seen(model, self.model(link), format!("l{link}")).expect("an outer model sees all"));
        if joint.parent == 0 && !robot.is_floating {
            ends[0] = "world".to_string();
        }
        // frames that links carry stand for them, but then a pose has to say in which frame it is given
        let mut is_renamed = false;
        for (end, link) in ends.iter_mut().zip([joint.parent, child]) {
            let carried = self.robot.frames.iter().position(|(_, on)| *on == link);
            if let Some(frame) = carried.filter(|_| end != "world" && !self.is_old && self.random.below(2) == 0) {
                if let Some(name) = self.seen(model, 0, format!("f{frame}")) {
                    is_renamed |= link == child;
                    *end = name;
                }
            }
        }
        let reference = (is_renamed || self.is_said())
            .then(|| self.reference(model, child + 1))
            .filter(|(name, _)| !name.ends_with(&format!("j{k}")));
        let reference = reference.or_else(|| is_renamed.then(|| ("__model__".to_string(), self.models[model])));
        let pose = self.pose(joint.frame, reference, robot.links[child].frame);
        let [damping, friction, stiffness, rest] = joint.dynamics;
        let dynamics = format!(
            "<limit><lower>-1e16</lower><upper>1e16</upper><effort>-1</effort></limit><dynamics><damping>{damping:?}</damping><friction>{friction:?}</friction>\
             <spring_stiffness>{stiffness:?}</spring_stiffness><spring_reference>{rest:?}</spring_reference></dynamics>"
        );
        let mimic = match robot.follows {
            Some([ratio, offset, reference]) if child == robot.joints.len() => {
                let leader = self.seen(model, self.model_of_joint(0), "j0".to_string()).expect("it stands outside");
                format!(
                    "<mimic joint='{leader}'><multiplier>{ratio:?}</multiplier><offset>{offset:?}</offset><reference>{reference:?}</reference></mimic>"
                )
            }
            _ => String::new(),
        };
        let axes = match kind {
            "fixed" => String::new(),
            "ball" => "<axis><xyz>1 2 3</xyz></axis>".to_string(),
            "universal" | "revolute2" => {
                self.axis("axis", joint, joint.axes[0], (model, k), "")
                    + &self.axis("axis2", joint, joint.axes[1], (model, k), "<limit/>")
            }
            _ => self.axis("axis", joint, joint.axes[0], (model, k), &(dynamics + &mimic)),
        };
        let [parent, child] = ends;
        format!(
            "<joint name='j{k}' type=\"{kind}\"><parent>{parent}</parent>{pose}{further}<child> {child}\n</child>\n{axes}</joint>\n"
        )
    }

    /// The file: frames and joints before links or behind them, and a model in the model.
    fn print(&mut self) -> String {
        let n = self.robot.links.len();
        let first = usize::from(!self.robot.is_floating);
        let mut texts = [Vec::new(), Vec::new()];
        for k in first..n {
            let link = self.link(k);
            texts[self.model(k)].push(link);
        }
        for k in 0..n - 1 {
            let joint = self.joint(k);
            texts[self.model_of_joint(k)].push(joint);
        }
        for (frame, &(pose, link)) in self.robot.frames.iter().enumerate() {
            let on = self.seen(0, self.model(link), format!("l{link}")).expect("an outer model sees all");
            let reference = self.is_said().then(|| self.reference(0, n));
            let pose = self.pose(pose, reference, self.robot.links[link].frame);
            texts[0].push(format!("<frame name='f{frame}' attached_to='{on}'>{pose}</frame>\n"));
        }
        let [mut outer, inner] = texts;
        if !inner.is_empty() {
            let (placed, place) = match self.is_said() && !self.is_old {
                true => (format!(" placement_frame='l{}'", self.inner), self.robot.links[self.inner].frame),
                false => (String::new(), self.models[1]),
            };
            let reference = self.is_said().then(|| self.reference(0, self.inner));
            let pose = self.pose(place, reference, self.models[0]);
            outer.push(format!("<model name='limb'{placed}>{pose}{}</model>\n", inner.concat()));
        }
        let version = if self.is_old { 6 } else { 9 + self.random.below(4) };
        let pose = self.pose(self.models[0], None, Pose::WORLD);
        let text = format!("<model name='robot'>{pose}{}</model>", outer.concat());
        format!("<?xml version='1.0'?>\n<sdf version='1.{version}'><world name='w'><gravity>1 -2 -9</gravity>{text}</world></sdf>\n")
    }
}

/// The robot in one of the ways to write it.
fn printed(robot: &Robot, random: &mut Random) -> (String, usize) {
    let n = robot.links.len();
    let is_old = random.below(4) == 0;
    // a joint in the inner model does not see one in the outer one
    let has_inner = robot.follows.is_none() && random.below(2) == 0;
    let inner = if has_inner { 2 + random.below(n - 2) } else { n };
    let models = [Pose::random(random), Pose::random(random)];
    (Printer { random, robot, models, inner, is_old }.print(), inner)
}

/// A random robot as SDF.
pub fn random_sdf(random: &mut Random) -> String {
    let robot = Robot::random(random);
    printed(&robot, random).0
}

fn model_of(name: &str, text: &str, options: &ModelOptions) -> Model<Dd> {
    let (model, diagnostics) = load(&Source::new(name, text), options);
    model.unwrap_or_else(|| panic!("{diagnostics}\n{text}"))
}

/// Coordinates, rates and accelerations that no symmetry hides behind.
fn state(model: &Model<Dd>) -> [Vec<Dd>; 3] {
    let numbers = |n: usize, phase: f64| (0..n).map(|i| Dd::from((1.3 * i as f64 + phase).sin())).collect::<Vec<_>>();
    let mut q = numbers(model.nq(), 0.4);
    let nq = q.len();
    let own = model.bodies.iter().filter(|b| b.joint.iq + b.joint.kind.nq() <= nq);
    own.for_each(|b| b.joint.kind.normalise(&mut q[b.joint.iq..b.joint.iq + b.joint.kind.nq()]));
    [q, numbers(model.nv(), 1.1), numbers(model.nv(), 2.3)]
}

/// Both have the same H and the same torques.
fn same(a: &Model<Dd>, b: &Model<Dd>, bound: f64, what: &str) {
    assert_eq!((a.nq(), a.nv(), a.bodies.len()), (b.nq(), b.nv(), b.bodies.len()), "{what}");
    let [q, qd, qdd] = state(a);
    let results = |m: &Model<Dd>| [mass_matrix(m, &q), inverse_dynamics(m, &q, &qd, &qdd)];
    for (a, b) in results(a).iter().zip(&results(b)) {
        let scale = a.iter().fold(0.0f64, |most, x| most.max(x.to_f64().abs()));
        for (i, (a, b)) in a.iter().zip(b).enumerate() {
            let error = (*a - *b).to_f64().abs() / scale;
            assert!(error <= bound, "entry {i}: {} and {}, {error:e} of scale: {what}", a.to_f64(), b.to_f64());
        }
    }
    let effects = |m: &Model<Dd>| {
        let mut bodies: Vec<_> = m.bodies.iter().collect();
        bodies.sort_by_key(|body| body.joint.iv);
        let effects = bodies.iter().map(|body| format!("{:?}", body.effects));
        effects.collect::<Vec<_>>()
    };
    assert_eq!(effects(a), effects(b), "{what}");
    for frame in a.frames.iter().filter(|frame| frame.name.starts_with('f')) {
        let other = b.frame(&frame.name).unwrap_or_else(|| panic!("no frame {}: {what}", frame.name));
        let place = |m: &Model<Dd>, frame: &Frame<Dd>| {
            let x = forward_kinematics(m, &q, &[frame])[0];
            [x.rotation.rows.as_flattened(), &x.translation.to_array()].concat()
        };
        for (x, y) in place(a, frame).iter().zip(place(b, other)) {
            assert!((*x - y).to_f64().abs() < 20.0 * bound, "frame {}: {what}", frame.name);
        }
    }
}

/// The joints of a model in the order of its coordinates, by the names that a file of the same robot gives them.
fn order(model: &Model<Dd>, robot: &Robot, inner: usize) -> Vec<String> {
    let followers: Vec<usize> = model.couplings.iter().map(|coupling| coupling.body).collect();
    let free = model
        .bodies
        .iter()
        .enumerate()
        .filter(|(id, body)| !followers.contains(id) && body.joint.name.starts_with('j'));
    let mut bodies: Vec<_> = free.map(|(_, body)| body).collect();
    bodies.sort_by_key(|body| body.joint.iv);
    let named = |name: &String| {
        let k: usize = name[1..].split('_').next().and_then(|k| k.parse().ok()).expect("names are j and a number");
        if robot.joints[k].parent >= inner {
            format!("limb::{name}")
        } else {
            name.clone()
        }
    };
    bodies.iter().map(|body| named(&body.joint.name)).collect()
}

#[test]
fn random_robots_are_those_that_their_poses_make() {
    for seed in 1..=150 {
        let random = &mut Random(seed);
        let robot = Robot::random(random);
        let toml = model_of("robot.toml", &robot.toml(), &ModelOptions::default());
        for way in 0..3 {
            let (text, inner) = printed(&robot, random);
            let options = ModelOptions { joint_order: Some(order(&toml, &robot, inner)), ..ModelOptions::default() };
            let sdf = model_of("robot.sdf", &text, &options);
            let mut toml = toml.clone();
            if text.contains("version='1.6'") {
                toml.frames.retain(|frame| sdf.frame(&frame.name).is_some());
            }
            same(&toml, &sdf, 1e-14, &format!("seed {seed}, way {way}\n{text}\n{}", robot.toml()));
        }
    }
}

// --- what the specification says, in single robots ---

const INERTIAL: &str =
    "<inertial><pose>0.1 -0.2 0.3 0 0 0</pose><mass>2.5</mass><inertia><ixx>0.3</ixx><ixy>0.01</ixy><ixz>-0.02</ixz>
    <iyy>0.4</iyy><iyz>0.03</iyz><izz>0.5</izz></inertia></inertial>";

fn link(name: &str, pose: &str) -> String {
    format!("<link name='{name}'>{pose}{INERTIAL}</link>")
}

fn joint(name: &str, kind: &str, [parent, child]: [&str; 2], further: &str) -> String {
    format!("<joint name='{name}' type='{kind}'><parent>{parent}</parent><child>{child}</child>{further}</joint>")
}

fn axis(attribute: &str, xyz: &str, further: &str) -> String {
    format!("<axis><xyz{attribute}>{xyz}</xyz>{further}</axis>")
}

fn sdf(version: &str, model: &str) -> String {
    format!("<sdf version='{version}'><model name='robot'>{model}</model></sdf>")
}

fn described(text: &str) -> Description {
    let mut diagnostics = Diagnostics::new();
    let description = description::read(&Source::new("robot.sdf", text), &mut diagnostics);
    assert!(!diagnostics.has_errors(), "{diagnostics}\n{text}");
    description.expect("a text without errors is read")
}

fn read(text: &str) -> Model<Dd> {
    model_of("robot.sdf", text, &ModelOptions::default())
}

#[test]
fn joints_of_links_that_stand_at_their_joints_need_no_links_between() {
    let pose = "<pose relative_to='a'>0 0 1 0.5 0 0</pose>";
    let model = link("a", "")
        + &link("b", pose)
        + &joint("j", "revolute", ["a", "b"], &axis("", "1 0 0", "<limit><lower>-1</lower></limit>"));
    let description = described(&sdf("1.9", &model));
    assert_eq!(description.links.len(), 2);
    let only = description.joint("j").expect("it is read");
    assert!(only.kind.value.has_range && only.limits.upper.is_none());
    assert_eq!(description.base.map(|base| base.value), Some(description::BaseKind::Floating));
}

#[test]
fn what_moves_with_the_world_stands_on_it() {
    let arm = link("arm", "<pose>0 0 1 0 0 0</pose>");
    let turn = |parent: &str, pose: &str| {
        joint("turn", "continuous", [parent, "arm"], &(pose.to_string() + &axis("", "0 1 0", "")))
    };
    let pose = "<pose>1 2 3 0.3 0.2 0.1</pose>";
    let whole = |models: String| format!("<sdf version='1.10'><world name='w'>{models}</world></sdf>");
    let alone = format!("<model name='robot'>{pose}{arm}{}</model>", turn("world", ""));
    // a table that does not move, on which the arm stands, and a link that a joint fixes to the world
    let table = format!("<static>1</static>{}", link("top", "<pose>5 5 5 0 0 0</pose>"));
    let on_table =
        format!("<model name='robot'>{pose}<model name='table'>{table}</model>{arm}{}</model>", turn("table::top", ""));
    let welded = format!(
        "<model name='robot'>{pose}{}{arm}{}{}</model>",
        link("top", ""),
        joint("weld", "fixed", ["world", "top"], ""),
        turn("top", "")
    );
    let from_world = format!(
        "<model name='robot'>{pose}{arm}</model>{}",
        joint("turn", "continuous", ["world", "robot::arm"], &axis("", "0 1 0", ""))
    );
    let plain = read(&whole(alone));
    assert_eq!(plain.gravity.to_array().map(|x| x.to_f64()), [0.0, 0.0, -9.8]);
    for other in [on_table, welded, from_world] {
        let other = read(&whole(other));
        same(&plain, &other, 1e-30, "on the world");
        let [a, b] = [&plain, &other].map(|model| model.frame("arm").expect("it is a link").clone());
        let q = [Dd::from(0.7)];
        assert_eq!(forward_kinematics(&plain, &q, &[&a]), forward_kinematics(&other, &q, &[&b]));
    }
}

#[test]
fn up_to_1_6_axes_can_be_those_of_the_model() {
    let links = link("a", "") + &link("b", "<pose>0 0 1 0.5 0.25 0.125</pose>");
    let robot = |version: &str, attribute: &str, flag: &str| {
        let axis = axis(attribute, "0.6 0 0.8", flag);
        read(&sdf(version, &(links.clone() + &joint("j", "revolute", ["a", "b"], &axis))))
    };
    let old = robot("1.6", "", "<use_parent_model_frame>true</use_parent_model_frame>");
    same(&robot("1.8", " expressed_in='__model__'", ""), &old, 1e-30, "in the model's axes");
    let in_joint = robot("1.6", "", "<use_parent_model_frame>false</use_parent_model_frame>");
    same(&robot("1.8", "", ""), &in_joint, 1e-30, "in the joint's axes");
    // where a name is that of a link and of a joint, it means the link
    let both = links.clone() + &joint("b", "revolute", ["a", "b"], &axis("", "0.6 0 0.8", ""));
    same(&robot("1.8", "", ""), &read(&sdf("1.6", &both)), 1e-30, "a joint with the name of its link");
}

#[test]
fn a_screw_advances_along_its_axis_as_it_turns() {
    let screw = |pitch: &str| {
        let axis = pitch.to_string() + &axis("", "0 0 2", "");
        let model = link("a", "") + &joint("j", "screw", ["world", "a"], &axis);
        let model = read(&sdf("1.11", &model));
        let tip = forward_kinematics(&model, &[Dd::from(TAU)], &[model.frame("a").expect("it is a link")]);
        tip[0].translation.z.to_f64()
    };
    // a right-handed thread, a quarter of a metre a turn; a left-handed one, a radian a metre
    assert_eq!(screw("<screw_thread_pitch>0.25</screw_thread_pitch>"), 0.25);
    assert!((screw("<thread_pitch>1</thread_pitch>") + TAU).abs() < 1e-15);
}

#[test]
fn a_gear_couples_the_two_joints_between_its_links() {
    let model = ["ground", "motor", "arm"].map(|name| link(name, "")).concat()
        + &joint("motor", "revolute", ["ground", "motor"], &axis("", "0 1 0", "")).replace("name='motor'", "name='in'")
        + &joint("out", "continuous", ["ground", "arm"], &axis("", "0 -1 0", ""));
    let gear = |axis: &str| {
        let between = "<gearbox_reference_body>ground</gearbox_reference_body><gearbox_ratio>0.04</gearbox_ratio>";
        joint("gear", "gearbox", ["motor", "arm"], &(between.to_string() + axis))
    };
    let of = |axes: &str| {
        described(&sdf("1.6", &(model.clone() + &gear(axes))))
            .couplings
            .iter()
            .map(|c| (c.joint.value.clone(), c.source.value.clone(), c.ratio.value))
            .collect::<Vec<_>>()
    };
    let along = axis("", "0 1 0", "") + &axis("", "0 1 0", "").replace("axis>", "axis2>");
    // θ₂ = −0.04 θ₁, and the second joint turns the other way round
    assert_eq!(of(&along), [("out".to_string(), "in".to_string(), 0.04)]);
    let against = axis("", "0 1 0", "") + &axis("", "0 -1 0", "").replace("axis>", "axis2>");
    assert_eq!(of(&against), [("out".to_string(), "in".to_string(), -0.04)]);
    let across = axis("", "0 1 0", "") + &axis("", "1 0 0", "").replace("axis>", "axis2>");
    let (none, diagnostics) =
        load(&Source::new("robot.sdf", sdf("1.6", &(model.clone() + &gear(&across)))), &ModelOptions::default());
    assert!(none.is_none());
    assert_eq!(diagnostics.iter().map(|d| d.code).collect::<Vec<_>>(), ["not-supported-yet"], "{diagnostics}");
}

#[test]
fn limits_without_end_are_none() {
    let limit = |limit: &str| {
        let model = link("a", "")
            + &joint("j", "revolute", ["world", "a"], &axis("", "0 0 1", &format!("<limit>{limit}</limit>")));
        let limits = read(&sdf("1.9", &model)).bodies[0].joint.limits;
        [limits.lower, limits.upper, limits.velocity, limits.effort]
    };
    let inf = f64::INFINITY;
    assert_eq!(
        limit("<lower>-1e16</lower><upper>1e+16</upper><effort>-1</effort><velocity>-1</velocity>"),
        [-inf, inf, inf, inf]
    );
    assert_eq!(
        limit("<lower>-inf</lower><upper>2</upper><effort>3</effort><velocity>4</velocity>"),
        [-inf, 2.0, 4.0, 3.0]
    );
}
