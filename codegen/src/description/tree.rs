//! What every robot file ends in: links, joints and frames, and what stands beside them.
//!
//! The one thing that formats say in different ways is where a joint stands ([`Placement`]).

use super::composite::{CompositeKind, WrittenComposite, COMPOSITES};
use super::loops::WrittenLoop;
use super::{angle, drives, flexible, Angle, FileFormat, Noted, Rotation, WrittenPose};
use crate::diagnostic::Place;
use std::collections::HashSet;
use straightline_core::joint::{self, Dialect, JointKind, Measure};
use straightline_core::spatial::{Mat3, Sym3};

/// How the robot stands in the world.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BaseKind {
    /// The root link is the world.
    Fixed,
    /// The root link moves freely.
    Floating,
}

/// A robot file.
#[derive(Clone, Debug, PartialEq)]
pub struct Description {
    /// The format that it is written in.
    pub format: &'static FileFormat,
    /// The robot's name.
    pub name: Noted<String>,
    /// Acceleration due to gravity in the world \[m/s²\], where the file states it.
    pub gravity: Option<Noted<[f64; 3]>>,
    /// The base, where the file states it.
    pub base: Option<Noted<BaseKind>>,
    /// Viscous friction on each velocity of a base that floats \[N·s/m of the root link's origin, N·m·s/rad of its turn\].
    pub base_damping: Option<Noted<f64>>,
    /// The links, in the file's order.
    pub links: Vec<WrittenLink>,
    /// The joints, in the file's order.
    pub joints: Vec<WrittenJoint>,
    /// Joints whose coordinates follow those of others.
    pub couplings: Vec<WrittenCoupling>,
    /// Where bodies close loops.
    pub loops: Vec<WrittenLoop>,
    /// Joints that something drives, where the file says so beside its drives: loops determine others first.
    pub actuated: Vec<String>,
    /// Further named frames.
    pub frames: Vec<NamedFrame>,
    /// A link or a joint could not be read, so that the tree has holes that were complained of already.
    pub has_holes: bool,
    /// What drives the joints.
    pub drives: Vec<drives::WrittenDrive>,
    /// Links that bend.
    pub flexible: Vec<flexible::Flexible>,
    /// What the file holds and the dynamics do not need.
    pub ignored: Vec<Ignored>,
}

impl Description {
    /// A robot without links, of which nothing is said yet.
    pub fn new(format: &'static FileFormat, name: Noted<String>) -> Description {
        Description {
            format,
            name,
            gravity: None,
            base: None,
            base_damping: None,
            links: Vec::new(),
            joints: Vec::new(),
            couplings: Vec::new(),
            loops: Vec::new(),
            actuated: Vec::new(),
            frames: Vec::new(),
            has_holes: false,
            drives: Vec::new(),
            flexible: Vec::new(),
            ignored: Vec::new(),
        }
    }

    /// The link of a name.
    pub fn link(&self, name: &str) -> Option<&WrittenLink> {
        self.links.iter().find(|link| link.name.value == name)
    }

    /// Whether the file says that the base floats.
    pub fn floats(&self) -> bool {
        self.base.as_ref().is_some_and(|base| base.value == BaseKind::Floating)
    }

    /// The link that no joint moves, the first of several.
    pub fn root(&self) -> Option<&WrittenLink> {
        let moved: HashSet<&str> = self.joints.iter().map(|joint| joint.child.value.as_str()).collect();
        self.links.iter().find(|link| !moved.contains(link.name.value.as_str()))
    }

    /// The root of a robot that stands on the ground, where it is the world itself.
    pub(crate) fn ground(&self) -> Option<&WrittenLink> {
        self.root().filter(|root| !self.floats() && root.name.value == "world")
    }

    /// The joint of a name.
    pub fn joint(&self, name: &str) -> Option<&WrittenJoint> {
        self.joints.iter().find(|joint| joint.name.value == name)
    }

