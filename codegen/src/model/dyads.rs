//! Which loops close in closed form, and in which of their assemblies.

use crate::description::{messages, Description, WrittenAssembly};
use crate::diagnostic::Diagnostics;
use straightline_core::closure::{ClosedLoop, Dyad, DyadWay};
use straightline_core::model::{BodyId, Model};
use straightline_core::Dd;

/// Axes meet if one passes so near to where the other joint stands \[m\].
const MEETING: f64 = 1e-12;
/// Axes that cross under so small an angle turn a point about one axis.
const CROSSING: f64 = 1e-3;

/// The dyad of a loop that determines these joints; `None` where another order of joints or joints that follow others leave no closed form.
pub(super) fn dyad_of(model: &Model<Dd>, of: &ClosedLoop<Dd>, dependents: &[BodyId]) -> Option<Dyad> {
    let on_loop = model.bodies_of_loop(of);
    let kind = |b: BodyId| model.bodies[b].joint.kind;
    let is_elementary = |b: &BodyId| on_loop.contains(b) && (kind(*b).turns() || kind(*b).slides());
    let moves_others = |b: &BodyId| model.couplings.iter().any(|c| c.source == *b);
    if !dependents.iter().all(|b| is_elementary(b) && !moves_others(b)) {
        return None;
    }
    if !of.alignments.is_empty() {
        return None;
    }
    let pivots: Vec<Vec<BodyId>> = match (of.directions.len(), dependents.len()) {
        (2, 2) => dependents.iter().rev().filter(|b| kind(**b).turns()).map(|b| vec![*b]).collect(),
        (3, 3) => {
            let pairs = dependents.iter().flat_map(|a| dependents.iter().map(move |b| vec![*a, *b]));
            pairs.filter(|pair| is_universal(model, pair[0], pair[1])).collect()
        }
        _ => return None,
    };
    let pivot = pivots.into_iter().next()?;
    let crank = dependents.iter().copied().find(|b| !pivot.contains(b))?;
    Some(Dyad { crank, pivot, way: DyadWay::AsItStands })
}

/// Whether a hinge carries another one whose axis meets its own.
fn is_universal(model: &Model<Dd>, outer: BodyId, inner: BodyId) -> bool {
    let (body, carrier) = (&model.bodies[inner], &model.bodies[outer]);
    let [x, y, _] = body.placement.translation.to_array().map(|x| x.to_f64().abs());
    // how far the inner axis leans from the outer one
    let [across, over, _] = body.placement.rotation.column(2).to_array().map(|x| x.to_f64());
    body.parent == Some(outer)
        && carrier.joint.kind.turns()
        && body.joint.kind.turns()
        && x.max(y) < MEETING
        && across.hypot(over) > CROSSING
}

/// Steps of Newton's method of loops that others carry along into another assembly.
const STEPS: usize = 60;

/// Keeps loops in the assemblies that the file names, and brings home there.
pub(super) fn keep_assemblies(model: &mut Model<Dd>, description: &Description, diagnostics: &mut Diagnostics) {
    let numbers = model.cast::<f64>();
    let mut is_moved = false;
    for (l, own) in description.loops.iter().enumerate() {
        let Some(assembly) = &own.assembly else { continue };
        let group = model.closure.groups.iter_mut().find(|group| group.loops == [l]);
        let Some(dyad) = group.and_then(|group| group.dyad.as_mut()) else {
            diagnostics.push(messages::loop_assembly(&own.name.value).at(&assembly.place));
            continue;
        };
        let drawn = dyad.way_at(&numbers, &numbers.closure.loops[l], &numbers.closure.home);
        dyad.way = match (assembly.value, drawn) {
            (WrittenAssembly::Drawn, way) => way,
            (WrittenAssembly::Mirrored, DyadWay::Negative) => DyadWay::Positive,
            (WrittenAssembly::Mirrored, _) => DyadWay::Negative,
        };
        is_moved |= assembly.value == WrittenAssembly::Mirrored;
    }
    if is_moved {
        let (home, _) = model.assemble_loops(&model.closure.home, STEPS);
        model.closure.home = home;
    }
}
