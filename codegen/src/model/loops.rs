//! Closed loops, from names to equations: where the bodies meet (`meeting`), in which configurations, and which joints follow from which loops.
//!
//! Joints that loops determine are chosen by the rank of the equations' columns in closed configurations, which Newton's method finds from poses within the
//! joints' ranges: those that nothing drives first, and of those the last of the file.

mod meeting;

use self::meeting::LoopMeeting;
use super::dyads::dyad_of;
use super::{Assembly, ModelOptions};
use crate::description::angle::{self, ROUNDING};
use crate::description::{messages, Description, Noted, PoseCoordinate, WrittenLoop};
use crate::diagnostic::Diagnostics;
use straightline_core::algorithms as alg;
use straightline_core::closure::{ClosedLoop, Closure, LoopGroup};
use straightline_core::model::{Body, BodyId, Model};
use straightline_core::random::Random;
use straightline_core::spatial::Vec3;
use straightline_core::Dd;

/// So many closed configurations are looked for.
const CONFIGURATIONS: usize = 6;
/// From so many poses.
const POSES: usize = 60;
/// In so many steps of Newton's method from each.
const STEPS: usize = 60;
/// How near points have to come, of the size of the robot.
const CLOSED: f64 = 1e-11;
/// How much of a joint's column the columns before it must leave in every closed configuration, and in some, so that the loop determines it.
const WELL_LEFT: [f64; 2] = [1e-2, 1e-7];
/// More loops than these are solved at once.
const MOST_TRIED: usize = 12;

/// The loops of a robot whose joints have their places as if there were none. Complaints go to `diagnostics`.
pub(super) fn resolve(
    description: &Description,
    options: &ModelOptions,
    assembly: &Assembly,
    model: &Model<Dd>,
    diagnostics: &mut Diagnostics,
) -> Closure<Dd> {
    let written: Vec<&WrittenLoop> = description.loops.iter().filter(|_| !options.open_loops).collect();
    let zero = pose_of_file(description, model);
    let (mut loops, mut meetings) = (Vec::new(), Vec::new());
    for own in &written {
        let Some(meeting) = LoopMeeting::of(own, assembly, model, &zero, diagnostics) else { continue };
        if meeting.ends[0].body == meeting.ends[1].body {
            diagnostics.push(messages::loop_within_body(&own.name.value).at(&own.name.place));
            continue;
        }
        loops.push(meeting.equations(own, model, &zero));
        meetings.push(meeting);
    }
    if loops.len() < written.len() || loops.is_empty() || diagnostics.has_errors() {
        return Closure::default();
    }
    let equations = LoopEquations::new(model.cast(), &loops, meetings, &zero);
    if equations.configurations.is_empty() {
        for (own, gap) in written.iter().zip(&equations.least) {
            diagnostics.push(messages::loop_open(&own.name.value, *gap).at(&own.name.place));
        }
        return Closure::default();
    }
    let Some(dependents) = dependents(description, &written, &equations, model, diagnostics) else {
        return Closure::default();
    };
    let groups = groups(&loops, &dependents, model);
    let home = equations.configurations[0].iter().map(|x| Dd::from(*x)).collect();
    Closure { loops, groups, home }
}

/// The coordinates of the tree in the pose that the file shows.
pub(crate) fn pose_of_file(description: &Description, model: &Model<Dd>) -> Vec<Dd> {
    let mut zero = vec![Dd::ZERO; model.nq()];
    for joint in model.free_joints() {
        if let Some(w) = joint.kind.row().quaternion {
            zero[joint.iq + w + 3] = Dd::ONE;
        }
        match description.reference_of(&joint.name) {
            Some(PoseCoordinate::Angle(angle)) => zero[joint.iq] = angle::in_radians(angle, ROUNDING),
            Some(PoseCoordinate::Length(length)) => zero[joint.iq] = Dd::from(length.value),
            None => {}
        }
    }
    zero
}

/// The equations of all loops in numbers.
struct LoopEquations {
    model: Model<f64>,
    loops: Vec<ClosedLoop<f64>>,
    meetings: Vec<LoopMeeting>,
    /// Where all loops are closed; the first is nearest to the pose of the file.
    configurations: Vec<Vec<f64>>,
    /// How near the points of each loop came \[m\].
    least: Vec<f64>,
}

