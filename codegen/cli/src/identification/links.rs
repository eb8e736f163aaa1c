//! How base parameters are made of what a robot file says of links and joints.

use super::regressor::RegressorModel;
use straightline_codegen::convert::renumber::NewInertial;
use straightline_codegen::description::{Description, WrittenInertial};
use straightline_core::base_parameters::{JointParameter, PER_BODY};
use straightline_core::model::{Body, Load, Model};
use straightline_core::spatial::Sym3;
use straightline_core::Dd;
use straightline_logs::consistent::{is_body, thickened};

/// Moments about the centre of mass are at least those of a ball that small \[m\].
const THINNEST: f64 = 1e-3;
/// Digits that are written.
const DIGITS: usize = 9;
/// What is nothing, as a part of the numbers beside it.
pub(super) const DUST: f64 = 1e-9;

/// A link whose numbers are looked for.
#[derive(Clone, Debug, PartialEq)]
pub struct IdentifiedLink {
    /// Its name.
    pub name: String,
    /// m, m c, I about the origin of its frame, in its axes, as the file has them.
    pub written: [f64; PER_BODY],
    /// The nearest that a body can have.
    pub known: [f64; PER_BODY],
}

/// A parameter of a joint that is looked for.
#[derive(Clone, Debug, PartialEq)]
pub struct IdentifiedJoint {
    /// The joint's name.
    pub name: String,
    /// The force that shows it: the joint's, or that of the joint which it follows.
    pub row: usize,
    /// What it is.
    pub kind: JointParameter,
    /// What the file has.
    pub by_file: f64,
}

/// How base parameters are made.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkMap {
    /// Links with mass that move.
    pub links: Vec<IdentifiedLink>,
    /// Joints' parameters, kind by kind.
    pub joints: Vec<IdentifiedJoint>,
    /// Rows of a number per base parameter: ten columns per link, then one per parameter of a joint.
    pub made_of: Vec<Vec<f64>>,
    /// What is added: of masses that are not looked for.
    pub rest: Vec<f64>,
}

fn written(inertial: &WrittenInertial) -> [f64; PER_BODY] {
    let turn = inertial.turn();
    let (m, c) = (inertial.mass.value, inertial.com.value);
    let about_com = inertial.inertia.value.rotated(&turn);
    let [x, y, z] = c;
    [
        m,
        m * x,
        m * y,
        m * z,
        about_com.xx + m * (y * y + z * z),
        about_com.xy - m * x * y,
        about_com.xz - m * x * z,
        about_com.yy + m * (x * x + z * z),
        about_com.yz - m * y * z,
        about_com.zz + m * (x * x + y * y),
    ]
}

impl LinkMap {
    /// The links of a description whose robot this is.
    pub fn of(robot: &RegressorModel, description: &Description) -> LinkMap {
        let model = &robot.exact;
        let link = |link: &straightline_codegen::description::WrittenLink| {
            let name = link.name.value.clone();
            model.frame(&name)?.body?;
            let written = written(link.inertial.as_ref()?);
            let known = if is_body(&written) { written } else { thickened(&written, THINNEST)? };
            Some(IdentifiedLink { name, written, known })
        };
        let links: Vec<IdentifiedLink> = description.links.iter().filter_map(link).collect();
        let joints = joints(model, &robot.kinds);
        let columns = columns(model, &links, joints.len());
        let made_of: Vec<Vec<f64>> = robot
            .parameters()
            .iter()
            .map(|parameter| columns.iter().map(|column| parameter.value(column).to_f64()).collect())
            .collect();
        let by_file = |row: &Vec<f64>| {
            let numbers = links.iter().flat_map(|link| link.written).chain(joints.iter().map(|joint| joint.by_file));
            row.iter().zip(numbers).map(|(y, x)| y * x).sum::<f64>()
        };
        let rest = robot.nominal.iter().zip(&made_of).map(|(value, row)| value - by_file(row)).collect();
        LinkMap { links, joints, made_of, rest }
    }

