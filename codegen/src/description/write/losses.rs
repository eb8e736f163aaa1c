//! What a format has no place for, or says in another way: a row each, and each writer lists its own.
//!
//! A row finds what a robot has of it, and takes it away, so that what is left is what the written file is compared with.

use super::sdf::{self, names};
use crate::description::geometry::principal_moments;
use crate::description::{
    AnchoredJoint, BaseKind, Description, JointLimits, JointVectors, Noted, Placement, WrittenInertial, WrittenJoint,
    WrittenLink,
};
use crate::diagnostic::Place;
use std::collections::{HashMap, HashSet};
use straightline_core::Dd;

mod loops;

pub use loops::{
    ASSEMBLIES, DETERMINED_JOINTS, HINGED_LOOPS, HINGED_LOOPS_BESIDE_BALLS, LOOPS, LOOPS_AS_JOINTS, LOOPS_OPEN_AT_ZERO,
    SOFT_LOOPS, WELDED_LOOPS,
};

/// So much more than the sum of the others a principal moment is by rounding.
const SLACK: f64 = 1.0 + 1e-12;

/// Something that is lost, or said in another way.
#[derive(Debug)]
pub struct Loss {
    /// What it is, in the plural.
    pub what: &'static str,
    /// How much it matters.
    pub weight: LossWeight,
    /// What becomes of it, or what to do.
    pub then: &'static str,
    /// What a robot has of it: of whom, and where it stands.
    pub find: fn(&Description) -> Vec<(String, Place)>,
    /// Takes it away.
    pub remove: fn(&mut Description),
}

/// How much a loss matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LossWeight {
    /// The robot moves in another way: an error, unless it is to be left out.
    Dynamics,
    /// The robot moves likewise; something that is known of it is lost, or other programs do not take the file.
    Data,
    /// Nothing of the robot is lost: it is said in another way.
    Form,
}

impl LossWeight {
    /// The code of the complaint that says it.
    pub fn code(self) -> &'static str {
        match self {
            Dynamics => "not-in-format",
            Data => "left-out",
            Form => "said-otherwise",
        }
    }
}

use LossWeight::{Data, Dynamics, Form};

/// Springs of joints.
pub static SPRINGS: Loss = Loss {
    what: "springs",
    weight: Dynamics,
    then: "their forces are left out",
    find: |robot| of_joints(robot, |joint| first([&joint.drive.spring_stiffness].into_iter().filter(|k| acts(k)))),
    remove: |robot| {
        for drive in robot.joints.iter_mut().map(|joint| &mut joint.drive) {
            (drive.spring_stiffness, drive.spring_rest) = (None, None);
        }
    },
};

/// Rotors with their gears, and armatures.
pub static ROTORS: Loss = Loss {
    what: "rotors, gears and armatures",
    weight: Dynamics,
    then: "their inertia is left out",
    find: |robot| {
        of_joints(robot, |j| first([&j.drive.rotor_inertia, &j.drive.armature].into_iter().filter(|x| acts(x))))
    },
    remove: |robot| {
        for drive in robot.joints.iter_mut().map(|joint| &mut joint.drive) {
            (drive.rotor_inertia, drive.gear_ratio, drive.armature) = (None, None, None);
        }
    },
};

/// Rotors with gears, where one number stands for both.
pub static ROTORS_AS_ARMATURES: Loss = Loss {
    what: "rotors and gears",
    weight: Form,
    then: "one number, `armature`, is written for both: J N²",
    find: |robot| of_joints(robot, |joint| first([&joint.drive.rotor_inertia])),
    remove: |robot| {
        for drive in robot.joints.iter_mut().map(|joint| &mut joint.drive) {
            let Some(rotor) = drive.rotor_inertia.take() else { continue };
            let ratio = drive.gear_ratio.take().map_or(Dd::ONE, |ratio| Dd::from(ratio.value));
            let reflected = (Dd::from(rotor.value) * ratio * ratio).to_f64();
            drive.armature = Some(Noted::new(reflected, rotor.place));
        }
    },
};