    /// Every angle that is written, once, and what it is called.
    pub fn angles(&self) -> Vec<(String, &Angle)> {
        let mut all = Vec::new();
        for link in &self.links {
            let of = || format!("the inertia of link `{}`", link.name.value);
            all.extend(link.inertial.iter().flat_map(|inertial| inertial.rotation.angles(of())));
        }
        for WrittenJoint { name, placement, .. } in &self.joints {
            match placement {
                Placement::Frames { origin, .. } => {
                    all.extend(origin.rotation.angles(format!("the origin of joint `{}`", name.value)));
                }
                Placement::Anchored(AnchoredJoint { origin, reference, .. }) => {
                    all.extend(origin.rotation.angles(format!("the origin of joint `{}`", name.value)));
                    if let Some(PoseCoordinate::Angle(angle)) = reference {
                        all.push((format!("ref of joint `{}`", name.value), angle));
                    }
                }
                Placement::Vectors(vectors) => {
                    all.extend(vectors.alpha.iter().map(|alpha| (format!("alpha of joint `{}`", name.value), alpha)));
                }
            }
        }
        for frame in &self.frames {
            all.extend(frame.pose.rotation.angles(format!("frame `{}`", frame.name.value)));
        }
        all.retain(|(_, angle)| !angle.text.is_empty());
        all
    }

    /// Where a joint stands, or the link that it moves where the file has no such joint.
    pub(crate) fn place_of(&self, joint: &str, link: &str) -> Option<&Place> {
        let of_link = || self.link(link).map(|link| &link.name.place);
        self.joint(joint).map(|joint| &joint.name.place).or_else(of_link)
    }

    /// The coordinate that a joint has in the pose of the file.
    pub(crate) fn reference_of(&self, joint: &str) -> Option<&PoseCoordinate> {
        match &self.joint(joint)?.placement {
            Placement::Anchored(anchored) => anchored.reference.as_ref(),
            _ => None,
        }
    }

    /// Adds a link.
    pub(crate) fn add_link(&mut self, link: Option<WrittenLink>) {
        self.has_holes |= link.is_none();
        self.links.extend(link);
    }

    /// Adds what could be read of a joint.
    pub(crate) fn add_joint(&mut self, joint: Option<WrittenJoint>) {
        self.has_holes |= joint.is_none();
        if let Some((joints, links, couplings)) = joint.map(WrittenJoint::expanded) {
            self.joints.extend(joints);
            self.links.extend(links);
            self.couplings.extend(couplings);
        }
    }
}

/// A kind of element that was skipped.
#[derive(Clone, Debug, PartialEq)]
pub struct Ignored {
    /// Its name, such as `visual`.
    pub what: String,
    /// How often it occurs.
    pub count: usize,
    /// Its first place.
    pub place: Place,
}

/// A link.
#[derive(Clone, Debug, PartialEq)]
pub struct WrittenLink {
    /// What joints, frames and scenes call it; no two links share it.
    pub name: Noted<String>,
    /// Mass, centre of mass and inertia, where the file gives them.
    pub inertial: Option<WrittenInertial>,
    /// It only carries joints, in a file that gives a body several, and is no frame that users see.
    pub is_carrier: bool,
}

/// Mass, centre of mass and inertia of a link.
#[derive(Clone, Debug, PartialEq)]
pub struct WrittenInertial {
    /// Mass \[kg\].
    pub mass: Noted<f64>,
    /// Centre of mass in the link frame \[m\].
    pub com: Noted<[f64; 3]>,
    /// Rotation of the axes of `inertia` against the link's.
    pub rotation: Rotation,
    /// Inertia tensor about the centre of mass, in axes turned by `rotation` \[kg·m²\].
    pub inertia: Noted<Sym3<f64>>,
}

impl WrittenInertial {
    /// The axes of the inertia in those of the link.
    pub fn turn(&self) -> Mat3<f64> {
        angle::rotation(&self.rotation, angle::ROUNDING).map(|x| x.to_f64())
    }
}

