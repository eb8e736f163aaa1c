//! Identification: the numbers of a robot that its logs tell.
//!
//! Equations of motion are linear in base parameters, combinations of what links and joints have. These are fitted by weighed least squares over equations
//! in which all terms pass the same low-pass. Of all links that make such base parameters those are written that can be, and are nearest to what the file had.

mod design;
mod links;
mod regressor;

pub use design::{designed, DesignDemand, DesignedMotion};
use links::DUST;
pub use links::{new_inertial, rounded, IdentifiedJoint, IdentifiedLink, LinkMap};
pub use regressor::{lags, RegressorModel, MOST_INSTANTS};

use straightline_codegen::convert::renumber::{NewEffects, NewNumbers};
use straightline_core::base_parameters::{BaseParameterKind, JointParameter, PER_BODY};
use straightline_logs::consistent::{ConsistencyProblem, ScalarPrior};
use straightline_logs::weighted::{FitData, WeightedFit};

/// Offsets of joints are about so much before there are data, as a part of the root mean square of their force: where data do not tell them from
/// weight, they are weight, which files have a place for.
const OFFSET_SPREAD: f64 = 0.01;

/// What logs tell of a robot.
#[derive(Clone, Debug)]
pub struct Identification {
    /// The fit of the base parameters.
    pub fit: WeightedFit,
    /// Losses of joints that came out negative, and are held at zero: their columns.
    pub held: Vec<usize>,
    /// The links as they are written, in the order of the map.
    pub bodies: Vec<[f64; PER_BODY]>,
    /// The parameters of joints as they are written, in the order of the map.
    pub joints: Vec<f64>,
    /// The base parameters of what is written: of these without offsets.
    pub written: Vec<f64>,
}

/// The equations of several logs.
pub fn together(data: &[FitData]) -> FitData {
    let (columns, outputs) = data.first().map_or((0, 0), |data| (data.columns, data.outputs));
    FitData { columns, outputs, blocks: data.iter().flat_map(|data| data.blocks.iter().cloned()).collect() }
}

/// Fits base parameters; friction and rotors whose best numbers are negative are held at zero.
pub fn fitted(robot: &RegressorModel, data: &FitData) -> (WeightedFit, Vec<usize>) {
    let of_links = PER_BODY * robot.exact.bodies.len();
    let mut held: Vec<usize> = Vec::new();
    loop {
        let fit = data.fit_holding(&held, lags());
        let is_loss = |k: usize| {
            let parameter = &robot.parameters()[k];
            matches!(parameter.kind, BaseParameterKind::Joint(kind) if kind != JointParameter::Offset)
                && parameter.terms.iter().all(|(place, _)| *place >= of_links)
        };
        let negative = fit.fitted.coefficients.iter().enumerate().filter(|(k, x)| is_loss(*k) && **x < 0.0);
        let worst = negative.min_by(|(_, a), (_, b)| a.total_cmp(b)).map(|(k, _)| k);
        match worst {
            Some(k) => held.push(k),
            None => {
                held.sort_unstable();
                return (fit, held);
            }
        }
    }
}

/// The numbers of a robot that are nearest to logs and to the file; `None` where no link has mass.
pub fn identified(robot: &RegressorModel, map: &LinkMap, data: &FitData) -> Option<Identification> {
    let (fit, held) = fitted(robot, data);
    let own = |k: usize| own_value(map, &fit, k);
    let sizes: Vec<f64> = data.rms(&vec![0.0; data.columns]);
    let prior = |(k, joint): (usize, &IdentifiedJoint)| match joint.kind {
        JointParameter::Offset => Some(ScalarPrior::Free(OFFSET_SPREAD * sizes[joint.row].max(1e-9))),
        _ if joint.by_file > 0.0 && own(k) != Some(0.0) => Some(ScalarPrior::Positive(joint.by_file)),
        _ => own(k).filter(|x| *x > 0.0).map(ScalarPrior::Positive),
    };
    let priors: Vec<Option<ScalarPrior>> = map.joints.iter().enumerate().map(prior).collect();
    let free: Vec<usize> = (0..priors.len()).filter(|k| priors[*k].is_some()).collect();
    let scalars: Vec<ScalarPrior> = priors.iter().flatten().copied().collect();
    let bodies: Vec<[f64; PER_BODY]> = map.links.iter().map(|link| link.known).collect();
    let of_links = PER_BODY * bodies.len();
    let picked =
        |row: &Vec<f64>| row[..of_links].iter().copied().chain(free.iter().map(|k| row[of_links + k])).collect();
    let made_of: Vec<Vec<f64>> = map.made_of.iter().map(picked).collect();
    let problem = ConsistencyProblem {
        triangle: &fit.triangle,
        side: &fit.side,
        weight: 1.0 / fit.inflation.max(1e-3),
        made_of: &made_of,
        rest: &map.rest,
        bodies: &bodies,
        scalars: &scalars,
    };
    let found = problem.solve()?;
    let mut joints = vec![0.0; map.joints.len()];
    // what is no force beside the joint's is dust of the search
    let is_something = |k: usize, x: f64| x.abs() > DUST * sizes[map.joints[k].row];
    free.iter().zip(&found.scalars).filter(|(k, x)| is_something(**k, **x)).for_each(|(k, x)| joints[*k] = *x);
    // offsets have no place in robot files
    let in_files = |(joint, x): (&IdentifiedJoint, &f64)| if joint.kind == JointParameter::Offset { 0.0 } else { *x };
    let by_file: Vec<f64> = map.joints.iter().zip(&joints).map(in_files).collect();
    let written = map.base_parameters(&found.bodies, &by_file);
    Some(Identification { fit, held, bodies: found.bodies, joints, written })
}

/// What the data alone say of a parameter of a joint, less what joints that move with it have by the file. Of several such joints the first has what the
/// others do not; of one whose parameter is grouped with links they say nothing.
fn own_value(map: &LinkMap, fit: &WeightedFit, k: usize) -> Option<f64> {
    let first = PER_BODY * map.links.len();
    let is_its = |row: &Vec<f64>| row.iter().position(|x| *x != 0.0) == Some(first + k);
    let column = map.made_of.iter().position(is_its)?;
    let row = &map.made_of[column][first..];
    let others: f64 = row.iter().zip(&map.joints).skip(k + 1).map(|(x, joint)| x * joint.by_file).sum();
    let value = || (fit.fitted.coefficients[column] - others) / row[k];
    (!fit.fitted.untold.contains(&column)).then(value)
}

impl Identification {
    /// What the robot file is to have. Offsets have no place in robot files.
    pub fn numbers(&self, map: &LinkMap) -> NewNumbers {
        let links = map.links.iter().zip(&self.bodies).map(|(link, body)| new_inertial(&link.name, body)).collect();
        let of_joint = |joint: &IdentifiedJoint| {
            let value = |kind: JointParameter| {
                let found =
                    map.joints.iter().zip(&self.joints).find(|(own, _)| own.name == joint.name && own.kind == kind);
                found.map(|(_, x)| rounded(*x))
            };
            NewEffects {
                joint: joint.name.clone(),
                damping: value(JointParameter::Damping),
                friction: value(JointParameter::Coulomb),
                rotor_inertia: value(JointParameter::RotorInertia).filter(|inertia| *inertia > 0.0),
            }
        };
        let each = map.joints.iter().filter(|joint| joint.kind == JointParameter::Damping);
        NewNumbers { links, joints: each.map(of_joint).collect() }
    }
}
