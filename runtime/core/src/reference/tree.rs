//! The chapter's input: links described from their centres of mass.
//!
//! Section 20.1.2: each link has a frame fixed to it, with its origin in the centre of mass C and arbitrary axes. Names of
//! this module: `e`, `r`, `r_star` are the projections on the link's own frame (tilde above, ẽ_j, r̃_{j,j}), `e_parent`,
//! `r_parent`, `r_parent_star` those on the parent's frame (tilde below, e_j and r_{j−1,j}). The world is frame 0, with its
//! origin C_0.

use super::ReferenceReal;
use alloc::string::String;
use alloc::vec::Vec;
use nalgebra::{Matrix3, Vector3};

/// How a link moves against its parent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReferenceJoint {
    /// s_j = 0: turns about e_j by q_j \[rad\].
    Revolute,
    /// s_j = 1: slides along e_j by q_j \[m\].
    #[doc(alias = "prismatic")]
    Linear,
    /// A root that is free in the world (not in the chapter). Seven coordinates: position of the root point and unit
    /// quaternion (x, y, z, qx, qy, qz, qw) of the link's axes; six velocities (v, ω) of the root point and of the link,
    /// in the link's axes; τ = (F, M) about the root point in the link's axes.
    Free,
    /// Turns about any axis through S_j (not in the chapter). Four coordinates: unit quaternion (x, y, z, w) of the link's axes against those of the
    /// joint, which the extended position turns into the parent's; three velocities, ω of the link against its parent in the link's axes; τ = M likewise.
    Ball,
}

impl ReferenceJoint {
    /// The joint that robot files mean by a word, with the number that goes with it; `None`: none that stands between links.
    pub fn of_word(word: &str, _number: Option<f64>) -> Option<ReferenceJoint> {
        match word {
            "revolute" | "continuous" | "hinge" => Some(ReferenceJoint::Revolute),
            "prismatic" | "linear" | "slide" => Some(ReferenceJoint::Linear),
            "spherical" | "ball" => Some(ReferenceJoint::Ball),
            _ => None,
        }
    }

    /// (1 − s_j, s_j) with the indicator s_j of (20.6), 0 for a revolute joint, 1 for a linear one: how much a joint turns and how much it
    /// slides per unit of its coordinate. A free link and a ball joint have none.
    #[doc(alias = "s_j")]
    pub fn shares<T: ReferenceReal>(self) -> Option<[T; 2]> {
        match self {
            ReferenceJoint::Revolute => Some([nalgebra::one(), nalgebra::zero()]),
            ReferenceJoint::Linear => Some([nalgebra::zero(), nalgebra::one()]),
            ReferenceJoint::Free | ReferenceJoint::Ball => None,
        }
    }

    /// Number of position coordinates.
    pub const fn nq(self) -> usize {
        match self {
            ReferenceJoint::Revolute | ReferenceJoint::Linear => 1,
            ReferenceJoint::Ball => 4,
            ReferenceJoint::Free => 7,
        }
    }

    /// Number of velocity coordinates.
    pub const fn nv(self) -> usize {
        match self {
            ReferenceJoint::Revolute | ReferenceJoint::Linear => 1,
            ReferenceJoint::Ball => 3,
            ReferenceJoint::Free => 6,
        }
    }

    /// Where among its coordinates a unit quaternion (x, y, z, w) begins.
    pub const fn quaternion(self) -> Option<usize> {
        match self {
            ReferenceJoint::Revolute | ReferenceJoint::Linear => None,
            ReferenceJoint::Ball => Some(0),
            ReferenceJoint::Free => Some(3),
        }
    }
}

/// What the relative orientation of a link is when its joint is extended, A⁰_{j−1,j}.
#[derive(Clone, Debug, PartialEq)]
pub enum ExtendedPosition<T> {
    /// By the chapter's definition of the coordinate, from the r vectors: equations (20.101)–(20.107).
    #[doc(alias = "specificity")]
    ByVectors {
        /// r*_{j,j} in frame j, where r_{j,j} is parallel with e_j (or something else is wanted).
        r_star: Option<Vector3<T>>,
        /// r*_{j−1,j} in the parent's frame, where r_{j−1,j} is parallel with e_j (or something else is wanted).
        r_parent_star: Option<Vector3<T>>,
        /// α_j \[rad\]: the constant rotation of a linear joint from the fictive extended position. Unused by others.
        alpha: T,
    },
    /// Given as it is: from frame j to the parent's frame at q_j = 0, for robots whose zero is defined otherwise.
    Matrix(Matrix3<T>),
}