/// What a file says of how a joint moves: a word of the table of joints, or `fixed`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointType {
    /// The word.
    pub word: &'static str,
    /// How it moves; `None`: not at all.
    pub kind: Option<JointKind>,
    /// Whether its coordinate has a range, which the file then gives.
    pub has_range: bool,
    /// The number that its kind has of its own, such as a pitch.
    pub number: Option<f64>,
    /// A joint that is read as several.
    pub composite: Option<WrittenComposite>,
}

impl JointType {
    /// A joint that does not move.
    pub const FIXED: JointType =
        JointType { word: "fixed", kind: None, has_range: false, number: None, composite: None };

    /// All words of a dialect: joints between links, then `fixed` where files have such joints, then free bases.
    pub fn words(dialect: Dialect) -> Vec<(&'static str, JointType)> {
        let words = || {
            joint::words(dialect).map(|(kind, word)| JointType {
                word: word.text,
                kind: Some(kind),
                has_range: word.has_range,
                ..JointType::FIXED
            })
        };
        let has_fixed = Dialect::WITH_FIXED.contains(&dialect);
        let composites = COMPOSITES.iter().filter(|composite| composite.dialects.contains(&dialect));
        let single = words().filter(|t| !t.is_free());
        let between_links =
            single.chain(composites.map(CompositeKind::joint_type)).chain(has_fixed.then_some(JointType::FIXED));
        between_links.chain(words().filter(|t| t.is_free())).map(|t| (t.word, t)).collect()
    }

    /// A joint that turns, with a range or without.
    pub fn turning(has_range: bool) -> JointType {
        let kind = Measure::Angle.joint();
        let word =
            kind.row().words.iter().find(|word| word.has_range == has_range).expect("there is a word for either");
        JointType { word: word.text, kind: Some(kind), has_range, ..JointType::FIXED }
    }

    /// A joint that turns or slides without limits.
    pub fn free_along(measure: Measure) -> JointType {
        let kind = measure.joint();
        let word = kind.row().words.iter().find(|word| !word.has_range).unwrap_or(&kind.row().words[0]);
        JointType { word: word.text, kind: Some(kind), ..JointType::FIXED }
    }

    /// The same with the number that its kind has of its own.
    pub fn with_number(self, number: f64) -> JointType {
        JointType { kind: self.kind.map(|kind| kind.with_number(number)), number: Some(number), ..self }
    }

    /// Key of the number that its kind has of its own.
    pub fn number_key(self) -> Option<&'static str> {
        self.kind.and_then(|kind| kind.row().number)
    }

    /// Whether it moves along or about an axis that the file gives.
    pub fn has_axis(self) -> bool {
        let has_axis = |kind: JointKind| kind.row().has_axis;
        self.composite.map_or(self.between_links().is_some_and(has_axis), |composite| composite.of.has_axis)
    }

    /// Whether it would let a link move freely, which no joint between links does.
    pub fn is_free(self) -> bool {
        self.kind.is_some_and(|kind| kind.is_base())
    }

    /// How it moves one link against another; `None`: it does not.
    pub fn between_links(self) -> Option<JointKind> {
        self.kind.filter(|kind| !kind.is_base())
    }
}

/// A joint.
#[derive(Clone, Debug, PartialEq)]
pub struct WrittenJoint {
    /// What scenes, drives and messages call it; no two joints share it.
    pub name: Noted<String>,
    /// How it moves.
    pub kind: Noted<JointType>,
    /// The link that carries it.
    pub parent: Noted<String>,
    /// The link that it moves.
    pub child: Noted<String>,
    /// Where it stands, and along which axis.
    pub placement: Placement,
    /// Ranges.
    pub limits: JointLimits,
    /// What its drive adds.
    pub drive: JointDrive,
}

