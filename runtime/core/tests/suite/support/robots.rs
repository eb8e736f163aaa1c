//! Random robots and states.
#![allow(dead_code)] // every test file uses a part of it

use super::roll_pitch_yaw::rotation;
use super::written::{Motion, Shape, Style, Written};
use nalgebra::{Matrix3, Vector3};
use straightline_core::reference::{
    unit, CentreOfMassFrame, CentreOfMassLink, CentreOfMassTree, ExtendedPosition, ReferenceJoint,
};
use straightline_core::Dd;

/// Numbers from −1 to 1, the same for the same seed.
pub struct Random(pub u64);

impl Random {
    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        straightline_core::random::split_mix_64(&mut self.0)
    }

    /// One of `0 .. n`.
    pub fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }

    /// Uniform in −1 … 1.
    pub fn number(&mut self) -> Dd {
        Dd::from((self.bits() >> 11) as f64 / (1u64 << 52) as f64 - 1.0)
    }

    /// Uniform in `low … high`.
    pub fn between(&mut self, low: f64, high: f64) -> Dd {
        (self.number() + Dd::ONE) * Dd::from((high - low) / 2.0) + Dd::from(low)
    }

    /// Components from −1 to 1.
    pub fn vector(&mut self) -> Vector3<Dd> {
        Vector3::new(self.number(), self.number(), self.number())
    }

    /// A unit vector.
    pub fn direction(&mut self) -> Vector3<Dd> {
        loop {
            let v = self.vector();
            if v.dot(&v).to_f64() > 0.1 {
                return unit(&v);
            }
        }
    }

    /// A rotation matrix.
    pub fn rotation(&mut self) -> Matrix3<Dd> {
        let (x, y) = (self.direction(), self.direction());
        let z = unit(&x.cross(&y));
        Matrix3::from_columns(&[x, z.cross(&x), z])
    }

    /// A full tensor of inertia of a rigid body of that mass: Σ m (x·x 1 − x xᵀ) over four points.
    pub fn inertia(&mut self, mass: Dd) -> Matrix3<Dd> {
        let mut sum = Matrix3::zeros();
        for _ in 0..4 {
            let x = self.vector() * Dd::from(0.2);
            sum += (Matrix3::identity() * x.dot(&x) - x * x.transpose()) * (mass * Dd::from(0.25));
        }
        sum
    }

    /// `n` numbers from −`size` to `size`.
    pub fn list(&mut self, n: usize, size: f64) -> Vec<Dd> {
        (0..n).map(|_| self.number() * Dd::from(size)).collect()
    }
}

/// What a random robot is to be like.
#[derive(Clone, Copy, Debug)]
pub struct RobotKind {
    /// Number of links.
    pub links: usize,
    /// A tree, not a chain.
    pub branched: bool,
    /// The first link floats.
    pub floating: bool,
    /// Half of its joints are ball joints.
    pub balls: bool,
}

/// A robot with oblique axes, full tensors, revolute and linear joints, the zero of each joint either by the chapter's
/// vectors, with and without specificities, or given as a matrix. One frame on every link.
pub fn random_robot(random: &mut Random, kind: RobotKind) -> CentreOfMassTree<Dd> {
    let mut links: Vec<CentreOfMassLink<Dd>> = Vec::new();
    let mut frames = Vec::new();
    for j in 0..kind.links {
        let mass = random.between(0.2, 5.0);
        let inertia = random.inertia(mass);
        let r = random.vector() * Dd::from(0.4);
        let name = format!("link{j}");
        let rotation = random.rotation();
        frames.push(CentreOfMassFrame {
            name: format!("frame{j}"),
            link: Some(j),
            position: random.vector(),
            rotation,
        });
        if kind.floating && j == 0 {
            links.push(CentreOfMassLink::free(name, mass, inertia, r));
            continue;
        }
        let first = usize::from(kind.floating);
        let parent = match kind.branched {
            true if j > first => Some(first + random.below(j - first)),
            _ => j.checked_sub(1),
        };
        let (e, e_parent) = (random.direction(), random.direction());
        let r_parent = random.vector() * Dd::from(0.4);
        let (r, r_parent, e_parent, extended) = match random.below(4) {
            // a specificity at the lower, upper or both ends: r along the axis
            0 => {
                let (lower, upper) = [(true, false), (false, true), (true, true)][random.below(3)];
                let r_star = lower.then(|| random.direction());
                let r_parent_star = upper.then(|| random.direction());
                let along = |axis: Vector3<Dd>, length: Dd| axis * length;
                (
                    if lower { along(e, r.x) } else { r },
                    if upper { along(e_parent, r_parent.x) } else { r_parent },
                    e_parent,
                    ExtendedPosition::ByVectors { r_star, r_parent_star, alpha: random.between(-3.0, 3.0) },
                )
            }
            1 => {
                let vectors =
                    ExtendedPosition::ByVectors { r_star: None, r_parent_star: None, alpha: random.between(-3.0, 3.0) };
                (r, r_parent, e_parent, vectors)
            }
            _ => {
                let extended = random.rotation();
                (r, r_parent, extended * e, ExtendedPosition::Matrix(extended))
            }
        };
        let joint = if random.below(3) == 0 { ReferenceJoint::Linear } else { ReferenceJoint::Revolute };
        let (joint, e, e_parent, extended) = match kind.balls && random.below(2) == 0 {
            true => {
                let extended = ExtendedPosition::Matrix(random.rotation());
                (ReferenceJoint::Ball, Vector3::zeros(), Vector3::zeros(), extended)
            }
            false => (joint, e, e_parent, extended),
        };
        links.push(CentreOfMassLink {
            name,
            parent,
            joint,
            iq: 0,
            iv: 0,
            shared: None,
            mass,
            inertia,
            e,
            e_parent,
            r,
            r_parent,
            extended,
        });
    }
    frames.push(CentreOfMassFrame {
        name: "world".to_string(),
        link: None,
        position: random.vector(),
        rotation: random.rotation(),
    });
    let gravity = random.vector() * Dd::from(10.0);
    let mut tree = CentreOfMassTree { name: format!("{kind:?}"), gravity, links, frames };
    tree.number_coordinates();
    tree
}

