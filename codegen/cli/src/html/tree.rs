//! The kinematic tree as a drawing: joints as symbols by their kind, bodies as the lines between them, the world on top.
//!
//! Every tip of the tree has a column, every joint a row by its distance from the world; a joint stands in the middle of the
//! columns that it carries, its names to its right. So symbols, lines and names of different branches never meet.

use super::escape;
use std::fmt::Write;
use straightline_core::model::{JointKind, Model};
use straightline_core::Dd;

/// Distance of rows, and of the first row from the top.
const ROW: f64 = 52.0;
/// Left margin, and the room between a name and the next column.
const MARGIN: f64 = 22.0;
/// Sizes of names \[px\]; those of joints are bold.
const JOINT_FONT: f64 = 12.5;
const BODY_FONT: f64 = 11.5;
/// Names longer than this are cut in the drawing; a reader who points at them sees all.
const LONGEST: usize = 36;

/// A joint and its body in the drawing.
struct Node {
    x: f64,
    row: usize,
    children: Vec<usize>,
}

/// Where everything stands.
struct TreeLayout {
    nodes: Vec<Node>,
    roots: Vec<usize>,
    width: f64,
    height: f64,
}

impl TreeLayout {
    /// Columns of this width.
    fn new(model: &Model<Dd>, column: f64) -> TreeLayout {
        let n = model.bodies.len();
        let mut nodes: Vec<Node> = (0..n).map(|_| Node { x: 0.0, row: 0, children: Vec::new() }).collect();
        for i in 0..n {
            if let Some(p) = model.bodies[i].parent {
                nodes[p].children.push(i);
                nodes[i].row = nodes[p].row + 1;
            }
        }
        // columns in depth-first order; a stack, because trees may be deep
        let roots: Vec<usize> = (0..n).filter(|i| model.bodies[*i].parent.is_none()).collect();
        let mut stack: Vec<usize> = roots.iter().rev().copied().collect();
        let mut columns = 0;
        while let Some(i) = stack.pop() {
            if nodes[i].children.is_empty() {
                nodes[i].x = MARGIN + columns as f64 * column;
                columns += 1;
            }
            stack.extend(nodes[i].children.iter().rev());
        }
        // parents come before their children
        for i in (0..n).rev() {
            if let (Some(a), Some(b)) = (nodes[i].children.first(), nodes[i].children.last()) {
                nodes[i].x = (nodes[*a].x + nodes[*b].x) / 2.0;
            }
        }
        let rows = nodes.iter().map(|node| node.row + 1).max().unwrap_or(0);
        TreeLayout { nodes, roots, width: columns as f64 * column, height: rows as f64 * ROW + 0.5 * ROW + 6.0 }
    }

    /// The world, above the roots.
    fn world(&self, out: &mut String) {
        let ends = self.roots.iter().map(|i| self.nodes[*i].x);
        let (left, right) = ends.fold((f64::MAX, f64::MIN), |(l, r), x| (l.min(x), r.max(x)));
        let (left, right) = (left.min(right) - 16.0, right.max(left) + 16.0);
        let _ = writeln!(out, "<path class=\"ground\" d=\"M{left:.1} 20H{right:.1}\"/>");
        let mut x = left + 2.0;
        while x <= right {
            let _ = writeln!(out, "<path class=\"ground\" style=\"stroke-width:1\" d=\"M{x:.1} 20l6 -7\"/>");
            x += 8.0;
        }
        let _ = writeln!(out, "<text class=\"small\" x=\"{:.1}\" y=\"20\" font-size=\"12\">world</text>", right + 12.0);
    }

    /// Bodies: from their joint to the joints that they carry.
    fn links(&self, out: &mut String, is_free: impl Fn(usize) -> bool) {
        for &i in &self.roots {
            let class = if is_free(i) { "free" } else { "link" };
            let _ = writeln!(out, "<path class=\"{class}\" d=\"M{:.1} 22V{:.1}\"/>", self.nodes[i].x, y(0));
        }
        for node in &self.nodes {
            let (x, y0) = (node.x, y(node.row));
            for c in &node.children {
                let to = &self.nodes[*c];
                let (bus, below) = (y0 + ROW * 0.62, y(to.row));
                let _ = writeln!(out, "<path class=\"link\" d=\"M{x:.1} {y0:.1}V{bus:.1}H{:.1}V{below:.1}\"/>", to.x);
            }
            if node.children.is_empty() {
                let _ = writeln!(out, "<path class=\"link\" d=\"M{x:.1} {y0:.1}V{:.1}\"/>", y0 + ROW * 0.45);
            }
        }
    }
}

/// The height of a row.
fn y(row: usize) -> f64 {
    (row + 1) as f64 * ROW
}

