//! Base parameters of robots whose joints follow others.
//!
//! Grouping with the parent leaves out nothing that forces tell apart, but where joints move together it can leave too much: two fingers that a gripper moves by
//! one coordinate are told apart by no force, though neither carries the other. So columns of the whole regressor, Gᵀ Y_tree, are made orthogonal
//! one after the other; what then depends on columns before it is added to their parameters.

use super::{dependence, BaseSearch, OfMotion, SampledMotion, DUST};
use std::collections::BTreeMap;
use straightline_core::base_parameters::{BaseParameter, BaseParameterSets};
use straightline_core::model::Model;
use straightline_core::Dd;

/// A share of a column that is less is what rounding leaves of parameters that are hard to tell apart.
const NO_SHARE: f64 = 1e-18;
/// So many rows for each column.
const ROWS_PER_COLUMN: usize = 2;

impl BaseSearch<'_> {
    /// The parameters among these that the regressor of so many rows tells apart, with all that is grouped with them.
    pub(super) fn told_apart(
        &self,
        mut found: Vec<BaseParameter>,
        regressor: OfMotion<'_>,
        rows: usize,
    ) -> Vec<BaseParameter> {
        if self.coupled.couplings.is_empty() || found.is_empty() {
            return found;
        }
        found.iter_mut().for_each(|parameter| parameter.rows = (0..rows).collect());
        let columns = found.len();
        let base =
            BaseParameterSets { of_forces: found.clone(), of_support: found.clone(), ..BaseParameterSets::default() };
        let mut sampled = vec![Vec::new(); columns];
        let states = super::states(self.coupled, self.any_gravity, (ROWS_PER_COLUMN * columns).div_ceil(rows));
        for SampledMotion { motion, gravity, .. } in &states {
            let model = Model { gravity: *gravity, base_parameters: base.clone(), ..self.coupled.clone() };
            let y = regressor(&model, motion.each_ref().map(|x| &x[..]));
            for row in y.chunks(columns) {
                sampled.iter_mut().zip(row).for_each(|(column, x)| column.push(*x));
            }
        }
        let sampled: Vec<[Vec<Dd>; 2]> = sampled.into_iter().map(|column| [column.clone(), column]).collect();
        let dependence = dependence(&sampled, 0..columns);
        for (dependent, factors) in &dependence.dependent {
            let amount = found[*dependent].terms.clone();
            let greatest = |k: usize| sampled[k][1].iter().map(|x| x.abs().to_f64()).fold(0.0, f64::max);
            for (kept, factor) in factors {
                let share = factor.abs().to_f64() * greatest(*kept) / greatest(*dependent);
                if share > NO_SHARE {
                    add_scaled(&mut found[*kept].terms, &amount, *factor);
                }
            }
        }
        let kept = |k: &usize| dependence.kept.contains(k);
        (0..columns).filter(kept).map(|k| found[k].clone()).collect()
    }
}

/// Adds a sum times a factor, without what rounding leaves of terms that cancel.
fn add_scaled(terms: &mut Vec<(usize, Dd)>, other: &[(usize, Dd)], factor: Dd) {
    let mut all: BTreeMap<usize, (Dd, f64)> = BTreeMap::new();
    let scaled = other.iter().map(|(place, x)| (*place, *x * factor));
    for (place, x) in terms.iter().copied().chain(scaled) {
        let (sum, size) = all.entry(place).or_insert((Dd::ZERO, 0.0));
        (*sum, *size) = (*sum + x, size.max(x.abs().to_f64()));
    }
    let left = all.into_iter().filter(|(_, (sum, size))| sum.abs().to_f64() > DUST * size);
    *terms = left.map(|(place, (sum, _))| (place, sum)).collect();
}