impl WrittenJoint {
    /// One that does not move and adds nothing.
    pub(crate) fn fixed(
        name: Noted<String>,
        parent: Noted<String>,
        child: Noted<String>,
        origin: WrittenPose,
    ) -> WrittenJoint {
        let place = name.place.clone();
        WrittenJoint {
            name,
            kind: Noted::new(JointType::FIXED, place.clone()),
            parent,
            child,
            placement: Placement::Frames { origin, axis: Noted::new([0.0, 0.0, 1.0], place) },
            limits: JointLimits::default(),
            drive: JointDrive::default(),
        }
    }

    /// What belongs to a single coordinate, as far as it is written; zeros add nothing.
    pub(crate) fn of_one_coordinate(&self) -> Vec<(&'static str, &Noted<f64>)> {
        let WrittenJoint { limits, drive, .. } = self;
        let given = [
            ("a lower limit", &limits.lower),
            ("an upper limit", &limits.upper),
            ("a velocity limit", &limits.velocity),
            ("an effort limit", &limits.effort),
        ];
        let acting = [
            ("damping", &drive.damping),
            ("friction", &drive.friction),
            ("a rotor inertia", &drive.rotor_inertia),
            ("an armature", &drive.armature),
            ("a spring", &drive.spring_stiffness),
        ];
        let acting = acting.into_iter().filter(|(_, value)| value.as_ref().is_some_and(|value| value.value != 0.0));
        given.into_iter().chain(acting).filter_map(|(what, value)| Some((what, value.as_ref()?))).collect()
    }
}

/// How a file says where a joint stands.
#[derive(Clone, Debug, PartialEq)]
pub enum Placement {
    /// By frames of links and joints.
    Frames {
        /// Pose of the joint frame, which is the child's link frame at q = 0, in the parent's link frame.
        origin: WrittenPose,
        /// Axis in the joint frame, as long as it is written; \[1, 0, 0\] where a URDF says nothing. Nothing reads that of a joint that
        /// [has none](JointType::has_axis).
        axis: Noted<[f64; 3]>,
    },
    /// By vectors between the joint S_j and the origins C of the link frames, as in the chapter; of joints that move.
    Vectors(JointVectors),
    /// By frames of links, with the joint anywhere in them, as in MJCF; of joints that move.
    Anchored(AnchoredJoint),
}

/// A joint that stands somewhere in the child's link frame.
#[derive(Clone, Debug, PartialEq)]
pub struct AnchoredJoint {
    /// Pose of the child's link frame in the parent's where the coordinate is `reference`.
    pub origin: WrittenPose,
    /// The joint in the child's link frame \[m\].
    pub anchor: Noted<[f64; 3]>,
    /// Axis in the child's link frame, as long as it is written.
    pub axis: Noted<[f64; 3]>,
    /// The coordinate that the file's pose has; 0 where it says nothing.
    pub reference: Option<PoseCoordinate>,
}

/// A coordinate of a joint that turns or slides.
#[derive(Clone, Debug, PartialEq)]
pub enum PoseCoordinate {
    /// Of one that turns.
    Angle(Angle),
    /// Of one that slides \[m\].
    Length(Noted<f64>),
}

/// Axis and place of joint j in the frames of its links, j−1 and j. All vectors are as written.
#[derive(Clone, Debug, PartialEq)]
pub struct JointVectors {
    /// e_j in frame j−1.
    pub e_parent: Noted<[f64; 3]>,
    /// r_{j−1,j} in frame j−1, from S_j to C_{j−1} \[m\].
    pub r_parent: Noted<[f64; 3]>,
    /// r*_{j−1,j}, in a specificity: replaces r_{j−1,j} in (20.101).
    pub r_parent_star: Option<Noted<[f64; 3]>>,
    /// e_j in frame j.
    pub e: Noted<[f64; 3]>,
    /// r_{j,j} in frame j, from S_j to C_j \[m\].
    pub r: Noted<[f64; 3]>,
    /// r*_{j,j}, in a specificity: replaces r_{j,j} in (20.101).
    pub r_star: Option<Noted<[f64; 3]>>,
    /// α_j, the constant angle of a linear joint.
    pub alpha: Option<Angle>,
}

