//! Robots of the reference data in `joints/robots/*.xml`: bodies with joints in them, read as the data's README says, straight into a model.

use straightline_core::algorithms::composing_pays;
use straightline_core::joint::FLOATING_BASE;
use straightline_core::model::{Body, Frame, Joint, JointEffects, JointKind, Limits, Model};
use straightline_core::spatial::{Mat3, SpatialInertia, Sym3, Transform, Vec3};
use straightline_core::Dd;

/// An element as it is written: its name, whether it ends here, and its attributes.
struct Tag<'a> {
    name: &'a str,
    is_closed: bool,
    attributes: Vec<(&'a str, &'a str)>,
}

impl Tag<'_> {
    fn get(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(key, _)| *key == name).map(|(_, value)| *value)
    }

    /// Numbers of an attribute: the nearest f64 of their text.
    fn numbers<const N: usize>(&self, name: &str) -> Option<[Dd; N]> {
        let numbers: Vec<Dd> =
            self.get(name)?.split_whitespace().map(|x| Dd::from(x.parse::<f64>().expect("a number"))).collect();
        Some(numbers.try_into().expect("as many numbers as are meant"))
    }

    fn vector(&self, name: &str) -> Vec3<Dd> {
        self.numbers::<3>(name).map_or(Vec3::zero(), Vec3::from)
    }

    /// R of `quat`, (w, x, y, z) of any length.
    fn rotation(&self) -> Mat3<Dd> {
        let [w, x, y, z] = self.numbers("quat").unwrap_or([Dd::ONE, Dd::ZERO, Dd::ZERO, Dd::ZERO]);
        let (u, two) = (Vec3::new(x, y, z), Dd::from(2.0) / (w * w + x * x + y * y + z * z));
        let turned = |k: usize| {
            let e = Vec3::from([0, 1, 2].map(|i| if i == k { Dd::ONE } else { Dd::ZERO }));
            e + (u.cross(e).scale(w) + u.cross(u.cross(e))).scale(two)
        };
        Mat3::from_columns(turned(0), turned(1), turned(2))
    }
}

fn tags(text: &str) -> Vec<Tag<'_>> {
    text.split('<').skip(1).map(|rest| tag(rest.split('>').next().expect("a tag ends"))).collect()
}

fn tag(inside: &str) -> Tag<'_> {
    let is_closed = inside.ends_with('/');
    let (name, mut rest) = inside.trim_end_matches('/').split_once(' ').unwrap_or((inside, ""));
    let mut attributes = Vec::new();
    while let Some((key, after)) = rest.split_once("=\"") {
        let (value, further) = after.split_once('"').expect("a value ends");
        attributes.push((key.trim(), value));
        rest = further;
    }
    Tag { name, is_closed, attributes }
}

/// z along the axis, x across it.
fn axes_along(axis: Vec3<Dd>) -> Mat3<Dd> {
    let unit = |v: Vec3<Dd>| v.scale(Dd::ONE / v.dot(v).sqrt());
    let z = unit(axis);
    let across = if z.x.abs().hi() < 0.6 { Vec3::new(Dd::ONE, Dd::ZERO, Dd::ZERO) } else { Vec3::unit_z() };
    let y = unit(z.cross(across));
    Mat3::from_columns(y.cross(z), y, z)
}

/// A body while its elements are read.
struct Open {
    name: String,
    parent: Option<usize>,
    /// Of the body in the parent's, at zero.
    pose: Transform<Dd>,
    /// Its index, once its joint was read.
    body: Option<usize>,
}

/// The robot of a file whose bodies have one joint each.
pub fn robot(text: &str) -> Model<Dd> {
    let mut model = Model {
        name: String::new(),
        bodies: vec![],
        gravity: Vec3::zero(),
        frames: vec![],
        drives: vec![],
        couplings: vec![],
        closure: Default::default(),
        base_parameters: Default::default(),
    };
    let (mut iq, mut iv) = (0, 0);
    let mut open: Vec<Open> = Vec::new();
    for tag in tags(text) {
        match tag.name {
            "mujoco" => model.name = tag.get("model").expect("a name").to_string(),
            "option" => model.gravity = tag.vector("gravity"),
            "body" => {
                let pose = Transform { rotation: tag.rotation(), translation: tag.vector("pos") };
                let parent = open.last().and_then(|above: &Open| above.body);
                open.push(Open { name: tag.get("name").expect("a name").into(), parent, pose, body: None });
            }
            "/body" => {
                open.pop();
            }
            "joint" | "freejoint" => {
                let own = open.last_mut().expect("a joint stands in a body");
                let kind = match (tag.name, tag.get("type")) {
                    ("freejoint", _) => FLOATING_BASE,
                    (_, Some("ball")) => JointKind::Spherical,
                    (_, Some("slide")) => JointKind::Prismatic,
                    _ => JointKind::Revolute,
                };
                // the joint's canonical frame in the body's at zero
                let seat = Transform {
                    rotation: if kind.row().has_axis { axes_along(tag.vector("axis")) } else { Mat3::identity() },
                    translation: tag.vector("pos"),
                };
                let above = own.parent.map_or(Transform::identity(), |p| model.bodies[p].link_frame);
                let placement = match kind.is_base() {
                    true => Transform::identity(),
                    false => above.compose(&own.pose).compose(&seat),
                };
                let link_frame = seat.inverse();
                own.body = Some(model.bodies.len());
                model.frames.push(Frame { name: own.name.clone(), body: own.body, placement: link_frame });
                let name = tag.get("name").expect("a name").to_string();
                model.bodies.push(Body {
                    name: own.name.clone(),
                    parent: own.parent,
                    joint: Joint { name, kind, iq, iv, limits: Limits::default() },
                    dense: composing_pays(own.parent, &placement.rotation),
                    placement,
                    inertia: SpatialInertia::zero(),
                    link_frame,
                    effects: JointEffects::none(),
                    load: None,
                });
                (iq, iv) = (iq + kind.nq(), iv + kind.nv());
            }
            "inertial" => {
                let body = open.last().and_then(|own| own.body).expect("the joint stands before the inertial");
                let body = &mut model.bodies[body];
                let o = Dd::ZERO;
                let [xx, yy, zz, xy, xz, yz] = tag.numbers("fullinertia").unwrap_or_else(|| {
                    let [x, y, z] = tag.numbers("diaginertia").expect("one of both");
                    [x, y, z, o, o, o]
                });
                let tensor = Sym3 { xx, xy, xz, yy, yz, zz }.rotated(&tag.rotation());
                let [mass] = tag.numbers("mass").expect("a mass");
                let (r, p) = (body.link_frame.rotation, body.link_frame.translation);
                body.inertia = SpatialInertia::new(mass, r * tag.vector("pos") + p, tensor.rotated(&r));
            }
            _ => assert!(
                tag.is_closed || tag.name.starts_with('/') || tag.name == "worldbody",
                "{} is unknown",
                tag.name
            ),
        }
    }
    model
}
