//! Springs and dampers that are made of how a joint is to swing.
//!
//! In the pose of the file, with all other joints free, a joint feels the inertia I = 1 / (H⁻¹)_jj. With the spring k = I / (T ζ)² and the damper d = 2 I / T it
//! swings with the time constant T and the damping ratio ζ. That is what MuJoCo makes of `springdamper` when it compiles a model (`AutoSpringDamper`, with
//! the inverse of `dof_invweight0` for I): H is that of the tree with armatures, without couplings, loops and what gives way. Both numbers are rounded to
//! f64, as if they were written.

use super::loops::pose_of_file;
use super::{bodies, messages, order_joints, ModelOptions};
use crate::description::{Description, WrittenOscillation};
use crate::diagnostic::Diagnostics;
use straightline_core::algorithms::solve_articulated;
use straightline_core::closure::Closure;
use straightline_core::model::{Body, Model};
use straightline_core::spatial::Vec3;
use straightline_core::Dd;

/// Springs and dampers that are stiffer are beyond any robot \[N·m/rad, N·m·s/rad; N/m, N·s/m\].
const STIFFEST: f64 = 1e30;

/// Gives bodies the springs and dampers that are made so.
pub(super) fn resolve(
    description: &Description,
    (options, tolerance): (&ModelOptions, f64),
    bodies: &mut [Body<Dd>],
    diagnostics: &mut Diagnostics,
) {
    if bodies.iter().all(|body| written_of(body, description).is_none()) {
        return;
    }
    let Some(tree) = plain_tree(description, options, tolerance) else { return };
    let q = pose_of_file(description, &tree);
    for body in bodies {
        let Some(written) = written_of(body, description) else { continue };
        let Some(joint) = tree.free_joints().find(|joint| joint.name == body.joint.name) else { continue };
        let mut unit = vec![Dd::ZERO; tree.nv()];
        unit[joint.iv] = Dd::ONE;
        let per_force = solve_articulated(&tree, &q, &unit)[joint.iv];
        let [stiffness, damping] = made_of(written, per_force);
        if ![stiffness, damping].iter().all(|x| (0.0..=STIFFEST).contains(x)) {
            let complaint = messages::no_spring_of_oscillation(&body.joint.name, [stiffness, damping]);
            diagnostics.push(complaint.at(&written.place));
            continue;
        }
        (body.effects.stiffness, body.effects.damping) = (Dd::from(stiffness), Dd::from(damping));
    }
}

fn written_of<'d>(body: &Body<Dd>, description: &'d Description) -> Option<&'d WrittenOscillation> {
    description.joint(&body.joint.name)?.drive.oscillation.as_ref()
}

/// k = I / (T ζ)² and d = 2 I / T with I = 1 / (H⁻¹)_jj; not finite of a joint that feels no inertia.
fn made_of(written: &WrittenOscillation, per_force: Dd) -> [f64; 2] {
    let [time, ratio] = [written.time_constant, written.damping_ratio].map(Dd::from);
    let inertia = Dd::ONE / per_force;
    let width = time * ratio;
    [inertia / (width * width), (inertia + inertia) / time].map(Dd::to_f64)
}

/// The robot without couplings, loops and what gives way.
fn plain_tree(description: &Description, options: &ModelOptions, tolerance: f64) -> Option<Model<Dd>> {
    // what is wrong with it has been said
    let mut unheard = Diagnostics::new();
    let options = ModelOptions { rigid_links: true, joint_order: None, ..options.clone() };
    let mut bodies = bodies::assemble(description, &options, tolerance, &mut unheard)?.bodies;
    order_joints(&mut bodies, &[], &[], &options, &mut unheard);
    Some(Model {
        name: String::new(),
        bodies,
        gravity: Vec3::zero(),
        couplings: Vec::new(),
        closure: Closure::default(),
        frames: Vec::new(),
        drives: Vec::new(),
        base_parameters: Default::default(),
    })
}
