//! From the chapter's mass-centre notation to bodies in canonical joint frames: 20.1.2 and the appendix.
//!
//! Frame j is fixed to link j with its origin in the centre of mass C_j; frame 0 is the world. At q_j = 0 the pose of frame j
//! in frame j−1 follows from A⁰_{j−1,j} and the vectors to the joint: S_j = −r_{j−1,j} in frame j−1, and C_j = S_j + r_{j,j}.
//! The canonical frame of joint j stands in S_j (S''_j for a linear joint) with z along e_j. Vectors are as in the file:
//! `e`, `r`, `r_star` of link j in frame j (tilde above), `e_next`, … of link j−1 in frame j−1 (tilde below).

use super::flexible::{self, Carrier};
use super::geometry::{
    about, canonical_rotation, compose, magnitude, snap_rotation, snap_vector, turned, unit, vector,
};
use super::merge::{merge, Part};
use super::{angle, check, Assembly, ModelOptions, MOST_LINKS};
use crate::description::{messages, CentreOfMassEnd, CentreOfMassLink, CentreOfMassNotation, Description, Value};
use crate::diagnostic::Diagnostics;
use std::collections::BTreeMap;
use straightline_core::algorithms::composing_pays;
use straightline_core::model::{Body, Frame, Joint};
use straightline_core::spatial::{Mat3, SpatialInertia, Transform, Vec3};
use straightline_core::Dd;

/// A vector is parallel with the axis if the part of it across is relatively smaller.
const PARALLEL: f64 = 1e-9;