/// Another gravity than that of the Earth along −z.
pub static GRAVITY: Loss = Loss {
    what: "the direction or size of gravity",
    weight: Dynamics,
    then: "0 0 -9.81 counts, unless whoever reads the file is told",
    find: |robot| {
        let other = robot.gravity.iter().filter(|gravity| gravity.value != [0.0, 0.0, -9.81]);
        other.map(|gravity| (format!("{:?}", gravity.value), gravity.place.clone())).collect()
    },
    remove: |robot| robot.gravity = None,
};

/// Drives of joints.
pub static DRIVES: Loss = Loss {
    what: "drives",
    weight: Dynamics,
    then: "they are left out, with the inertia of their rotors",
    find: |robot| {
        let named = |name: &Noted<String>| (format!("drive `{}`", name.value), name.place.clone());
        robot.drives.iter().map(|drive| named(&drive.name)).collect()
    },
    remove: |robot| robot.drives.clear(),
};

/// Links that bend.
pub static FLEXIBLE_LINKS: Loss = Loss {
    what: "links that bend",
    weight: Dynamics,
    then: "they are rigid",
    find: |robot| robot.flexible.iter().map(|flexible| of_link(&flexible.link)).collect(),
    remove: |robot| robot.flexible.clear(),
};

/// Greatest velocities.
pub static VELOCITY_LIMITS: Loss = Loss {
    what: "velocity limits",
    weight: Data,
    then: "they are left out",
    find: |robot| of_joints(robot, |joint| first([&joint.limits.velocity])),
    remove: |robot| robot.joints.iter_mut().for_each(|joint| joint.limits.velocity = None),
};

/// Ranges that are open on one side.
pub static ONE_SIDED_RANGES: Loss = Loss {
    what: "ranges with one end",
    weight: Data,
    then: "these joints have no range",
    find: |robot| of_joints(robot, |joint| is_one_sided(joint).then(|| joint.name.place.clone())),
    remove: |robot| {
        for joint in robot.joints.iter_mut().filter(|joint| is_one_sided(joint)) {
            (joint.limits.lower, joint.limits.upper) = (None, None);
            joint.kind.value.has_range = false;
        }
    },
};

/// Greatest forces that are zero.
pub static ZERO_EFFORTS: Loss = Loss {
    what: "effort limits of zero",
    weight: Data,
    then: "they are left out",
    find: |robot| of_joints(robot, |joint| first([&joint.limits.effort].into_iter().filter(|effort| is_zero(effort)))),
    remove: |robot| {
        for limits in robot.joints.iter_mut().map(|joint| &mut joint.limits) {
            limits.effort.take_if(|effort| effort.value == 0.0);
        }
    },
};

/// Bodies that move and have no mass, in MJCF.
pub static BODIES_WITHOUT_MASS: Loss = Loss {
    what: "moving bodies without mass",
    weight: Data,
    then: "they are written, but MuJoCo itself refuses them",
    find: bodies_without_mass,
    remove: |_| (),
};

/// Bodies that move and have no mass, in SDF.
pub static BODIES_OF_MASS_ZERO: Loss = Loss {
    what: "moving bodies without mass",
    weight: Data,
    then: "they are written with mass 0, which engines of Gazebo may refuse",
    find: bodies_without_mass,
    remove: |_| (),
};

/// Tensors that belong to no body, in MJCF.
pub static INERTIAS_OF_NO_BODY: Loss = Loss {
    what: "inertias that no body has",
    weight: Data,
    then: "they are written, but MuJoCo itself refuses them unless `balanceinertia` or `boundinertia` changes them",
    find: |robot| inertias(robot, |mass, [least, _, _], is_out| mass > 0.0 && (least <= 0.0 || is_out)),
    remove: |_| (),
};

/// Tensors that belong to no body, in SDF, which has rods and points.
pub static INERTIAS_OUT_OF_BOUNDS: Loss = Loss {
    what: "inertias that no body has",
    weight: Data,
    then: "they are written, but `libsdformat` calls them invalid",
    find: |robot| inertias(robot, |_, [least, _, _], is_out| least < 0.0 || is_out),
    remove: |_| (),
};