/// What a joint has that shares the coordinate of another one (not in the chapter): its own is `ratio` q + `offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SharedCoordinate<T> {
    /// How much it turns or slides per unit of the coordinate.
    pub ratio: T,
    /// Where it is at coordinate zero \[rad or m\].
    pub offset: T,
    /// Its place among the joints that share coordinates of others.
    pub rank: usize,
}

/// A link, described from its centre of mass, with the joint that carries it.
#[derive(Clone, Debug, PartialEq)]
pub struct CentreOfMassLink<T> {
    /// Name of the link in the robot file.
    pub name: String,
    /// The link it moves against, an index into [`CentreOfMassTree::links`] that is less than its own; `None`: the base,
    /// frame 0.
    pub parent: Option<usize>,
    /// How it moves.
    pub joint: ReferenceJoint,
    /// First index into q.
    pub iq: usize,
    /// First index into q̇, q̈ and τ.
    pub iv: usize,
    /// Of a joint that has no coordinate of its own: `iq` and `iv` are those of the joint whose it shares.
    pub shared: Option<SharedCoordinate<T>>,
    /// m_j \[kg\].
    pub mass: T,
    /// J̃_j: tensor of inertia about the centre of mass, link axes \[kg·m²\]; (20.15).
    pub inertia: Matrix3<T>,
    /// ẽ_j: unit vector of the joint axis in frame j; (20.2). Null for a ball joint.
    pub e: Vector3<T>,
    /// e_j in the parent's frame, a unit vector; (20.5).
    pub e_parent: Vector3<T>,
    /// r̃_{j,j} \[m\]: from the joint S_j (of a linear joint, from S''_j) to C_j, in frame j; (20.3). Of a free link: from the
    /// root point to C_j.
    #[doc(alias = "r_jj")]
    pub r: Vector3<T>,
    /// r_{j−1,j} \[m\]: from the joint S_j (of a linear joint, from S'_j) to the parent's centre of mass, in the parent's frame;
    /// (20.4). Null for a free link.
    pub r_parent: Vector3<T>,
    /// The orientation at q_j = 0.
    pub extended: ExtendedPosition<T>,
}

impl<T: ReferenceReal> CentreOfMassLink<T> {
    /// A link that is free in the world: q = (position of the root point, quaternion of the link's axes).
    pub fn free(name: String, mass: T, inertia: Matrix3<T>, r: Vector3<T>) -> Self {
        CentreOfMassLink {
            name,
            parent: None,
            joint: ReferenceJoint::Free,
            iq: 0,
            iv: 0,
            shared: None,
            mass,
            inertia,
            e: Vector3::zeros(),
            e_parent: Vector3::zeros(),
            r,
            r_parent: Vector3::zeros(),
            extended: ExtendedPosition::Matrix(Matrix3::identity()),
        }
    }
}

impl<T: ReferenceReal> CentreOfMassLink<T> {
    /// How much it turns and slides per unit of the coordinate that moves it: [`ReferenceJoint::shares`], times the ratio of one that it shares.
    pub(super) fn shares(&self) -> Option<[T; 2]> {
        let shares = self.joint.shares::<T>()?;
        Some(self.shared.map_or(shares, |shared| shares.map(|share| share * shared.ratio)))
    }

    /// Its own coordinate, of a joint that has one.
    pub(super) fn own_coordinate(&self, q: &[T]) -> T {
        self.shared.map_or(q[self.iq], |shared| shared.ratio * q[self.iq] + shared.offset)
    }

    fn map<U: ReferenceReal>(&self, f: impl Fn(T) -> U + Copy) -> CentreOfMassLink<U> {
        CentreOfMassLink {
            name: self.name.clone(),
            parent: self.parent,
            joint: self.joint,
            iq: self.iq,
            iv: self.iv,
            shared: self.shared.map(|s| SharedCoordinate { ratio: f(s.ratio), offset: f(s.offset), rank: s.rank }),
            mass: f(self.mass),
            inertia: self.inertia.map(f),
            e: self.e.map(f),
            e_parent: self.e_parent.map(f),
            r: self.r.map(f),
            r_parent: self.r_parent.map(f),
            extended: match &self.extended {
                ExtendedPosition::Matrix(extended) => ExtendedPosition::Matrix(extended.map(f)),
                ExtendedPosition::ByVectors { r_star, r_parent_star, alpha } => ExtendedPosition::ByVectors {
                    r_star: r_star.map(|r| r.map(f)),
                    r_parent_star: r_parent_star.map(|r| r.map(f)),
                    alpha: f(*alpha),
                },
            },
        }
    }
}

