//! Forces on frames, by the second author in dual numbers.

use super::super::frame_forces::JacobianHessianProduct;
use super::super::Quantity;
use super::closed::ClosingReal;
use super::motion_derivatives::slopes;
use super::{list, Chapter, Truth};
use nalgebra::DVector;
use straightline_core::magnitude::Magnitude;
use straightline_core::reference::CentreOfMassTree;
use straightline_core::Dual;

impl Truth for JacobianHessianProduct {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        let moving = at.tree.map(Dual::<Magnitude, 1>::fixed);
        let slopes = slopes(at, 0, |[q, ..]| generalized(at, &moving, q, Dual::fixed));
        Some([generalized(at, &at.tree, at.q(), |x| x), slopes].concat())
    }
}

/// Σ Jᵀ f.
fn generalized<T: ClosingReal>(
    at: &Chapter<'_>,
    tree: &CentreOfMassTree<T>,
    q: &[T],
    number: impl Fn(Magnitude) -> T,
) -> Vec<T> {
    let mut sum = DVector::from_element(at.qd().len(), <T as straightline_core::Real>::zero());
    for (frame, f) in at.frames.iter().zip(at.get(Quantity::Wrench).chunks(6)) {
        let frame = tree.frame(&frame.name).expect("frames are those of the tree");
        let f = DVector::from_iterator(6, f.iter().map(|x| number(*x)));
        sum += at.jacobian_on(tree, frame, q).transpose() * f;
    }
    list(&sum)
}
