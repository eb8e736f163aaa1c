//! Programs that check accelerations and reactions by their residual: `forward_dynamics_error_bound` in generated code.
//!
//! Dividing keeps no useful interval over a box, but a solution can be checked, wherever it comes from. Of
//!
//! H q̈ + h = τ + Ĵᵀ F, and for each row of the contact s̈ = J q̈ + A = s̈* (rigid) or F = −(m s̈ + load) (yielding),
//!
//! the system of a contact mode has what is left at the given q̈ and F, r = τ + Ĵᵀ F − ID(q, q̇, q̈) and c = s̈* − J q̈ − A or
//! c = −(m s̈ + load) − F, and H, J, Ĵ, m; all with their running bounds (`running.rs`). The errors δ of q̈ and φ of F obey
//!
//! H δ = r + Ĵᵀ φ,  κ J δ + σ φ = c,  with κ = 1, σ = 0 of rigid rows and κ = m, σ = 1 of yielding ones.
//!
//! # H: a congruence
//!
//! Let L, D be what LᵀDL of the computed H gives, in an order without fill-in, and W what substitution gives for L⁻¹: unit triangular
//! matrices of floating-point numbers, which are regular whatever they are. With γ = (n + 8) u/(1 − (n + 8) u), the classical analysis of both
//! (Higham 2002, lemma 8.4 and theorem 8.5) gives for the exact H
//!
//! * |H − LᵀDL| ≤ E + γ |L|ᵀ D |L|, E the running bounds of H, and |L W − I| ≤ γ |L| |W|;
//! * hence Wᵀ H W = D + B with |B| ≤ |W|ᵀ (E + 4 γ |L|ᵀ D |L|) |W|, as long as D > 0: with P = L W − I,
//!   B = Pᵀ D + D P + Pᵀ D P + Wᵀ (H − LᵀDL) W.
//!
//! For v > 0 let a = max (|B| v)_i/(D_i v_i), which takes products of matrices and vectors only. The symmetric D^-½ B D^-½ has no eigenvalue
//! beyond a, as that is a norm of a matrix similar to it. If a < 1, H is positive definite, and its smallest eigenvalue is at least
//! (1 − a)/Σ W_ik²/D_k, because ‖H⁻¹‖ = ‖W (D + B)⁻¹ Wᵀ‖ ≤ ‖W D^-½‖_F²/(1 − a). A solution of (D + B) z = b has z = D⁻¹ (b − B z), so that
//! max |z_i|/v_i ≤ β/(1 − a) with β = max |b_i|/(D_i v_i), and (|B| |z|)_i ≤ (|B| v)_i β/(1 − a). v is D^-½.
//!
//! # Without contact
//!
//! δ = W (D + B)⁻¹ Wᵀ r = W D⁻¹ Wᵀ r − W D⁻¹ B z: |δ| ≤ |R| |r| + |W| (γ D⁻¹ |W|ᵀ |r| + D⁻¹ |B| v β/(1 − a)), R what is computed for W D⁻¹ Wᵀ.
//!
//! # Contact
//!
//! With V = J W, V̂ = Ĵ W and x a norm by D^-½: J H⁻¹ Ĵᵀ = V D⁻¹ V̂ᵀ up to a/(1 − a) ‖V_i‖ ‖V̂_j‖ in each entry, as
//! ‖(1 + D^-½ B D^-½)⁻¹ − 1‖ ≤ a/(1 − a); so N = σ + κ J H⁻¹ Ĵᵀ is known with a bound, and likewise the right side of N φ = c − κ J H⁻¹ r.
//! For any R' and M = 1 − R' N, φ = R' N φ + M φ: if a' = max (|M| v')_i/v'_i < 1, then R' and N are regular, max |φ_i|/v'_i ≤
//! max |R' N φ|_i/v'_i/(1 − a'), and once more in φ = R' N φ + M φ (Krawczyk; Rump 2010, section 10). The columns of N⁻¹ obey the same:
//! the smallest singular value of N, of rigid contacts without friction the smallest eigenvalue of the Schur complement J H⁻¹ Jᵀ, is at least
//! 1/Σ |N⁻¹_ij|. Then δ = H⁻¹ r + W D⁻¹ (V̂ᵀ φ − B z): with Q = W D⁻¹ V̂ᵀ it is Q φ = Q R' (N φ) + Q M φ, where Q R' stays small in
//! directions in which reactions are hardly known.
//!
//! Where a ≥ 1 or a' ≥ 1 nothing is proven, and all that depends on it is NaN, by the root of 1 − a: equations so near to a singular mass
//! matrix, or redundant contacts, or such that are too near to it for the format.