/// Limits that URDF and SDF take for none.
pub static ENDLESS_LIMITS: Loss = Loss {
    what: "limits from 10¹⁶ on",
    weight: Data,
    then: "there they mean that there is none",
    find: |robot| {
        let far = |x: &&Option<Noted<f64>>| {
            x.as_ref().is_some_and(|x| x.value.is_finite() && !JointLimits::is_limit(x.value))
        };
        of_joints(robot, |joint| {
            let JointLimits { lower, upper, velocity, effort } = &joint.limits;
            first([lower, upper, velocity, effort].into_iter().filter(far))
        })
    },
    remove: |robot| {
        for limits in robot.joints.iter_mut().map(|joint| &mut joint.limits) {
            let JointLimits { lower, upper, velocity, effort } = limits;
            let ends =
                [(lower, -f64::INFINITY), (upper, f64::INFINITY), (velocity, f64::INFINITY), (effort, f64::INFINITY)];
            for (limit, endless) in ends {
                limit
                    .iter_mut()
                    .filter(|limit| !JointLimits::is_limit(limit.value))
                    .for_each(|limit| limit.value = endless);
            }
        }
    },
};

/// Names that SDF cannot have.
pub static UNFIT_NAMES: Loss = Loss {
    what: "names that are words of SDF, hold `::` or belong to a joint and a link",
    weight: Data,
    then: "`_` is written for `::`, and `_robot`, `_link`, `_frame` or `_joint` behind the others",
    find: |robot| {
        let named = |unfit: names::UnfitName| (format!("{} `{}`", unfit.of, unfit.name.value), unfit.name.place);
        names::unfit(robot).into_iter().map(named).collect()
    },
    remove: names::replace_unfit,
};

/// Links without mass that SDF has as frames.
pub static LINKS_AS_FRAMES: Loss = Loss {
    what: "links without mass on fixed joints",
    weight: Form,
    then: "frames are written, without a joint",
    find: |robot| sdf::links_as_frames(robot).into_iter().map(|link| of_link(&link.name)).collect(),
    remove: |_| (),
};

/// Links that only carry joints, where a format has some bodies with several.
pub static CARRIERS_OF_OTHERS: Loss = Loss {
    what: "bodies with several joints",
    weight: Form,
    then:
        "but for `universal` and `screw` a link with mass 0 is written between each joint and the next, and is a frame",
    find: |robot| sdf::carriers(robot).into_iter().map(|link| of_link(&link.name)).collect(),
    remove: |_| (),
};

/// The mass of the world.
pub static MASS_OF_THE_WORLD: Loss = Loss {
    what: "the mass of the world",
    weight: Form,
    then: "it is left out, as it moves nothing",
    find: |robot| {
        let inertial = robot.ground().and_then(|link| Some((link, link.inertial.as_ref()?)));
        inertial.map(|(link, inertial)| (of_link(&link.name).0, inertial.mass.place.clone())).into_iter().collect()
    },
    remove: |robot| {
        let world = robot.ground().map(|link| link.name.value.clone());
        let links = robot.links.iter_mut().filter(|link| Some(&link.name.value) == world.as_ref());
        links.for_each(|link| link.inertial = None);
    },
};

/// Names of joints that do not move.
pub static NAMES_OF_FIXED_JOINTS: Loss = Loss {
    what: "names of fixed joints",
    weight: Form,
    then: "bodies stand in bodies, without a joint",
    find: |robot| {
        let is_named = |joint: &&WrittenJoint| {
            joint.kind.value.between_links().is_none() && joint.name.value != format!("{}_fixed", joint.child.value)
        };
        let named = |joint: &WrittenJoint| (format!("joint `{}`", joint.name.value), joint.name.place.clone());
        robot.joints.iter().filter(is_named).map(named).collect()
    },
    remove: |_| (),
};

