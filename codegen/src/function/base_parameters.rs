//! Base parameters as they are said: their names and values.
//!
//! A name is the sum that the parameter is, with numbers where lengths and angles are numbers: `Izz2 + 0.31*my3 + 0.0961*m3`. Figures are of links, counted from 1
//! in the order of the joints: m, mx, my, mz of the first moment, Ixx … Izz of the inertia about the link's origin, all in the link's own axes; J, d, f,
//! o and k of the joint.

use super::{Extent, Function};
use std::fmt::Write;
use straightline_core::base_parameters::{BaseParameter, JointParameter, PER_BODY};
use straightline_core::model::Model;
use straightline_core::Dd;

/// Of the ten parameters of a link.
const SYMBOLS: [&str; PER_BODY] = ["m", "mx", "my", "mz", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz"];

/// Base parameters that a file has constants of.
pub struct BaseParameterList {
    /// What the names of the constants begin with.
    pub prefix: &'static str,
    /// What tells them apart, in words.
    pub what: &'static str,
    /// Their names.
    pub names: Vec<String>,
    /// Their values for the robot, without what a scene makes an input.
    pub values: Vec<f64>,
    /// What joints add to forces without a column, by its word in scenes, with the names of the joints.
    pub left_out: Vec<(&'static str, Vec<String>)>,
    /// Rows and columns of the entries of the regressor that are not zero everywhere, column by column.
    pub places: Vec<[usize; 2]>,
}

/// Those of a robot that some of these functions are about.
pub fn base_parameter_lists(model: &Model<Dd>, functions: &[Function]) -> Vec<BaseParameterList> {
    let of = model.link_parameters();
    let list = |prefix: &'static str, what: &'static str, parameters: &[BaseParameter]| BaseParameterList {
        prefix,
        what,
        names: parameters.iter().map(|parameter| name(model, parameter)).collect(),
        values: parameters.iter().map(|parameter| parameter.value(&of).to_f64()).collect(),
        left_out: Vec::new(),
        places: parameters.iter().enumerate().flat_map(|(k, p)| p.rows.iter().map(move |row| [*row, k])).collect(),
    };
    let is_wanted = |extents: &[Extent]| functions.iter().any(|f| extents.iter().any(|extent| f.has_axis(*extent)));
    let base = &model.base_parameters;
    let mut lists = Vec::new();
    if is_wanted(&[Extent::BaseParameters, Extent::RegressorEntries]) {
        let left_out = left_out(model);
        lists.push(BaseParameterList { left_out, ..list("BASE", "generalized forces", &base.of_forces) });
    }
    if is_wanted(&[Extent::SupportParameters]) {
        lists.push(list("SUPPORT", "the wrench on the support", &base.of_support));
    }
    lists
}

/// The sum that a parameter is, its own body's terms first, the greatest factors before others.
fn name(model: &Model<Dd>, parameter: &BaseParameter) -> String {
    let own = &model.bodies[parameter.body].joint;
    let rank = model.tree_joints().iter().position(|joint| joint.iv == own.iv).unwrap_or(0);
    let mut terms: Vec<(bool, f64, String)> = parameter
        .terms
        .iter()
        .map(|(place, factor)| {
            let (link, symbol) = symbol(model, *place);
            (link != rank, factor.to_f64(), format!("{symbol}{}", link + 1))
        })
        .collect();
    let order = |a: &(bool, f64, String), b: &(bool, f64, String)| {
        a.0.cmp(&b.0).then(b.1.abs().total_cmp(&a.1.abs())).then(a.2.cmp(&b.2))
    };
    terms.sort_by(order);
    let mut out = String::new();
    for (k, (_, factor, symbol)) in terms.iter().enumerate() {
        let sign = match (k, *factor < 0.0) {
            (0, false) => "",
            (0, true) => "-",
            (_, false) => " + ",
            (_, true) => " - ",
        };
        let size = factor.abs();
        let _ = match size == 1.0 {
            true => write!(out, "{sign}{symbol}"),
            false => write!(out, "{sign}{}*{symbol}", four_digits(size)),
        };
    }
    out
}

/// What joints add to generalized forces without a column, by its word in scenes, with the names of the joints.
fn left_out(model: &Model<Dd>) -> Vec<(&'static str, Vec<String>)> {
    let mut bodies: Vec<_> = model.bodies.iter().collect();
    bodies.sort_by_key(|body| body.joint.iv);
    let columns = &model.base_parameters.joint_parameters;
    let joints_with = |kind: JointParameter| -> Vec<String> {
        let with = bodies.iter().filter(|body| kind.value(&body.effects).to_f64() != 0.0);
        with.map(|body| body.joint.name.clone()).collect()
    };
    let kinds = JointParameter::EVERY.into_iter().filter(|kind| !columns.contains(kind));
    kinds.map(|kind| (kind.word(), joints_with(kind))).filter(|(_, joints)| !joints.is_empty()).collect()
}

/// A factor to four digits.
fn four_digits(x: f64) -> String {
    let rounded: f64 = format!("{x:.3e}").parse().unwrap_or(x);
    format!("{rounded}")
}

/// Of a number of the file: the rank of its link or joint, and its symbol.
fn symbol(model: &Model<Dd>, place: usize) -> (usize, &'static str) {
    let links = PER_BODY * model.bodies.len();
    if place < links {
        return (place / PER_BODY, SYMBOLS[place % PER_BODY]);
    }
    let joints = model.tree_joints();
    let single: Vec<usize> = (0..joints.len()).filter(|k| joints[*k].kind.is_single()).collect();
    let (kind, joint) = ((place - links) / single.len(), (place - links) % single.len());
    (single[joint], model.base_parameters.joint_parameters[kind].symbol())
}