impl LoopEquations {
    fn new(model: Model<f64>, loops: &[ClosedLoop<Dd>], meetings: Vec<LoopMeeting>, zero: &[Dd]) -> LoopEquations {
        let zero: Vec<f64> = zero.iter().map(|x| x.to_f64()).collect();
        let closure = Closure { loops: loops.to_vec(), groups: Vec::new(), home: Vec::new() };
        let loops = closure.map(|x| x.to_f64()).loops;
        let mut all = LoopEquations { model, loops, meetings, configurations: Vec::new(), least: Vec::new() };
        let mut random = Random(0x10_09);
        for pose in 0..POSES {
            let start = if pose == 0 { zero.clone() } else { all.near(&zero, &mut random) };
            let (q, gaps) = all.closed(start);
            let is_closed = gaps.iter().all(|gap| *gap <= CLOSED * all.size()) && all.is_turned_right(&q);
            if is_closed {
                all.configurations.push(q);
            }
            let least = |own: &f64, gap: &f64| own.min(*gap);
            all.least = match all.least.is_empty() {
                true => gaps,
                false => all.least.iter().zip(&gaps).map(|(own, gap)| least(own, gap)).collect(),
            };
            if all.configurations.len() == CONFIGURATIONS {
                break;
            }
        }
        all
    }

    /// The largest length between joints \[m\].
    fn size(&self) -> f64 {
        let of = |v: Vec3<f64>| v.dot(v).sqrt();
        let placed = self.model.bodies.iter().map(|body| of(body.placement.translation));
        placed.chain(self.loops.iter().flat_map(|l| l.ends.map(|end| of(end.point)))).fold(1e-3, f64::max)
    }

    /// A pose near another one, within the ranges of the joints.
    fn near(&self, zero: &[f64], random: &mut Random) -> Vec<f64> {
        let mut v = vec![0.0; self.model.nv()];
        for joint in self.model.free_joints() {
            let unit = if joint.kind.slides() { self.size() } else { 1.0 };
            for k in 0..joint.kind.nv() {
                let at = if joint.kind.is_single() { zero[joint.iq] } else { 0.0 };
                let (lower, upper) = (joint.limits.lower - at, joint.limits.upper - at);
                v[joint.iv + k] = random.symmetric(0.4 * unit).max(0.8 * lower).min(0.8 * upper);
            }
        }
        alg::integrate(&self.model, zero, &v)
    }

    /// Gaps of all loops, one after the other, and the rows of their rates: those of vectors at the arm of the robot's size.
    fn at(&self, q: &[f64]) -> (Vec<f64>, Vec<Vec<f64>>) {
        let y = self.model.tree_positions(q);
        let rows = |l: &ClosedLoop<f64>| {
            let arms = std::iter::repeat_n(1.0, l.directions.len()).chain(std::iter::repeat(self.size()));
            let rows = self.model.gap_rows(l, &y).into_iter().zip(arms);
            rows.map(|(row, arm)| row.iter().map(|x| arm * x).collect()).collect::<Vec<Vec<f64>>>()
        };
        (self.loops.iter().flat_map(|l| self.gap(l, &y)).collect(), self.loops.iter().flat_map(rows).collect())
    }

    /// The gap of a loop \[m\], of vectors at the arm of the robot's size.
    fn gap(&self, of: &ClosedLoop<f64>, y: &[f64]) -> Vec<f64> {
        let mut gap = self.model.gap(of, y);
        gap.iter_mut().skip(of.directions.len()).for_each(|lean| *lean *= self.size());
        gap
    }

    /// Whether bodies stand as they are joined, and not turned over.
    fn is_turned_right(&self, q: &[f64]) -> bool {
        self.loops.iter().zip(&self.meetings).all(|(of, meeting)| meeting.is_turned_right(of, &self.model, q))
    }

    /// Where Newton's method leads, by the shortest steps, and how far the points of each loop are apart there.
    fn closed(&self, mut q: Vec<f64>) -> (Vec<f64>, Vec<f64>) {
        for _ in 0..STEPS {
            let (gaps, rows) = self.at(&q);
            let square = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            let mut normal: Vec<Vec<f64>> = rows.iter().map(|a| rows.iter().map(|b| square(a, b)).collect()).collect();
            let trace: f64 = (0..normal.len()).map(|i| normal[i][i]).sum();
            if trace == 0.0 {
                break; // no joint moves the points against each other
            }
            let far = square(&gaps, &gaps).sqrt() / self.size();
            (0..normal.len()).for_each(|i| normal[i][i] += trace * (1e-14 + 1e-2 * far * far));
            let multipliers = eliminated(normal, gaps);
            let mut v: Vec<f64> = vec![0.0; self.model.nv()];
            for (row, x) in rows.iter().zip(&multipliers) {
                v.iter_mut().zip(row).for_each(|(v, entry)| *v -= entry * x);
            }
            let longest = v.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
            let held = if longest > 0.5 { 0.5 / longest } else { 1.0 };
            v.iter_mut().for_each(|x| *x *= held);
            q = alg::integrate(&self.model, &q, &v);
        }
        let y = self.model.tree_positions(&q).into_owned();
        let apart = |l: &ClosedLoop<f64>| self.gap(l, &y).iter().map(|x| x * x).sum::<f64>().sqrt();
        let gaps = self.loops.iter().map(apart).collect();
        (q, gaps)
    }