/// Couplings, which another program may hold only about.
pub static SOFT_COUPLINGS: Loss = Loss {
    what: "couplings",
    weight: Form,
    then: "`equality/joint` is written: exact here, a soft constraint in MuJoCo itself",
    find: |robot| {
        let named = |joint: &Noted<String>| (format!("joint `{}`", joint.value), joint.place.clone());
        robot.couplings.iter().map(|coupling| named(&coupling.joint)).collect()
    },
    remove: |_| (),
};

/// Ball joints.
pub static BALL_JOINTS: Loss = Loss {
    what: "ball joints",
    weight: Data,
    then: "type `spherical` is written, which Straightline reads and other programs may not",
    find: |robot| of_joints(robot, |joint| is_ball(joint).then(|| joint.name.place.clone())),
    remove: |_| (),
};

/// A base that floats.
pub static FLOATING_BASE: Loss = Loss {
    what: "floating bases",
    weight: Form,
    then: "the root link is the base: read the file with `--floating-base`",
    find: |robot| {
        let floats = robot.base.iter().filter(|base| base.value == BaseKind::Floating);
        floats.map(|base| (format!("robot `{}`", robot.name.value), base.place.clone())).collect()
    },
    remove: |_| (),
};

/// Damping of a base that floats.
pub static DAMPED_BASE: Loss = Loss {
    what: "damping of floating bases",
    weight: Dynamics,
    then: "the base moves without friction",
    find: |robot| {
        let damped = robot.base_damping.iter().filter(|damping| damping.value != 0.0);
        damped.map(|damping| (format!("robot `{}`", robot.name.value), damping.place.clone())).collect()
    },
    remove: |robot| robot.base_damping = None,
};

/// Damping of ball joints, of which SDF has axes alone.
pub static DAMPED_BALLS: Loss = Loss {
    what: "damping of ball joints",
    weight: Dynamics,
    then: "the joints turn without friction",
    find: |robot| {
        let damping = |joint: &WrittenJoint| joint.drive.damping.clone().filter(|d| is_ball(joint) && d.value != 0.0);
        of_joints(robot, |joint| damping(joint).map(|damping| damping.place))
    },
    remove: |robot| robot.joints.iter_mut().filter(|joint| is_ball(joint)).for_each(|joint| joint.drive.damping = None),
};

fn is_ball(joint: &WrittenJoint) -> bool {
    joint.kind.value.between_links().is_some_and(|kind| !kind.is_single())
}

/// Links that only carry joints, in a body that has several.
pub static CARRIERS: Loss = Loss {
    what: "bodies with several joints",
    weight: Form,
    then: "a link without mass is written between each joint and the next, and is a frame",
    find: |robot| robot.links.iter().filter(|link| link.is_carrier).map(|link| of_link(&link.name)).collect(),
    remove: |_| (),
};

/// Joints that do not stand at the frame of the link that they move.
pub static JOINTS_BESIDE_FRAMES: Loss = Loss {
    what: "joints beside the frames of their links",
    weight: Form,
    then: "a link without mass, `LINK_at_joint`, is written at the joint, and the link on it",
    find: |robot| of_joints(robot, |joint| joint.placement.is_beside_frame().then(|| joint.name.place.clone())),
    remove: |_| (),
};

/// Frames that are no links.
pub static NAMED_FRAMES: Loss = Loss {
    what: "frames",
    weight: Form,
    then: "links without mass are written, on fixed joints",
    find: |robot| {
        let named = |name: &Noted<String>| (format!("frame `{}`", name.value), name.place.clone());
        robot.frames.iter().map(|frame| named(&frame.name)).collect()
    },
    remove: |_| (),
};

/// What the reader skipped.
pub static SKIPPED: Loss = Loss {
    what: "things that the dynamics do not need",
    weight: Form,
    then: "they are left out",
    find: |robot| {
        let counted =
            |what: &str, count: usize| if count == 1 { what.to_string() } else { format!("{what} ({count})") };
        robot.ignored.iter().map(|skipped| (counted(&skipped.what, skipped.count), skipped.place.clone())).collect()
    },
    remove: |robot| robot.ignored.clear(),
};

