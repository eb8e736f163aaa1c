//! Random robots, written twice: as a robot file for the compiler, and as links about their centres of mass for the
//! reference. The second way shares nothing with the compiler's reading, merging and framing of links.

use crate::programs;
use crate::roll_pitch_yaw::rotation;
use nalgebra::{Matrix3, Vector3};
use std::fmt::Write;
use straightline_codegen::diagnostic::Source;
use straightline_codegen::equations::Robot as Loaded;
use straightline_codegen::model::ModelOptions;
use straightline_core::reference::{
    CentreOfMassFrame, CentreOfMassLink, CentreOfMassTree, ExtendedPosition, ReferenceJoint,
};
use straightline_core::Dd;

pub use crate::written::Random;
use crate::written::{Inertial, Motion, Shape, Style, Written};

/// More of what tests draw.
impl Random {
    /// Three numbers from −`size` to `size`.
    pub fn three(&mut self, size: f64) -> [f64; 3] {
        [0; 3].map(|_| self.between(-size, size))
    }

    /// `n` numbers from −`size` to `size`.
    pub fn list(&mut self, n: usize, size: f64) -> Vec<f64> {
        (0..n).map(|_| self.between(-size, size)).collect()
    }

    /// A configuration, its quaternion, if there is a floating base, of length one up to rounding.
    pub fn configuration(&mut self, nq: usize, floating: bool) -> Vec<f64> {
        let mut q = self.list(nq, 3.0);
        if floating {
            let norm = q[3..7].iter().map(|x| x * x).sum::<f64>().sqrt();
            q[3..7].iter_mut().for_each(|x| *x /= norm);
        }
        q
    }

    /// Puts a list in another order.
    pub fn shuffle<T>(&mut self, list: &mut [T]) {
        for i in (1..list.len()).rev() {
            list.swap(i, self.below(i + 1));
        }
    }
}

/// What a random robot is to be like.
#[derive(Clone, Copy, Debug)]
pub struct Kind {
    /// Number of moving joints.
    pub joints: usize,
    /// A tree, not a chain.
    pub branched: bool,
    /// The root link is free.
    pub floating: bool,
    /// Links that are welded to others, to be merged.
    pub welded: usize,
    /// Right angles and axes along x, y, z, as most robots have them; otherwise everything is oblique.
    pub right_angled: bool,
}

/// A link with the joint that carries it.
#[derive(Clone, Debug)]
struct Link {
    parent: usize,
    motion: Motion,
    xyz: [f64; 3],
    rpy: [f64; 3],
    axis: [f64; 3],
    mass: f64,
    com: [f64; 3],
    inertia_rpy: [f64; 3],
    /// xx, yy, zz, xy, xz, yz.
    inertia: [f64; 6],
}

/// A random robot.
#[derive(Clone, Debug)]
pub struct RandomRobot {
    /// What it is like.
    pub kind: Kind,
    /// Link 0 is the root; its joint does not exist.
    links: Vec<Link>,
    /// Indices of links: the order in which the file has their joints.
    order: Vec<usize>,
}

fn dd(v: [f64; 3]) -> Vector3<Dd> {
    Vector3::from(v.map(Dd::from))
}

/// Mass, centre of mass, and tensor about it, of links welded together, in the axes of one of them.
struct Lump {
    mass: Dd,
    moment: Vector3<Dd>,
    /// About the origin of the axes.
    inertia: Matrix3<Dd>,
}

/// A link with its origin and its axes in the frame of the body that it belongs to.
type Place = (usize, Vector3<Dd>, Matrix3<Dd>);

/// |x|² 1 − x xᵀ.
fn parallel_axis(x: Vector3<Dd>) -> Matrix3<Dd> {
    Matrix3::from_diagonal_element(x.dot(&x)) - x * x.transpose()
}