use super::companion::OF_ERROR;
use super::congruence::Congruence;
use super::reactions::ReactionRows;
use super::running::{BrokenProof, Running, Tracked};
use super::FloatFormat;
use crate::expr::{Graph, NodeId, Op, Port};
use crate::number::Scalar;

/// Longer programs are not written: rustc would take minutes.
pub(super) const MOST_OPERATIONS: usize = 150_000;

/// The outputs of a system, in order: what is left of the equations of motion and of those of the contact; H; J; the rows in which reactions
/// act; m of yielding rows.
pub const OUTPUTS: [&str; 6] = ["residual", "missing", "h", "j", "applied", "mass"];

/// A program that bounds how far accelerations and reactions are from the exact ones: the inputs of a system of a contact mode,
/// with `qdd` and, in contact, `force`; `yielding` says of each row of the contact whether the object gives way.
///
/// # Errors
/// If it would be too long.
pub fn acceleration_bound(system: &Graph, yielding: &[bool], scalar: Scalar) -> Result<Graph, &'static str> {
    let program = Running::new(system.inputs.clone(), FloatFormat::of(scalar));
    bound_of(program, system, yielding)
}

pub(super) fn bound_of(mut p: Running, system: &Graph, yielding: &[bool]) -> Result<Graph, &'static str> {
    const TOO_LONG: &str = "it would be too long";
    let lengths: Vec<usize> = system.outputs.iter().map(Port::len).collect();
    assert!(system.outputs.iter().map(|o| o.name.as_str()).eq(OUTPUTS), "a system has these outputs");
    let (n, m) = (lengths[0], lengths[1]);
    if n.pow(2) * (n + 16 * m) > 4 * MOST_OPERATIONS {
        return Err(TOO_LONG);
    }
    let inputs = p.inputs();
    let mut results = p.follow(system, &inputs).into_iter();
    let parts: Vec<Vec<Tracked>> = lengths.iter().map(|n| results.by_ref().take(*n).collect()).collect();
    let [residual, missing, h, j, applied, mass] = &parts[..] else { unreachable!("a system has six outputs") };
    let rows = |x: &[Tracked]| -> Vec<Vec<Tracked>> { x.chunks(n).map(<[Tracked]>::to_vec).collect() };

    let mut congruence = Congruence::new(&mut p, h, n).ok_or("a diagonal entry of the mass matrix is zero")?;
    let eigenvalue = congruence.smallest_eigenvalue(&mut p);
    let mut outputs = vec![Port::new(&format!("qdd{OF_ERROR}"), &[n])];
    let known: Vec<Tracked> = match p.is_broken(BrokenProof::Residual) {
        true => residual.iter().map(|r| Running::exact(r.value)).collect(),
        false => residual.clone(),
    };
    let sizes: Vec<NodeId> = known.iter().map(|r| p.magnitude(*r)).collect();
    let sizes = p.all_settled(&sizes);
    let mut bounds = congruence.direct(&mut p, &sizes);
    let mut driven = congruence.down(&mut p, &congruence.inverse, &sizes);
    let mut results = Vec::new();
    let mut last = vec![eigenvalue];
    if m > 0 {
        let contact = ReactionRows { residual: &known, missing, j: rows(j), applied: rows(applied), mass, yielding };
        let reactions = contact.reactions(&mut p, &congruence);
        if !p.is_broken(BrokenProof::Reactions) {
            for i in 0..n {
                bounds[i] = p.insert(Op::add(bounds[i], reactions.accelerations[i]));
                driven[i] = p.insert(Op::add(driven[i], reactions.driven[i]));
            }
        }
        outputs.push(Port::new(&format!("force{OF_ERROR}"), &[m]));
        results = reactions.bounds;
        last.push(reactions.smallest);
        outputs.push(Port::new("smallest_eigenvalue", &[1]));
        outputs.push(Port::new("smallest_contact_eigenvalue", &[1]));
    } else {
        outputs.push(Port::new("smallest_eigenvalue", &[1]));
    }
    let accelerations = congruence.with_shift(&mut p, &bounds, &driven);
    if p.operations() > MOST_OPERATIONS {
        return Err(TOO_LONG);
    }
    p.finish(outputs, [accelerations, results, last].concat()).ok_or(TOO_LONG)
}