impl<T: ReferenceReal> CentreOfMassFrame<T> {
    /// The same frame over another scalar.
    pub fn map<U: ReferenceReal>(&self, f: impl Fn(T) -> U + Copy) -> CentreOfMassFrame<U> {
        CentreOfMassFrame {
            name: self.name.clone(),
            link: self.link,
            position: self.position.map(f),
            rotation: self.rotation.map(f),
        }
    }
}

/// A frame that is fixed to a link.
#[derive(Clone, Debug, PartialEq)]
pub struct CentreOfMassFrame<T> {
    /// Name of the frame in the robot file.
    pub name: String,
    /// The link that carries it; `None`: the world.
    pub link: Option<usize>,
    /// From C_j to the frame's origin, in frame j \[m\].
    pub position: Vector3<T>,
    /// Columns: the frame's axes in frame j.
    pub rotation: Matrix3<T>,
}

/// A robot as the chapter describes it, generalised to a tree of links.
#[derive(Clone, Debug, PartialEq)]
#[doc(alias = "CentreOfMassChain")]
pub struct CentreOfMassTree<T> {
    /// Name of the robot.
    pub name: String,
    /// g: acceleration due to gravity in frame 0 \[m/s²\].
    pub gravity: Vector3<T>,
    /// The links, parents before children.
    pub links: Vec<CentreOfMassLink<T>>,
    /// Frames that outputs may be asked for.
    pub frames: Vec<CentreOfMassFrame<T>>,
}

impl<T: ReferenceReal> CentreOfMassTree<T> {
    /// Number of position coordinates.
    pub fn nq(&self) -> usize {
        self.own().map(|link| link.joint.nq()).sum()
    }

    /// Number of velocity coordinates, n of the chapter.
    pub fn nv(&self) -> usize {
        self.own().map(|link| link.joint.nv()).sum()
    }

    /// The links whose joints have coordinates of their own.
    pub fn own(&self) -> impl Iterator<Item = &CentreOfMassLink<T>> {
        self.links.iter().filter(|link| link.shared.is_none())
    }

    /// The links in the order of the coordinates of their joints, those that share others' last.
    pub fn by_coordinates(&self) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.links.len()).collect();
        order.sort_by_key(|link| {
            let link = &self.links[*link];
            link.shared.map_or((0, link.iv), |shared| (1, shared.rank))
        });
        order
    }

    /// Gives the joints their places in q and q̇ in the order of the links.
    pub fn number_coordinates(&mut self) {
        let (mut iq, mut iv) = (0, 0);
        for link in &mut self.links {
            (link.iq, link.iv) = (iq, iv);
            iq += link.joint.nq();
            iv += link.joint.nv();
        }
    }

    /// The same robot in other numbers.
    pub fn map<U: ReferenceReal>(&self, f: impl Fn(T) -> U + Copy) -> CentreOfMassTree<U> {
        CentreOfMassTree {
            name: self.name.clone(),
            gravity: self.gravity.map(f),
            links: self.links.iter().map(|link| link.map(f)).collect(),
            frames: self.frames.iter().map(|frame| frame.map(f)).collect(),
        }
    }

    /// The frame of that name.
    pub fn frame(&self, name: &str) -> Option<&CentreOfMassFrame<T>> {
        self.frames.iter().find(|frame| frame.name == name)
    }

    /// The links from `k` down to the base: k, its parent, …
    pub(super) fn path_down(&self, k: usize) -> impl Iterator<Item = usize> + '_ {
        core::iter::successors(Some(k), |&p| self.links[p].parent)
    }

    /// Whether joint `j` carries link `k`; in a chain: k ≥ j.
    pub(super) fn carries(&self, j: usize, k: usize) -> bool {
        self.path_down(k).any(|p| p == j)
    }
}