/// Coordinates of the robot, quaternions normalised.
pub fn random_position(random: &mut Random, tree: &CentreOfMassTree<Dd>) -> Vec<Dd> {
    let mut q = random.list(tree.nq(), 3.0);
    for (link, first) in tree.links.iter().filter_map(|link| Some((link, link.joint.quaternion()?))) {
        let i = link.iq + first;
        let norm = q[i..i + 4].iter().fold(Dd::ZERO, |sum, &x| sum + x * x).sqrt();
        q[i..i + 4].iter_mut().for_each(|x| *x /= norm);
    }
    q
}

/// A robot as people and exporters write it, its numbers taken literally, without links that are welded on. One frame on every link.
///
/// # Panics
/// If a link is welded on, or a link that moves says nothing of its mass.
pub fn written_robot(written: &Written, name: String) -> CentreOfMassTree<Dd> {
    let vector = |x: [f64; 3]| Vector3::from(x.map(Dd::from));
    let tensor = |[xx, yy, zz, xy, xz, yz]: [f64; 6]| Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz).map(Dd::from);
    // link 0 of a fixed base is the world
    let first = usize::from(!written.floating);
    let of = |i: usize| written.links[i].inertial.as_ref().expect("links that move have a mass");
    let links = written.links.iter().enumerate().skip(first).map(|(i, link)| {
        let (name, inertial) = (format!("l{i}"), of(i));
        let turned = rotation(inertial.rpy);
        let (mass, com) = (Dd::from(inertial.mass), vector(inertial.com));
        let inertia = turned * tensor(inertial.inertia) * turned.transpose();
        if i == 0 {
            return CentreOfMassLink::free(name, mass, inertia, com);
        }
        assert_ne!(link.motion, Motion::Fixed, "nothing is welded");
        let parent = link.parent.checked_sub(first);
        let (e, extended) = (unit(&vector(link.axis)), rotation(link.rpy));
        let carried = parent.map_or(Vector3::zeros(), |_| vector(of(link.parent).com));
        CentreOfMassLink {
            name,
            parent,
            joint: if link.motion == Motion::Prismatic { ReferenceJoint::Linear } else { ReferenceJoint::Revolute },
            iq: 0,
            iv: 0,
            shared: None,
            mass,
            inertia,
            e,
            e_parent: extended * e,
            r: com,
            r_parent: carried - vector(link.xyz),
            extended: ExtendedPosition::Matrix(extended),
        }
    });
    let links: Vec<CentreOfMassLink<Dd>> = links.collect();
    let frame = |(j, link): (usize, &CentreOfMassLink<Dd>)| CentreOfMassFrame {
        name: format!("frame{j}"),
        link: Some(j),
        position: -link.r,
        rotation: Matrix3::identity(),
    };
    let frames = links.iter().enumerate().map(frame).collect();
    let mut tree = CentreOfMassTree { name, gravity: vector([0.0, 0.0, -9.81]), links, frames };
    tree.number_coordinates();
    tree
}

/// Robots in every style of numbers, `seeds` of each: chains and trees with up to seven joints, some of which slide, some afloat.
pub fn written_robots(seeds: u64) -> impl Iterator<Item = (Style, CentreOfMassTree<Dd>)> {
    let of = |seed: u64, k: usize, style: Style| {
        let (branched, floating) = ((k + seed as usize).is_multiple_of(3), (k + seed as usize).is_multiple_of(5));
        let joints = 1 + (k * 3 + seed as usize) % 7;
        let shape = Shape { joints, fixed: 0, branched, floating, sliding: 4 };
        let written = Written::new(style, shape, 40 + 100 * seed + k as u64);
        (style, written_robot(&written, format!("{}, seed {seed}\n{}", style.name(), written.text())))
    };
    (0..seeds).flat_map(move |seed| Style::all().into_iter().enumerate().map(move |(k, style)| of(seed, k, style)))
}
