//! Exported dynamics of one robot behind the C functions that the peers' harness calls.
//!
//! The harness wants matrices by columns, as `scene.toml` asks for them, and an orientation before a position: the pose of the one
//! frame is put into that order here.
#![allow(clippy::missing_safety_doc)] // all of them: the pointers lead to arrays of the harness's sizes, outputs apart

#[allow(dead_code)] // constants that the harness does not ask for
mod dynamics;

use dynamics::{NQ, NV};

type Q = [f64; NQ];
type V = [f64; NV];

#[no_mangle]
pub unsafe extern "C" fn rbd_id(q: &Q, v: &V, a: &V, tau: &mut V) {
    dynamics::inverse_dynamics(q, v, a, tau);
}

#[no_mangle]
pub unsafe extern "C" fn rbd_nle(q: &Q, v: &V, h: &mut V) {
    dynamics::bias_force(q, v, h);
}

#[no_mangle]
pub unsafe extern "C" fn rbd_crba(q: &Q, h: &mut [V; NV]) {
    dynamics::mass_matrix(q, h);
}

#[no_mangle]
pub unsafe extern "C" fn rbd_aba(q: &Q, v: &V, tau: &V, a: &mut V) {
    dynamics::forward_dynamics(q, v, tau, a);
}

#[no_mangle]
pub unsafe extern "C" fn rbd_fkjac(q: &Q, t: &mut [f64; 12], j: &mut [[[f64; 6]; NV]; 1]) {
    let mut x = [[0.0; 12]; 1];
    dynamics::kinematics_and_jacobian(q, &mut x, j);
    let [[px, py, pz, xx, xy, xz, yx, yy, yz, zx, zy, zz]] = x;
    *t = [xx, yx, zx, xy, yy, zy, xz, yz, zz, px, py, pz];
}