pub(super) fn assemble(
    chain: &CentreOfMassNotation,
    description: &Description,
    options: &ModelOptions,
    tolerance: f64,
    diagnostics: &mut Diagnostics,
) -> Option<Assembly> {
    if options.floating_base {
        let expected = "possible for a chain in mass-centre notation: link 0 has no mass";
        diagnostics.push(messages::bad_option("floating base", "true", expected));
    }
    if chain.links.is_empty() {
        diagnostics.push(messages::no_links(&description.name.value).at(&description.name.place));
        return None;
    }
    if chain.links.len() > MOST_LINKS {
        diagnostics.push(messages::too_many_links(chain.links.len(), MOST_LINKS).at(&description.name.place));
        return None;
    }
    check::unique("link", chain.links.iter().map(|l| &l.name), diagnostics);
    check::unique("joint", chain.links.iter().map(|l| &l.joint_name), diagnostics);
    if let Some(link) = chain.links.iter().find(|l| l.name.value == "tip") {
        diagnostics.push(messages::duplicate_name("frame or link", "tip").at(&link.name.place));
    }

    if let Some(e_next) = &chain.base.e_next {
        check::axis_length("`e_next` of [base]", e_next, diagnostics);
    }
    let mut assembly =
        Assembly { bodies: Vec::new(), joint_places: Vec::new(), frames: Vec::new(), links: BTreeMap::new() };
    let mut end = &chain.base;
    let mut end_owner = "[base]".to_string();
    // what carries link j−1; the poses are those of frame j−1
    let mut previous = Carrier::rigid(None, Transform::identity());
    if let Some(support) = options.support.as_ref().filter(|_| !options.rigid_links) {
        for body in flexible::support(support, "base", diagnostics)? {
            assembly.bodies.push(body);
            assembly.joint_places.push(support.place.place.clone());
        }
        let (body, placement) = (assembly.bodies.len().checked_sub(1), assembly.bodies.last()?.link_frame);
        previous = Carrier::rigid(body, placement);
        assembly.frames.push(Frame { name: "base".to_string(), body, placement });
    }
    let names: Vec<&str> = chain.links.iter().map(|link| link.name.value.as_str()).collect();
    let flexible = match options.rigid_links {
        true => Vec::new(),
        false => flexible::chosen(&description.flexible, &options.flexible, &names, diagnostics),
    };
    for (index, link) in chain.links.iter().enumerate() {
        check_link(link, description, diagnostics);
        let joint = joint_in_zero_position(&end_owner, end, link, tolerance, diagnostics);
        end = &link.end;
        end_owner = format!("link `{}`", link.name.value);
        let Some((r_previous_link, e_link)) = joint else { continue };
        let (Some(e), Some(r_previous)) = (unit(e_link), chain_vector(&chain.base, &chain.links, index)) else {
            continue;
        };
        let r_link_canonical = canonical_rotation(e);
        let x_previous_joint =
            Transform { rotation: snap_rotation(r_previous_link * r_link_canonical), translation: -vector(r_previous) };
        let r_jj = vector(link.r.value);
        let r_canonical_link = r_link_canonical.transpose();
        let com = snap_vector(r_canonical_link * r_jj, magnitude(r_jj));
        let inertia = link.inertia.value.map(Dd::from).rotated(&r_canonical_link);
        let x_canonical_link = Transform { rotation: r_canonical_link, translation: com };
        let (parent, x_body_previous) = previous.at(x_previous_joint.translation);
        let placement = compose(&x_body_previous, &x_previous_joint);
        let mass = Dd::from(link.mass.value);
        assembly.bodies.push(Body {
            name: link.name.value.clone(),
            parent,
            joint: Joint {
                name: link.joint_name.value.clone(),
                kind: link.kind.value.between_links()?,
                iq: 0,
                iv: 0,
                limits: check::model_limits(link.kind.value, &link.limits),
            },
            placement,
            dense: composing_pays(parent, &placement.rotation),
            effects: check::model_effects(&link.drive),
            load: None,
            inertia: SpatialInertia::new(mass, com, super::geometry::snap_tensor(inertia)),
            link_frame: x_canonical_link,
        });
        assembly.joint_places.push(link.joint_name.place.clone());
        let body = assembly.bodies.len() - 1;
        previous = Carrier::rigid(Some(body), x_canonical_link);
        if let Some(flexible) = flexible.iter().find(|flexible| flexible.link.value == link.name.value) {
            let whole = Part { mass, com: Vec3::zero(), inertia_com: link.inertia.value.map(Dd::from) };
            let (carrier, next) = (previous.first(), assembly.bodies.len());
            if let Some(cut) = flexible::cut(flexible, carrier, -r_jj, Some(whole), next, diagnostics) {
                let placed = |p: Part| Part::placed(p.mass, p.com, p.inertia_com, &x_canonical_link);
                assembly.bodies[body].inertia = merge(&cut.first.map(placed).into_iter().collect::<Vec<_>>());
                for (body, part) in cut.bodies {
                    assembly.bodies.push(Body { inertia: merge(&part.into_iter().collect::<Vec<_>>()), ..body });
                    assembly.joint_places.push(flexible.link.place.clone());
                }
                previous = cut.carrier;
            }
        }
        let (body, placement) = previous.at(Vec3::zero());
        assembly.links.insert(link.name.value.clone(), previous.clone());
        assembly.frames.push(Frame { name: link.name.value.clone(), body, placement });
    }
    let last = chain.links.last()?;
    for (key, given) in [("e_next", &last.end.e_next), ("r_next_star", &last.end.r_next_star)] {
        if let Some(given) = given {
            diagnostics.push(messages::e_next_on_last(&last.name.value, key).at(&given.place));
        }
    }
    if diagnostics.has_errors() {
        return None;
    }
    if let Some(r_next) = &last.end.r_next {
        // tip = C_n − r_{n,n+1}
        let x_link_tip = Transform { rotation: Mat3::identity(), translation: -vector(r_next.value) };
        let (body, x_body_previous) = previous.at(x_link_tip.translation);
        let placement = compose(&x_body_previous, &x_link_tip);
        assembly.frames.push(Frame { name: "tip".to_string(), body, placement });
        assembly.links.insert("tip".to_string(), Carrier::rigid(body, placement));
    }
    Some(assembly)
}

/// r_{j−1,j} of link `index` (counted from 0).
fn chain_vector(base: &CentreOfMassEnd, links: &[CentreOfMassLink], index: usize) -> Option<[f64; 3]> {
    let end = index.checked_sub(1).map_or(base, |i| &links[i].end);
    end.r_next.as_ref().map(|r| r.value)
}

