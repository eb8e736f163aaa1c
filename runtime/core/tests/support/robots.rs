//! Random robots and states.
#![allow(dead_code)] // every test file uses a part of it

use nalgebra::{Matrix3, Vector3};
use straightline_core::reference::{unit, ExtendedPosition, Joint, MassCentreFrame, MassCentreLink, MassCentreTree};
use straightline_core::Dd;

/// Numbers from −1 to 1, the same for the same seed (SplitMix64).
pub struct Random(pub u64);

impl Random {
    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
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
}

/// A robot with oblique axes, full tensors, revolute and linear joints, the zero of each joint either by the chapter's
/// vectors, with and without specificities, or given as a matrix. One frame on every link.
pub fn random_robot(random: &mut Random, kind: RobotKind) -> MassCentreTree<Dd> {
    let mut links: Vec<MassCentreLink<Dd>> = Vec::new();
    let mut frames = Vec::new();
    for j in 0..kind.links {
        let mass = random.between(0.2, 5.0);
        let inertia = random.inertia(mass);
        let r = random.vector() * Dd::from(0.4);
        let name = format!("link{j}");
        let rotation = random.rotation();
        frames.push(MassCentreFrame { name: format!("frame{j}"), link: Some(j), position: random.vector(), rotation });
        if kind.floating && j == 0 {
            links.push(MassCentreLink::free(name, mass, inertia, r));
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
        let joint = if random.below(3) == 0 { Joint::Linear } else { Joint::Revolute };
        links.push(MassCentreLink {
            name,
            parent,
            joint,
            iq: 0,
            iv: 0,
            mass,
            inertia,
            e,
            e_parent,
            r,
            r_parent,
            extended,
        });
    }
    frames.push(MassCentreFrame {
        name: "world".to_string(),
        link: None,
        position: random.vector(),
        rotation: random.rotation(),
    });
    let gravity = random.vector() * Dd::from(10.0);
    let mut tree = MassCentreTree { name: format!("{kind:?}"), gravity, links, frames };
    tree.number_coordinates();
    tree
}

/// Coordinates of the robot, the quaternion of a floating root normalised.
pub fn random_position(random: &mut Random, tree: &MassCentreTree<Dd>) -> Vec<Dd> {
    let mut q = random.list(tree.nq(), 3.0);
    for link in tree.links.iter().filter(|link| link.joint == Joint::Free) {
        let i = link.iq + 3;
        let norm = q[i..i + 4].iter().fold(Dd::ZERO, |sum, &x| sum + x * x).sqrt();
        q[i..i + 4].iter_mut().for_each(|x| *x /= norm);
    }
    q
}