impl RandomRobot {
    /// The robot of that kind and seed.
    pub fn new(random: &mut Random, kind: Kind) -> RandomRobot {
        let total = 1 + kind.joints + kind.welded;
        let mut motions: Vec<Motion> = (0..kind.joints)
            .map(|_| match random.below(4) {
                0 => Motion::Prismatic,
                1 => Motion::Continuous,
                _ => Motion::Revolute,
            })
            .chain((0..kind.welded).map(|_| Motion::Fixed))
            .collect();
        random.shuffle(&mut motions);
        motions.insert(0, Motion::Fixed);
        let angle = |random: &mut Random| match kind.right_angled {
            true => [0.0, 0.5, -0.5, 1.0][random.below(4)] * std::f64::consts::PI,
            false => random.between(-3.1, 3.1),
        };
        let links = (0..total)
            .map(|i| {
                let mass = random.between(0.2, 5.0);
                // moments of a body: the sum of any two exceeds the third
                let d = [0; 3].map(|_| mass * random.between(0.001, 0.03));
                let axis = match kind.right_angled {
                    true => [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]][random.below(4)],
                    false => loop {
                        let axis = random.three(1.0);
                        if axis.iter().map(|x| x * x).sum::<f64>() > 0.1 {
                            break axis;
                        }
                    },
                };
                Link {
                    parent: match (i, kind.branched) {
                        (0, _) => 0,
                        (_, true) => random.below(i),
                        (_, false) => i - 1,
                    },
                    motion: motions[i],
                    xyz: random.three(0.4),
                    rpy: [0; 3].map(|_| angle(random)),
                    axis,
                    mass,
                    com: random.three(0.2),
                    inertia_rpy: [0; 3].map(|_| random.between(-3.0, 3.0)),
                    inertia: [d[1] + d[2], d[0] + d[2], d[0] + d[1], 0.1 * d[0], -0.15 * d[1], 0.2 * d[2]],
                }
            })
            .collect();
        let mut order: Vec<usize> = (1..total).collect();
        random.shuffle(&mut order);
        RandomRobot { kind, links, order }
    }

    /// A robot as people and exporters write it; limits and friction, which the chapter has not, are left out.
    pub fn as_written(style: Style, shape: Shape, seed: u64) -> RandomRobot {
        let written = Written::new(style, shape, seed);
        let joints = written.joints();
        let welded = written.links.len() - 1 - joints;
        let Shape { branched, floating, .. } = shape;
        let none = Inertial { mass: 0.0, com: [0.0; 3], rpy: [0.0; 3], inertia: [0.0; 6] };
        let links = written.links.into_iter().map(|link| {
            let Inertial { mass, com, rpy: inertia_rpy, inertia } = link.inertial.unwrap_or(none);
            let crate::written::Link { parent, motion, xyz, rpy, axis, .. } = link;
            Link { parent, motion, xyz, rpy, axis, mass, com, inertia_rpy, inertia }
        });
        let links: Vec<Link> = links.collect();
        let order = (1..links.len()).collect();
        RandomRobot { kind: Kind { joints, branched, floating, welded, right_angled: false }, links, order }
    }

    /// The name of a link.
    fn name(i: usize) -> String {
        format!("link{i}")
    }

    /// One frame per link that moves, by name.
    pub fn frames(&self) -> Vec<String> {
        (1..self.links.len()).step_by(3).chain([self.links.len() - 1]).map(Self::name).collect()
    }

    /// The robot as URDF.
    pub fn urdf(&self) -> String {
        let three = |v: &[f64; 3]| format!("{:?} {:?} {:?}", v[0], v[1], v[2]);
        let mut text = String::from("<robot name=\"random\">\n");
        for (i, link) in self.links.iter().enumerate() {
            let [xx, yy, zz, xy, xz, yz] = link.inertia;
            let _ = writeln!(
                text,
                "  <link name=\"{}\"><inertial><origin xyz=\"{}\" rpy=\"{}\"/><mass value=\"{:?}\"/>\n    <inertia \
                 ixx=\"{xx:?}\" iyy=\"{yy:?}\" izz=\"{zz:?}\" ixy=\"{xy:?}\" ixz=\"{xz:?}\" iyz=\"{yz:?}\"/></inertial></link>",
                Self::name(i),
                three(&link.com),
                three(&link.inertia_rpy),
                link.mass,
            );
        }
        for &i in &self.order {
            let link = &self.links[i];
            let (kind, limit) = match link.motion {
                Motion::Revolute => ("revolute", "<limit lower=\"-3\" upper=\"3\" effort=\"10\" velocity=\"5\"/>"),
                Motion::Prismatic => ("prismatic", "<limit lower=\"-3\" upper=\"3\" effort=\"10\" velocity=\"5\"/>"),
                Motion::Continuous => ("continuous", ""),
                Motion::Fixed => ("fixed", ""),
            };
            let axis = match link.motion {
                Motion::Fixed => String::new(),
                _ => format!("<axis xyz=\"{}\"/>", three(&link.axis)),
            };
            let _ = writeln!(
                text,
                "  <joint name=\"joint{i}\" type=\"{kind}\"><parent link=\"{}\"/><child link=\"{}\"/>\n    <origin \
                 xyz=\"{}\" rpy=\"{}\"/>{axis}{limit}</joint>",
                Self::name(link.parent),
                Self::name(i),
                three(&link.xyz),
                three(&link.rpy),
            );
        }
        text.push_str("</robot>\n");
        text
    }

    /// How the compiler is to read the file.
    pub fn options(&self) -> ModelOptions {
        ModelOptions { floating_base: self.kind.floating, ..ModelOptions::default() }
    }

    /// The robot as the compiler sees it, from its file; angles near to right ones are right ones.
    pub fn load(&self) -> Loaded {
        self.load_with(&self.options())
    }

    /// The robot as the compiler sees it, from its file; 1.5707963267948966 is that number and not π/2.
    pub fn load_literally(&self) -> Loaded {
        self.load_with(&ModelOptions { angle_tolerance: 0.0, ..self.options() })
    }

    fn load_with(&self, options: &ModelOptions) -> Loaded {
        programs::load(&Source::new("random.urdf", self.urdf()), options)
    }

    /// The links that link `i` carries, in the order of the file.
    fn children(&self, i: usize) -> impl Iterator<Item = usize> + '_ {
        self.order.iter().copied().filter(move |&c| self.links[c].parent == i)
    }

    /// The robot about its centres of mass, with gravity in the file's default direction.
    pub fn reference(&self) -> CentreOfMassTree<Dd> {
        let mut tree = CentreOfMassTree {
            name: "random".to_string(),
            gravity: dd([0.0, 0.0, -9.81]),
            links: Vec::new(),
            frames: Vec::new(),
        };
        let mut centres = Vec::new();
        let (lump, places) = self.lump(0);
        let mut root = None;
        if self.kind.floating {
            let (com, inertia) = lump.about_centre();
            tree.links.push(CentreOfMassLink::free(Self::name(0), lump.mass, inertia, com));
            centres.push(com);
            root = Some(0);
        }
        self.add_frames(&mut tree, root, centres.first().copied().unwrap_or_else(Vector3::zeros), &places);
        for (i, p, r) in places {
            self.add_moving(&mut tree, &mut centres, i, root, p, r);
        }
        // coordinates: depth first, in the order of the file's joints, welded ones included in the walk
        let mut moving = Vec::new();
        self.depth_first(0, &mut moving);
        let (nq, nv) = if self.kind.floating { (7, 6) } else { (0, 0) };
        for (k, i) in moving.into_iter().enumerate() {
            let name = Self::name(i);
            let link = tree.links.iter_mut().find(|l| l.name == name).expect("every moving link is a link of the tree");
            (link.iq, link.iv) = (nq + k, nv + k);
        }
        tree
    }

    fn depth_first(&self, i: usize, moving: &mut Vec<usize>) {
        for c in self.children(i) {
            if self.links[c].motion != Motion::Fixed {
                moving.push(c);
            }
            self.depth_first(c, moving);
        }
    }

    /// All links welded to link `i`, and where they are in its frame.
    fn lump(&self, i: usize) -> (Lump, Vec<Place>) {
        let mut lump = Lump { mass: Dd::ZERO, moment: Vector3::zeros(), inertia: Matrix3::zeros() };
        let mut places = Vec::new();
        let mut open = vec![(i, Vector3::zeros(), Matrix3::identity())];
        while let Some((k, p, r)) = open.pop() {
            let link = &self.links[k];
            let (mass, com) = (Dd::from(link.mass), p + r * dd(link.com));
            let [xx, yy, zz, xy, xz, yz] = link.inertia.map(Dd::from);
            let axes = r * rotation(link.inertia_rpy);
            let tensor = axes * Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz) * axes.transpose();
            lump.mass += mass;
            lump.moment += com * mass;
            lump.inertia += tensor + parallel_axis(com) * mass;
            places.push((k, p, r));
            // the last one in is the next one out: the first child of the file
            let welded: Vec<usize> = self.children(k).filter(|&c| self.links[c].motion == Motion::Fixed).collect();
            for c in welded.into_iter().rev() {
                open.push((c, p + r * dd(self.links[c].xyz), r * rotation(self.links[c].rpy)));
            }
        }
        (lump, places)
    }

    fn add_frames(&self, tree: &mut CentreOfMassTree<Dd>, link: Option<usize>, centre: Vector3<Dd>, places: &[Place]) {
        for (k, p, r) in places {
            tree.frames.push(CentreOfMassFrame { name: Self::name(*k), link, position: p - centre, rotation: *r });
        }
    }

    /// Adds what moves against link `k`, which stands at (p, r) in the axes of body `parent`; depth first.
    fn add_moving(
        &self,
        tree: &mut CentreOfMassTree<Dd>,
        centres: &mut Vec<Vector3<Dd>>,
        k: usize,
        parent: Option<usize>,
        p: Vector3<Dd>,
        r: Matrix3<Dd>,
    ) {
        let moving: Vec<usize> = self.children(k).filter(|&c| self.links[c].motion != Motion::Fixed).collect();
        for c in moving {
            let link = &self.links[c];
            let (lump, places) = self.lump(c);
            let (com, inertia) = lump.about_centre();
            let e = straightline_core::reference::unit(&dd(link.axis));
            let (joint, turn) = (p + r * dd(link.xyz), r * rotation(link.rpy));
            let centre_of_parent = parent.map_or(Vector3::zeros(), |b| centres[b]);
            let index = tree.links.len();
            tree.links.push(CentreOfMassLink {
                name: Self::name(c),
                parent,
                joint: if link.motion == Motion::Prismatic { ReferenceJoint::Linear } else { ReferenceJoint::Revolute },
                iq: 0,
                iv: 0,
                shared: None,
                mass: lump.mass,
                inertia,
                e,
                e_parent: turn * e,
                r: com,
                r_parent: centre_of_parent - joint,
                extended: ExtendedPosition::Matrix(turn),
            });
            centres.push(com);
            self.add_frames(tree, Some(index), com, &places);
            for (w, p, r) in places {
                self.add_moving(tree, centres, w, Some(index), p, r);
            }
        }
    }
}

impl Lump {
    /// The centre of mass, and the tensor about it.
    fn about_centre(&self) -> (Vector3<Dd>, Matrix3<Dd>) {
        let com = self.moment.map(|x| x / self.mass);
        (com, self.inertia - parallel_axis(com) * self.mass)
    }
}