fn check_link(link: &CentreOfMassLink, description: &Description, diagnostics: &mut Diagnostics) {
    let name = &link.name.value;
    check::inertial(name, &link.mass, &link.inertia, diagnostics);
    check::limits(&link.joint_name, link.kind.value, &link.limits, description.format, diagnostics);
    check::drive(&link.joint_name, &link.drive, diagnostics);
    check::axis_length(&format!("`e` of link `{name}`"), &link.e, diagnostics);
    if let Some(e_next) = &link.end.e_next {
        check::axis_length(&format!("`e_next` of link `{name}`"), e_next, diagnostics);
    }
    match (&link.alpha, slides(link)) {
        (None, true) => {
            diagnostics.push(messages::alpha_missing(&link.joint_name.value).at(&link.kind.place));
        }
        (Some(alpha), false) if alpha.value != 0.0 => {
            diagnostics.push(messages::alpha_on_revolute(&link.joint_name.value).at(&alpha.place));
        }
        _ => {}
    }
}

fn slides(link: &CentreOfMassLink) -> bool {
    link.kind.value.kind.is_some_and(|kind| kind.slides())
}

/// A_{j−1,j} at q_j = 0, and e_j in frame j; `None` after a complaint.
///
/// ```text
/// a_j = −e_j × (r_{j−1,j} × e_j) / |…|  in frame j−1,   a_j = e_j × (r_{j,j} × e_j) / |…|  in frame j     (20.101)
/// b_j = e_j × a_j                                                                                        (20.102)
/// A⁰_{j−1,j} = [e_j a_j b_j] [ẽ_j ã_j b̃_j]ᵀ                                                             (20.106)
/// ```
///
/// The second matrix of (20.106) is orthogonal, so its inverse is its transpose. A linear joint is turned by α_j about e_j
/// for good: (20.108) with α_j for q_j.
fn joint_in_zero_position(
    end_owner: &str,
    end: &CentreOfMassEnd,
    link: &CentreOfMassLink,
    tolerance: f64,
    diagnostics: &mut Diagnostics,
) -> Option<(Mat3<Dd>, Vec3<Dd>)> {
    let owner = format!("link `{}`", link.name.value);
    let lower = across(&owner, ("r", &link.r), ("e", &link.e), ("r_star", &link.r_star), diagnostics);
    let (e_next, r_next) = (end.e_next.as_ref()?, end.r_next.as_ref()?);
    let star = ("r_next_star", &end.r_next_star);
    let upper = across(end_owner, ("r_next", r_next), ("e_next", e_next), star, diagnostics);
    let ((e_link, a_link), (e_previous, minus_a_previous)) = (lower?, upper?);
    let a_previous = -minus_a_previous;
    let in_previous = Mat3::from_columns(e_previous, a_previous, e_previous.cross(a_previous));
    let in_link = Mat3::from_columns(e_link, a_link, e_link.cross(a_link));
    let extended = snap_rotation(in_previous * in_link.transpose());
    let turn = match (&link.alpha, slides(link)) {
        (Some(alpha), true) => about(e_previous, angle::read(alpha, tolerance).sin_cos),
        _ => Mat3::identity(),
    };
    Some((compose(&turned(turn), &turned(extended)).rotation, e_link))
}

/// The unit vectors e, and along the part of r (or of r*) across it: e × (r × e) / |…| = (r − (e·r) e) / |…|.
fn across(
    owner: &str,
    (r_key, r): (&str, &Value<[f64; 3]>),
    (e_key, e): (&str, &Value<[f64; 3]>),
    (star_key, star): (&str, &Option<Value<[f64; 3]>>),
    diagnostics: &mut Diagnostics,
) -> Option<(Vec3<Dd>, Vec3<Dd>)> {
    let e_unit = unit(vector(e.value))?;
    let used = star.as_ref().unwrap_or(r);
    // scaled to length 1 first, so that the threshold is relative
    let part = unit(vector(used.value)).map(|r| e_unit.cross(r.cross(e_unit)));
    match part.filter(|part| magnitude(*part) > PARALLEL).and_then(|part| unit(snap_vector(part, 1.0))) {
        Some(a) => Some((e_unit, a)),
        None => {
            let complaint = messages::specificity(owner, r_key, e_key, star_key, star.is_some());
            diagnostics.push(complaint.at(&used.place));
            None
        }
    }
}