fn bodies_without_mass(robot: &Description) -> Vec<(String, Place)> {
    let massive = with_mass(robot);
    let moving = robot.joints.iter().filter(|joint| joint.kind.value.between_links().is_some());
    let mut moved: HashSet<&str> = moving.map(|joint| joint.child.value.as_str()).collect();
    moved.extend(robot.root().filter(|_| robot.floats()).map(|root| root.name.value.as_str()));
    let is_bare = |link: &&WrittenLink| {
        let name = link.name.value.as_str();
        moved.contains(name) && !massive.contains(name) && !link.is_carrier
    };
    robot.links.iter().filter(is_bare).map(|link| of_link(&link.name)).collect()
}

/// Tensors of links, by the mass, the principal moments, and whether the greatest one is more than the sum of the others.
fn inertias(robot: &Description, is_of_none: impl Fn(f64, [f64; 3], bool) -> bool) -> Vec<(String, Place)> {
    let is_of_none = |own: &&WrittenInertial| {
        let moments = principal_moments(own.inertia.value);
        is_of_none(own.mass.value, moments, moments[2] > (moments[0] + moments[1]) * SLACK)
    };
    let of = |link: &WrittenLink| {
        let place = link.inertial.as_ref().filter(is_of_none)?.inertia.place.clone();
        Some((of_link(&link.name).0, place))
    };
    robot.links.iter().filter_map(of).collect()
}

/// Joints of which something stands somewhere.
fn of_joints(robot: &Description, find: impl Fn(&WrittenJoint) -> Option<Place>) -> Vec<(String, Place)> {
    let found = |joint: &WrittenJoint| Some((format!("joint `{}`", joint.name.value), find(joint)?));
    robot.joints.iter().filter_map(found).collect()
}

fn of_link(name: &Noted<String>) -> (String, Place) {
    (format!("link `{}`", name.value), name.place.clone())
}

/// Where the first of several values stands.
fn first<'a>(values: impl IntoIterator<Item = &'a Option<Noted<f64>>>) -> Option<Place> {
    values.into_iter().flatten().next().map(|value| value.place.clone())
}

fn is_zero(value: &Option<Noted<f64>>) -> bool {
    value.as_ref().is_some_and(|value| value.value == 0.0)
}

fn acts(value: &Option<Noted<f64>>) -> bool {
    value.as_ref().is_some_and(|value| value.value != 0.0)
}

/// Whether one end of a range is given and finite, and the other is not.
fn is_one_sided(joint: &WrittenJoint) -> bool {
    let is_end = |limit: &Option<Noted<f64>>| limit.as_ref().is_some_and(|limit| limit.value.is_finite());
    joint.kind.value.has_range && is_end(&joint.limits.lower) != is_end(&joint.limits.upper)
}

/// The links that have mass, or on which something is fixed that has.
fn with_mass(robot: &Description) -> HashSet<&str> {
    let is_fixed = |joint: &&WrittenJoint| joint.kind.value.between_links().is_none();
    let fixed = robot.joints.iter().filter(is_fixed);
    let below: HashMap<&str, &str> = fixed.map(|joint| (&*joint.child.value, &*joint.parent.value)).collect();
    let mut found = HashSet::new();
    for link in robot.links.iter().filter(|link| link.inertial.as_ref().is_some_and(|own| own.mass.value > 0.0)) {
        let mut next = Some(link.name.value.as_str());
        while let Some(name) = next.filter(|name| found.insert(*name)) {
            next = below.get(name).copied();
        }
    }
    found
}

impl Placement {
    /// Whether the joint does not stand at the frame of the link that it moves.
    pub fn is_beside_frame(&self) -> bool {
        match self {
            Placement::Frames { .. } => false,
            Placement::Vectors(JointVectors { r: arm, .. })
            | Placement::Anchored(AnchoredJoint { anchor: arm, .. }) => arm.value != [0.0; 3],
        }
    }
}
