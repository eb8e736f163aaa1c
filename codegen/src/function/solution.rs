//! What solves H x = b for any b, by the method that was chosen: forward dynamics and its derivatives.

use super::Forms;
use straightline_core::algorithms as alg;
use straightline_core::Real;

/// What solves H x = b for any b.
pub(super) struct Solution<'a, 'b, T> {
    pub(super) forms: &'a Forms<'b, T>,
    q: &'a [T],
    /// Of the factorisation; `None`: by articulated bodies.
    factor: Option<alg::Ltdl<T>>,
    /// How branches follow what carries them, of the factorisation.
    responses: alg::BranchResponses<T>,
}

impl<'a, 'b, T: Real> Solution<'a, 'b, T> {
    pub(super) fn new(forms: &'a Forms<'b, T>, q: &'a [T]) -> Self {
        let factor = forms.factorises().then(|| alg::Ltdl::factor(forms.model, &forms.mass_matrix(q)));
        Solution { forms, q, factor, responses: alg::BranchResponses::default() }
    }

    pub(super) fn of(&self, right: &[T]) -> Vec<T> {
        match &self.factor {
            Some(factor) => factor.solve(right),
            None => alg::solve_articulated(self.forms.model, self.q, right),
        }
    }

    /// x of each of these b.
    pub(super) fn of_all(&self, right: &[Vec<T>]) -> Vec<Vec<T>> {
        self.forms.columns(right, &|right| self.of(right))
    }

    /// x of each of these b, one per velocity coordinate, again and again: each is zero but on the branch of its coordinate, which are those that
    /// carry it and those that it carries.
    pub(super) fn of_coordinates(&self, right: &[Vec<T>]) -> Vec<Vec<T>> {
        let Some(factor) = &self.factor else { return self.of_all(right) };
        let nv = self.forms.model.nv();
        let mut solved = vec![Vec::new(); right.len()];
        for branch in factor.branches() {
            let places: Vec<usize> = (0..right.len()).filter(|k| branch.contains(&(k % nv))).collect();
            let columns: Vec<Vec<T>> = places.iter().map(|k| right[*k].clone()).collect();
            let one = |right: &[T]| factor.solve_on_branch(branch[0], right, &self.responses);
            for (k, x) in places.into_iter().zip(self.forms.columns(&columns, &one)) {
                solved[k] = x;
            }
        }
        solved
    }

    /// H⁻¹ by rows.
    pub(super) fn inverse(&self) -> Vec<T> {
        let nv = self.forms.model.nv();
        match &self.factor {
            Some(factor) => factor.inverse_by(&self.responses),
            None => {
                let unit = |k: usize| (0..nv).map(|i| if i == k { T::one() } else { T::zero() }).collect::<Vec<T>>();
                by_rows(&self.of_all(&(0..nv).map(unit).collect::<Vec<_>>()))
            }
        }
    }

    /// With q̈ of q, q̇ and τ, the first three inputs.
    pub(super) fn with_acceleration(forms: &'a Forms<'b, T>, inputs: &'a [Vec<T>]) -> (Self, Vec<T>) {
        let solution = Solution::new(forms, &inputs[0]);
        let qdd = solution.of(&net_force(forms, inputs));
        (solution, qdd)
    }
}

/// τ − h of q, q̇ and τ, the first three inputs.
pub(super) fn net_force<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
    let bias = forms.bias_force(&inputs[0], &inputs[1]);
    inputs[2].iter().zip(bias).map(|(tau, h)| *tau - h).collect()
}

/// A matrix by rows, from its columns.
pub(crate) fn by_rows<T: Copy>(columns: &[Vec<T>]) -> Vec<T> {
    let rows = columns.first().map_or(0, Vec::len);
    (0..rows).flat_map(|i| columns.iter().map(move |column| column[i])).collect()
}