impl Placement {
    /// Its lengths \[m\] and what they are called.
    pub fn lengths(&self) -> Vec<(&'static str, &Noted<[f64; 3]>)> {
        match self {
            Placement::Frames { origin, .. } => vec![("origin", &origin.xyz)],
            Placement::Vectors(JointVectors { r_parent, r, .. }) => vec![("r_next", r_parent), ("r", r)],
            Placement::Anchored(AnchoredJoint { origin, anchor, .. }) => vec![("pos", &origin.xyz), ("pos", anchor)],
        }
    }
}

/// Ranges of a joint, where the file gives them.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct JointLimits {
    /// Least coordinate \[rad or m\].
    pub lower: Option<Noted<f64>>,
    /// Greatest coordinate \[rad or m\].
    pub upper: Option<Noted<f64>>,
    /// Greatest speed \[rad/s or m/s\].
    pub velocity: Option<Noted<f64>>,
    /// Greatest torque or force \[N·m or N\].
    pub effort: Option<Noted<f64>>,
}

impl JointLimits {
    /// A number from which on a limit of URDF or SDF is none: `libsdformat` takes it so, and readers of URDF in C++ refuse `inf`.
    pub(super) const NONE: f64 = 1e16;

    /// Whether a number is a limit in URDF and SDF.
    pub(super) fn is_limit(x: f64) -> bool {
        x.abs() < Self::NONE
    }
}

/// What the drive of a joint adds to its dynamics, where the file gives it.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct JointDrive {
    /// Viscous friction \[N·m·s/rad or N·s/m\].
    pub damping: Option<Noted<f64>>,
    /// Coulomb friction \[N·m or N\].
    pub friction: Option<Noted<f64>>,
    /// Moment of inertia of the rotor about its axis \[kg·m²\].
    pub rotor_inertia: Option<Noted<f64>>,
    /// Rotor speed over joint speed \[1 or rad/m\]; 1 where the file says nothing.
    pub gear_ratio: Option<Noted<f64>>,
    /// Inertia added on the joint's own coordinate \[kg·m² or kg\], in place of a rotor with its gear.
    pub armature: Option<Noted<f64>>,
    /// Spring: stiffness \[N·m/rad or N/m\].
    pub spring_stiffness: Option<Noted<f64>>,
    /// Spring: coordinate without force \[rad or m\].
    pub spring_rest: Option<Noted<f64>>,
    /// What spring and damper are made of, in place of their numbers.
    pub oscillation: Option<WrittenOscillation>,
}

/// How a joint is to swing on its spring and damper in the pose of the file while all others are free: both are made of it.
#[derive(Clone, Debug, PartialEq)]
pub struct WrittenOscillation {
    /// T \[s\], positive.
    pub time_constant: f64,
    /// ζ, positive.
    pub damping_ratio: f64,
    /// Its place.
    pub place: Place,
}

/// A joint whose coordinate follows that of another: q = a q_source + b.
#[derive(Clone, Debug, PartialEq)]
pub struct WrittenCoupling {
    /// The joint that follows.
    pub joint: Noted<String>,
    /// The joint that it follows, which may follow another one itself.
    pub source: Noted<String>,
    /// a \[1, m/rad or rad/m\]; 1 where the file says nothing.
    pub ratio: Noted<f64>,
    /// b \[rad or m\]; 0 where the file says nothing.
    pub offset: Noted<f64>,
}

/// A named frame on a link.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedFrame {
    /// What `frames` and contacts call it; links are frames of their own names.
    pub name: Noted<String>,
    /// The link that carries it.
    pub link: Noted<String>,
    /// Its pose in the link frame.
    pub pose: WrittenPose,
}