/// The tree as SVG, and its width \[px\]. Joints for which `held` says so do not move in the scene; `notes` adds words to a body's name.
pub(super) fn tree(model: &Model<Dd>, held: &dyn Fn(usize) -> bool, notes: &dyn Fn(usize) -> String) -> (String, f64) {
    let words = |i: usize| {
        let body = &model.bodies[i];
        let coordinates = match (held(i), model.coupling_of(i), body.joint.kind.nq()) {
            (true, ..) => String::new(),
            (false, Some(coupling), _) => format!(" · {}", coupling.in_words(model)),
            (false, None, 1) => format!(" · q[{}]", body.joint.iq),
            (false, None, more) => format!(" · q[{}..{}]", body.joint.iq, body.joint.iq + more),
        };
        (cut(&body.joint.name), format!("{}{coordinates}{}", cut(&body.name), notes(i)))
    };
    let longest = (0..model.bodies.len()).map(|i| {
        let (joint, body) = words(i);
        text_width(&joint, JOINT_FONT * 1.1).max(text_width(&body, BODY_FONT))
    });
    let layout = TreeLayout::new(model, longest.fold(60.0, f64::max) + 2.0 * MARGIN);
    let (width, height) = (layout.width, layout.height);
    let mut out = format!(
        "<svg viewBox=\"0 0 {width:.0} {height:.0}\" width=\"{width:.0}\" style=\"max-width:100%;min-width:{:.0}px\" role=\"img\" aria-label=\"kinematic tree\">\n",
        width * 0.72
    );
    layout.world(&mut out);
    layout.links(&mut out, |i| model.bodies[i].joint.kind.is_base() && !held(i));
    for (i, node) in layout.nodes.iter().enumerate() {
        let (x, y0) = (node.x, y(node.row));
        let kind = if held(i) { None } else { Some(model.bodies[i].joint.kind) };
        let (joint, body) = words(i);
        let full = format!("{}, {}", model.bodies[i].joint.name, model.bodies[i].name);
        let (full, joint, body) = (escape(&full), escape(&joint), escape(&body));
        let (symbol, beside, above, below) = (symbol(kind, x, y0), x + 16.0, y0 - 1.0, y0 + 13.0);
        let _ = writeln!(
            out,
            "<g><title>{full}</title>{symbol}<text x=\"{beside:.1}\" y=\"{above:.1}\" font-size=\"{JOINT_FONT}\" font-weight=\"600\">{joint}</text><text class=\"small\" x=\"{beside:.1}\" y=\"{below:.1}\" font-size=\"{BODY_FONT}\">{body}</text></g>"
        );
    }
    out.push_str("</svg>\n");
    (out, width)
}

/// The symbol of a joint around a point; `None` for one that is held.
pub(super) fn symbol(kind: Option<JointKind>, x: f64, y: f64) -> String {
    match kind.map(|kind| kind.row().name) {
        Some("revolute") => format!(
            "<circle class=\"glyph revolute\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"8\"/><circle class=\"mark revolute\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"1.5\"/>"
        ),
        Some("prismatic") => format!(
            "<rect class=\"glyph prismatic\" x=\"{:.1}\" y=\"{:.1}\" width=\"15\" height=\"15\" rx=\"2\"/><path class=\"mark prismatic\" d=\"M{x:.1} {:.1}v7m-2.5 -4.5l2.5 -2.5l2.5 2.5m-5 2l2.5 2.5l2.5 -2.5\"/>",
            x - 7.5,
            y - 7.5,
            y - 3.5
        ),
        Some("floating") => format!(
            "<path class=\"glyph floating\" d=\"M{x:.1} {:.1}l10 10l-10 10l-10 -10z\"/><path class=\"mark floating\" d=\"M{:.1} {y:.1}h7m-3.5 -3.5v7\"/>",
            y - 10.0,
            x - 3.5
        ),
        Some(other) => format!(
            "<circle class=\"glyph {other}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"8\"/><text x=\"{x:.1}\" y=\"{:.1}\" font-size=\"10\" text-anchor=\"middle\">{}</text>",
            y + 3.5,
            &other[..1]
        ),
        None => format!(
            "<rect class=\"glyph held\" x=\"{:.1}\" y=\"{:.1}\" width=\"13\" height=\"13\" rx=\"2\"/><path class=\"mark held\" d=\"M{:.1} {:.1}l6 6m0 -6l-6 6\"/>",
            x - 6.5,
            y - 6.5,
            x - 3.0,
            y - 3.0
        ),
    }
}

/// About the greatest width of a text \[px\] in fonts that browsers take for sans-serif.
pub(super) fn text_width(text: &str, font: f64) -> f64 {
    let ems = |c: char| match c {
        'm' | 'w' | 'M' | 'W' | '@' | '%' => 0.98,
        'A'..='Z' => 0.74,
        'i' | 'j' | 'l' | '.' | ',' | ':' | ' ' | '[' | ']' | '·' => 0.36,
        c if c.is_ascii() => 0.64,
        _ => 1.0,
    };
    text.chars().map(ems).sum::<f64>() * font
}

fn cut(name: &str) -> String {
    match name.chars().count() {
        n if n > LONGEST => name.chars().take(LONGEST - 1).chain(['…']).collect(),
        _ => name.to_string(),
    }
}