    /// Base parameters of these links and parameters of joints.
    pub fn base_parameters(&self, bodies: &[[f64; PER_BODY]], joints: &[f64]) -> Vec<f64> {
        let value = |(row, rest): (&Vec<f64>, &f64)| {
            let numbers = bodies.iter().flatten().chain(joints);
            rest + row.iter().zip(numbers).map(|(y, x)| y * x).sum::<f64>()
        };
        self.made_of.iter().zip(&self.rest).map(value).collect()
    }
}

/// The parameters of joints, kind by kind, as base parameters are made of them. Joints with several coordinates have none.
fn joints(model: &Model<Dd>, kinds: &[JointParameter]) -> Vec<IdentifiedJoint> {
    let order = model.bodies_in_order();
    let singles = || order.iter().map(|b| (*b, &model.bodies[*b])).filter(|(_, body)| body.joint.kind.is_single());
    let of_kind = |kind: &JointParameter| {
        let of_joint = |(b, body): (usize, &Body<Dd>)| {
            let source = model.coupling_of(b).map_or(b, |coupling| coupling.source);
            let (name, row) = (body.joint.name.clone(), model.bodies[source].joint.iv);
            IdentifiedJoint { name, row, kind: *kind, by_file: kind.value(&body.effects).to_f64() }
        };
        singles().map(of_joint).collect::<Vec<_>>()
    };
    kinds.iter().flat_map(of_kind).collect()
}

/// What base parameters are made of, for a unit of each parameter of the links in turn, then of each joint's.
fn columns(model: &Model<Dd>, links: &[IdentifiedLink], joints: usize) -> Vec<Vec<Dd>> {
    let order = model.bodies_in_order();
    let length = PER_BODY * model.bodies.len();
    let nothing = vec![Dd::ZERO; length + joints];
    let mut columns = Vec::with_capacity(PER_BODY * links.len() + joints);
    for link in links {
        let frame = model.frame(&link.name).expect("links that move have frames");
        let body = frame.body.expect("it moves");
        let rank = order.iter().position(|own| *own == body).expect("all bodies are there");
        for k in 0..PER_BODY {
            let unit = Load::from_inertial_parameters(std::array::from_fn(|j| if j == k { Dd::ONE } else { Dd::ZERO }));
            let unit = unit.seen_from(&frame.placement).seen_from(&model.bodies[body].link_frame.inverse());
            let mut column = nothing.clone();
            column[PER_BODY * rank..][..PER_BODY].copy_from_slice(&unit.to_inertial_parameters());
            columns.push(column);
        }
    }
    columns.extend((0..joints).map(|k| {
        let mut column = nothing.clone();
        column[length + k] = Dd::ONE;
        column
    }));
    columns
}

/// Rounded to the digits that are written.
pub fn rounded(x: f64) -> f64 {
    format!("{x:.*e}", DIGITS - 1).parse().unwrap_or(x)
}

/// Zero in place of what is nothing beside numbers of this size.
fn no_dust(x: f64, size: f64) -> f64 {
    if x.abs() < DUST * size {
        0.0
    } else {
        x
    }
}

/// What a file is to have for a link.
pub fn new_inertial(link: &str, body: &[f64; PER_BODY]) -> NewInertial {
    let [m, hx, hy, hz, xx, xy, xz, yy, yz, zz] = *body;
    let mass = rounded(m);
    // a link as large as its inertia, where its centre of mass is its origin
    let length = (hx.hypot(hy).hypot(hz) / m).max(((xx + yy + zz).max(0.0) / m).sqrt());
    let com = [hx, hy, hz].map(|h| no_dust(rounded(h / m), length));
    // about the centre of mass that is written: I − m (c·c 1 − c cᵀ)
    let [x, y, z] = com;
    let inertia = Sym3 {
        xx: xx - mass * (y * y + z * z),
        xy: xy + mass * x * y,
        xz: xz + mass * x * z,
        yy: yy - mass * (x * x + z * z),
        yz: yz + mass * y * z,
        zz: zz - mass * (x * x + y * y),
    };
    let size = inertia.xx + inertia.yy + inertia.zz;
    NewInertial { link: link.to_string(), mass, com, inertia: inertia.map(|x| no_dust(rounded(x), size)) }
}
