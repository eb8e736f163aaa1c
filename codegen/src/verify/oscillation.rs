//! Springs and dampers that are made of how a joint is to swing, in the reference's terms.
//!
//! H of the tree by the second author in the pose of the file, with armatures on its diagonal; column j of its inverse by elimination.

use super::reference_input::{centre_of_mass_tree, radians};
use crate::description::{Description, PoseCoordinate};
use crate::model::ModelOptions;
use nalgebra::{DMatrix, DVector};
use std::collections::BTreeMap;
use straightline_core::reference::{mass_matrix, CentreOfMassTree};
use straightline_core::Dd;

/// k and d of the joints that are to swing, by name, as f64.
pub(super) fn springs(description: &Description, options: &ModelOptions) -> Result<BTreeMap<String, [Dd; 2]>, String> {
    let mut found = BTreeMap::new();
    if description.joints.iter().all(|joint| joint.drive.oscillation.is_none()) {
        return Ok(found);
    }
    let options = ModelOptions { rigid_links: true, uncoupled: true, joint_order: None, ..options.clone() };
    let tree = centre_of_mass_tree(description, &options)?;
    let mut h = mass_matrix(&tree, &in_pose_of_file(&tree, description, &options));
    let of_links = |link: &str| description.joints.iter().find(|joint| joint.child.value == link);
    for link in &tree.links {
        let armature = of_links(&link.name).and_then(|joint| joint.drive.armature.as_ref());
        let armature = Dd::from(armature.map_or(0.0, |armature| armature.value));
        (link.iv..link.iv + link.joint.nv()).for_each(|k| h[(k, k)] += armature);
    }
    for link in &tree.links {
        let Some(joint) = of_links(&link.name) else { continue };
        let Some(swing) = &joint.drive.oscillation else { continue };
        let [time, ratio] = [swing.time_constant, swing.damping_ratio].map(Dd::from);
        let inertia = Dd::ONE / solved(h.clone(), link.iv);
        let numbers = [inertia / (time * time) / (ratio * ratio), Dd::from(2.0) * inertia / time];
        found.insert(joint.name.value.clone(), numbers.map(|x| Dd::from(x.to_f64())));
    }
    Ok(found)
}

/// (H⁻¹)_kk by Gauss and Jordan; H is positive definite, so that every pivot is.
fn solved(mut h: DMatrix<Dd>, k: usize) -> Dd {
    let n = h.nrows();
    let mut x = DVector::from_fn(n, |i, _| if i == k { Dd::ONE } else { Dd::ZERO });
    for pivot in 0..n {
        for row in (0..n).filter(|row| *row != pivot) {
            let factor = h[(row, pivot)] / h[(pivot, pivot)];
            for column in pivot..n {
                let above = h[(pivot, column)];
                h[(row, column)] -= factor * above;
            }
            let above = x[pivot];
            x[row] -= factor * above;
        }
    }
    x[k] / h[(k, k)]
}

fn in_pose_of_file(tree: &CentreOfMassTree<Dd>, description: &Description, options: &ModelOptions) -> Vec<Dd> {
    let mut q = vec![Dd::ZERO; tree.nq()];
    for link in &tree.links {
        if let Some(first) = link.joint.quaternion() {
            q[link.iq + first + 3] = Dd::ONE;
        }
        let joint = description.joints.iter().find(|joint| joint.child.value == link.name);
        match joint.and_then(|joint| description.reference_of(&joint.name.value)) {
            Some(PoseCoordinate::Angle(angle)) => q[link.iq] = radians(angle, options),
            Some(PoseCoordinate::Length(length)) => q[link.iq] = Dd::from(length.value),
            None => {}
        }
    }
    q
}