    /// In each closed configuration, the columns of every velocity coordinate.
    fn columns(&self) -> Vec<Vec<Vec<f64>>> {
        let of = |q: &Vec<f64>| {
            let rows = self.at(q).1;
            (0..self.model.nv()).map(|k| rows.iter().map(|row| row[k]).collect()).collect()
        };
        self.configurations.iter().map(of).collect()
    }
}

/// x of A x = b by elimination with the largest pivots.
fn eliminated(mut a: Vec<Vec<f64>>, mut b: Vec<f64>) -> Vec<f64> {
    let n = b.len();
    for k in 0..n {
        let pivot = (k..n).max_by(|i, j| a[*i][k].abs().total_cmp(&a[*j][k].abs())).expect("rows are left");
        a.swap(k, pivot);
        b.swap(k, pivot);
        for i in k + 1..n {
            let factor = a[i][k] / a[k][k];
            let (above, below) = a.split_at_mut(i);
            below[0].iter_mut().zip(&above[k]).for_each(|(x, y)| *x -= factor * y);
            b[i] -= factor * b[k];
        }
    }
    for k in (0..n).rev() {
        let known: f64 = (k + 1..n).map(|j| a[k][j] * b[j]).sum();
        b[k] = (b[k] - known) / a[k][k];
    }
    b
}

/// The bodies whose joints the loops determine, of as many coordinates as there are equations; `None` after a complaint.
fn dependents(
    description: &Description,
    written: &[&WrittenLoop],
    equations: &LoopEquations,
    model: &Model<Dd>,
    diagnostics: &mut Diagnostics,
) -> Option<Vec<BodyId>> {
    let (asked, mut order) =
        (asked(written, equations, model, diagnostics)?, candidates(description, equations, model));
    order.retain(|b| !asked.iter().any(|(_, own)| own == b));
    let rows: usize = equations.loops.iter().map(ClosedLoop::equations).sum();
    let mut chosen = DependentChoice {
        bases: equations.columns().into_iter().map(|columns| TakenColumns { columns, basis: Vec::new() }).collect(),
    };
    let mut found: Vec<BodyId> = Vec::new();
    for (name, b) in &asked {
        if !chosen.takes(&model.bodies[*b], WELL_LEFT[1], true) {
            diagnostics.push(messages::loop_joint_determined(&name.value).at(&name.place));
            return None;
        }
        found.push(*b);
    }
    for (pass, least) in WELL_LEFT.into_iter().enumerate() {
        for b in &order {
            if !found.contains(b) && chosen.takes(&model.bodies[*b], least, pass == 1) {
                found.push(*b);
            }
        }
    }
    let determined: usize = found.iter().map(|b| model.bodies[*b].joint.kind.nv()).sum();
    if determined < rows {
        let own = written.last().expect("there are loops");
        let names: Vec<&str> = written.iter().map(|own| own.name.value.as_str()).collect();
        diagnostics.push(messages::loops_depend(&names, rows, determined).at(&own.name.place));
        return None;
    }
    Some(found)
}

/// The joints that the file says are determined.
fn asked<'a>(
    written: &[&'a WrittenLoop],
    equations: &LoopEquations,
    model: &Model<Dd>,
    diagnostics: &mut Diagnostics,
) -> Option<Vec<(&'a Noted<String>, BodyId)>> {
    let mut found = Vec::new();
    for (own, of) in written.iter().zip(&equations.loops) {
        let on_loop = equations.model.bodies_of_loop(of);
        for name in &own.determines {
            let is_named = |b: &BodyId| model.bodies[*b].joint.name == name.value && model.coupling_of(*b).is_none();
            match on_loop.iter().copied().find(is_named) {
                Some(b) => found.push((name, b)),
                None => {
                    let known = on_loop.iter().map(|b| model.bodies[*b].joint.name.as_str());
                    let complaint = messages::loop_joint(&own.name.value, &name.value, known);
                    diagnostics.push(complaint.at(&name.place));
                }
            }
        }
    }
    (!diagnostics.has_errors()).then_some(found)
}

/// The bodies with joints on loops in the order in which they become dependent.
fn candidates(description: &Description, equations: &LoopEquations, model: &Model<Dd>) -> Vec<BodyId> {
    let source = |b: BodyId| model.coupling_of(b).map_or(b, |coupling| coupling.source);
    let mut all: Vec<BodyId> =
        equations.loops.iter().flat_map(|l| equations.model.bodies_of_loop(l)).map(source).collect();
    all.sort_unstable();
    all.dedup();
    all.retain(|b| !model.bodies[*b].joint.kind.is_base());
    let driven = description.drives.iter().flat_map(|drive| drive.joints.iter().map(|(joint, _)| &joint.value));
    let driven: Vec<&String> = driven.chain(&description.actuated).collect();
    let is_driven = |b: &BodyId| {
        let follows = |f: &BodyId| *f == *b || model.coupling_of(*f).is_some_and(|coupling| coupling.source == *b);
        (0..model.bodies.len()).filter(follows).any(|f| driven.contains(&&model.bodies[f].joint.name))
    };
    all.sort_by_key(|b| (is_driven(b), std::cmp::Reverse(*b)));
    all
}

