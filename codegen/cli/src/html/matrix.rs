//! The mass matrix as a drawing: which entries are zero, and on how many coordinates the others depend.

use super::escape;
use super::tree::text_width;
use std::collections::BTreeMap;
use std::fmt::Write;
use straightline_codegen::emit::Generated;
use straightline_codegen::equations::Robot;
use straightline_codegen::function::Function;
use straightline_codegen::options::Options;
use straightline_codegen::program::optimised;
use straightline_codegen::scene::Scene;
use straightline_core::model::Model;
use straightline_core::Dd;
use straightline_graph::expr::{Graph, Op};

/// In a greater mass matrix single entries have no words.
const ENTRIES_WITH_WORDS: usize = 60;

/// Classes of entries: the class of their cells, that of their swatch, and what they are.
const CLASSES: [(&str, &str, &str); 6] = [
    ("z", "c-z", "zero"),
    ("c", "c-c", "constant"),
    ("d1", "c-1", "1 coordinate"),
    ("d2", "c-2", "2 or 3"),
    ("d3", "c-3", "4 to 6"),
    ("d4", "c-4", "7 and more"),
];

/// The section of the mass matrix, and the width of the drawing.
pub(super) fn mass_matrix(generated: &Generated, options: &Options) -> (String, f64) {
    let model = &generated.model;
    // whole, also where the scene wants a part of it
    let scene = Scene { outputs: BTreeMap::new(), ..options.scene.clone() };
    let robot = Robot::new(model.clone());
    let options = Options { scene, ..options.clone() };
    let graph = optimised(&robot, &[], Function::MassMatrix, &options, options.optimisations());
    let entries = dependences(&graph);
    let nv = model.nv();
    let mut out = format!(
        "<h2>Mass matrix</h2>\n<p class=\"lead\">Which entries of H ({nv} × {nv}) are zero, and on how many coordinates the others \
         depend. Joints on different branches do not meet: their entry is zero and takes no operation.</p>\n<ul class=\"legend\">\n"
    );
    for (key, swatch, words) in CLASSES {
        let number = entries.iter().filter(|e| class(**e) == key).count();
        if number > 0 {
            let all = nv * nv;
            let _ = writeln!(out, "<li><span class=\"swatch {swatch}\"></span>{words}: {number} of {all}</li>");
        }
    }
    out.push_str("</ul>\n<div class=\"figure\">\n");
    let (drawing, width) = drawing(&coordinates(model), &entries);
    (out + &drawing + "</div>\n", width)
}

/// Names of the velocity coordinates.
fn coordinates(model: &Model<Dd>) -> Vec<String> {
    let of_joint = |joint: &straightline_core::model::Joint| -> Vec<String> {
        let name = |k: usize| match joint.kind.row().entries[1].get(k) {
            // "vx" as "v x", "wx" as "ω x"
            Some(entry) => format!("{} {}", joint.name, entry.replace('v', "v ").replace('w', "ω ")),
            None => joint.name.clone(),
        };
        (0..joint.kind.nv()).map(name).collect()
    };
    model.joints().into_iter().filter(|joint| joint.iv < model.nv()).flat_map(of_joint).collect()
}

/// On how many coordinates each entry of a program depends; `None` for an entry that is always zero.
fn dependences(graph: &Graph) -> Vec<Option<usize>> {
    let mut q = 0..0;
    let mut next = 0;
    for port in &graph.inputs {
        if port.name == "q" {
            q = next..next + port.len();
        }
        next += port.len();
    }
    let words = q.len().div_ceil(64);
    let mut sets: Vec<Vec<u64>> = Vec::with_capacity(graph.ops.len());
    for op in &graph.ops {
        let mut set = vec![0; words];
        if let Op::Input(k) = op {
            if q.contains(&(*k as usize)) {
                let k = *k as usize - q.start;
                set[k / 64] |= 1 << (k % 64);
            }
        }
        for a in op.operands() {
            set.iter_mut().zip(&sets[a.index()]).for_each(|(s, a)| *s |= a);
        }
        sets.push(set);
    }
    let is_zero = |op: Op| matches!(op, Op::Constant(c) if c.is(0.0));
    let count = |set: &[u64]| set.iter().map(|w| w.count_ones() as usize).sum();
    graph.results.iter().map(|r| (!is_zero(graph.op(*r))).then(|| count(&sets[r.index()]))).collect()
}

fn class(entry: Option<usize>) -> &'static str {
    match entry {
        None => "z",
        Some(0) => "c",
        Some(1) => "d1",
        Some(2..=3) => "d2",
        Some(4..=6) => "d3",
        Some(_) => "d4",
    }
}

/// The entries as coloured cells beside the names, and the width of that.
fn drawing(names: &[String], entries: &[Option<usize>]) -> (String, f64) {
    let nv = names.len();
    let cell = (600 / nv.max(1)).clamp(6, 26) as f64;
    let font = (cell * 0.85).min(12.0);
    let shown: Vec<String> = names.iter().map(|n| n.chars().take(40).collect()).collect();
    let margin = shown.iter().map(|n| text_width(n, font)).fold(0.0, f64::max) + 12.0;
    let width = margin + nv as f64 * cell + 4.0;
    let mut out = format!(
        "<svg viewBox=\"0 0 {width:.0} {width:.0}\" width=\"{width:.0}\" style=\"max-width:100%\" role=\"img\" aria-label=\"sparsity of the mass matrix\">\n"
    );
    for (i, name) in shown.iter().enumerate() {
        let (along, across) = (margin - 6.0, margin + (i as f64 + 0.5) * cell + font * 0.36);
        let shown = escape(name);
        let _ = writeln!(
            out,
            "<text font-size=\"{font:.1}\" text-anchor=\"end\" x=\"{along:.1}\" y=\"{across:.1}\">{shown}</text><text font-size=\"{font:.1}\" transform=\"translate({across:.1} {along:.1}) rotate(-90)\">{shown}</text>"
        );
    }
    for (k, entry) in entries.iter().enumerate() {
        let (i, j) = (k / nv, k % nv);
        let about = match entry {
            None => "zero".to_string(),
            Some(0) => "constant".to_string(),
            Some(n) => format!("depends on {n}"),
        };
        let words = match nv > ENTRIES_WITH_WORDS {
            true => String::new(),
            false => format!("<title>{}, {}: {about}</title>", escape(&names[i]), escape(&names[j])),
        };
        let (class, size) = (class(*entry), cell - 1.5);
        let [x, y] = [j, i].map(|k| margin + k as f64 * cell + 0.75);
        let _ = writeln!(
            out,
            "<rect class=\"{class}\" x=\"{x:.1}\" y=\"{y:.1}\" width=\"{size:.1}\" height=\"{size:.1}\" rx=\"2\">{words}</rect>"
        );
    }
    (out + "</svg>\n", width)
}