/// In each closed configuration the columns of all coordinates, and an orthonormal basis of those that were taken.
struct DependentChoice {
    bases: Vec<TakenColumns>,
}

struct TakenColumns {
    columns: Vec<Vec<f64>>,
    basis: Vec<Vec<f64>>,
}

impl DependentChoice {
    /// Takes the columns of a joint if those that were taken leave so much of them: in every configuration, or `anywhere`.
    fn takes(&mut self, body: &Body<Dd>, least: f64, anywhere: bool) -> bool {
        let own = body.joint.iv..body.joint.iv + body.joint.kind.nv();
        let grown: Vec<Option<Vec<Vec<f64>>>> = self
            .bases
            .iter()
            .map(|TakenColumns { columns, basis }| {
                let mut basis = basis.clone();
                own.clone().all(|k| extend(&mut basis, &columns[k], least)).then_some(basis)
            })
            .collect();
        let taken = grown.iter().flatten().count();
        if if anywhere { taken == 0 } else { taken < grown.len() } {
            return false;
        }
        for (TakenColumns { columns, basis }, grown) in self.bases.iter_mut().zip(grown) {
            match grown {
                Some(grown) => *basis = grown,
                // singular there: nothing further is known of it
                None => own.clone().for_each(|k| {
                    extend(basis, &columns[k], 0.0);
                }),
            }
        }
        true
    }
}

/// Adds what a basis leaves of a column, if it is so much of it.
fn extend(basis: &mut Vec<Vec<f64>>, column: &[f64], least: f64) -> bool {
    let norm = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let (whole, mut rest) = (norm(column), column.to_vec());
    for _ in 0..2 {
        for unit in basis.iter() {
            let along: f64 = unit.iter().zip(&rest).map(|(a, b)| a * b).sum();
            rest.iter_mut().zip(unit).for_each(|(x, unit)| *x -= along * unit);
        }
    }
    let left = norm(&rest);
    if left.is_nan() || left <= least * whole || left == 0.0 {
        return false;
    }
    basis.push(rest.into_iter().map(|x| x / left).collect());
    true
}

/// Loops that are solved together, each group for the joints that no group before it has determined: the smallest ones first.
fn groups(loops: &[ClosedLoop<Dd>], dependents: &[BodyId], model: &Model<Dd>) -> Vec<LoopGroup> {
    let source = |b: BodyId| model.coupling_of(b).map_or(b, |coupling| coupling.source);
    let on_loop: Vec<Vec<BodyId>> = loops
        .iter()
        .map(|l| model.bodies_of_loop(l).into_iter().map(source).filter(|b| dependents.contains(b)).collect())
        .collect();
    let mut left: Vec<usize> = (0..loops.len()).collect();
    let mut known: Vec<BodyId> = Vec::new();
    let mut found = Vec::new();
    while !left.is_empty() {
        let unknown = |set: &[usize]| {
            let mut all: Vec<BodyId> =
                set.iter().flat_map(|l| on_loop[*l].iter().copied()).filter(|b| !known.contains(b)).collect();
            all.sort_unstable();
            all.dedup();
            all
        };
        let is_square = |set: &Vec<usize>| {
            let coordinates: usize = unknown(set).iter().map(|b| model.bodies[*b].joint.kind.nv()).sum();
            coordinates == set.iter().map(|l| loops[*l].equations()).sum::<usize>()
        };
        let set = subsets(&left).find(is_square).unwrap_or_else(|| left.clone());
        let mut own = unknown(&set);
        let times = |b: &BodyId| set.iter().filter(|l| on_loop[**l].contains(b)).count();
        own.sort_by_key(|b| (times(b), *b));
        left.retain(|l| !set.contains(l));
        known.extend(&own);
        let dyad = match set[..] {
            [only] => dyad_of(model, &loops[only], &own),
            _ => None,
        };
        found.push(LoopGroup { loops: set, dependents: own, dyad });
    }
    found
}

/// The parts of a set, the smallest ones first.
fn subsets(of: &[usize]) -> impl Iterator<Item = Vec<usize>> + '_ {
    let n = of.len();
    let most = if n <= MOST_TRIED { n } else { 0 };
    (1..=most).flat_map(move |size| {
        let masks = (1_usize..1 << n).filter(move |mask| mask.count_ones() as usize == size);
        masks.map(move |mask| (0..n).filter(|k| mask >> k & 1 == 1).map(|k| of[k]).collect())
    })
}
