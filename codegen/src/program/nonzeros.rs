//! Which entries of matrix results can be non-zero, and programs that put out no others.
//!
//! An entry is zero for every input where its node is the constant zero, after all passes: no entry that is listed is known to vanish, and none
//! that is left out can be anything else. Rows and columns are those of the array as it is written, of the last axis and of all before it.
//! Entries stand row by row, as in compressed sparse rows (of a matrix that is written column after column: compressed sparse columns).

use super::TracedProgram;
use crate::choices::WrittenEntries;
use crate::function::{Function, Output};
use crate::options::Options;
use straightline_graph::expr::{Graph, NodeId, Op, Port};
use straightline_graph::pass::dead_code;
use straightline_graph::schedule::schedule;

/// The entries of a matrix result that can be non-zero.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct NonzeroEntries {
    /// The output.
    pub output: String,
    /// How many columns there are.
    #[cfg_attr(feature = "serde", serde(skip))]
    pub width: usize,
    /// Where each row begins in the list of entries, and where the last one ends.
    pub row_starts: Vec<usize>,
    /// The column of each entry, row by row.
    pub columns: Vec<usize>,
    /// Whether the matrix is symmetric, and these are of its lower triangle alone.
    pub is_triangle: bool,
}

impl NonzeroEntries {
    /// The places of the entries in the array of all, in order.
    pub fn places(&self) -> Vec<usize> {
        let of_row = |(row, ends): (usize, &[usize])| {
            let columns = &self.columns[ends[0]..ends[1]];
            columns.iter().map(|column| row * self.width + column).collect::<Vec<_>>()
        };
        self.row_starts.windows(2).enumerate().flat_map(of_row).collect()
    }

    /// Its constants: where rows begin, and columns; with what they are.
    pub fn constants(&self, function: &str) -> [(String, &[usize], String); 2] {
        let name = format!("{}_{}", function.to_uppercase(), self.output.to_uppercase());
        let of = &self.output;
        let (starts, columns) = (format!("{name}_ROW_STARTS"), format!("{name}_COLUMNS"));
        let lower = if self.is_triangle { " of the lower triangle; the matrix is symmetric" } else { "" };
        let doc_of_starts = format!(
            "Where each row of `{of}` of [`{function}`] begins among its entries in [`{columns}`], and where the last one ends."
        );
        let doc_of_columns =
            format!("The columns of the entries of `{of}` of [`{function}`] that can be non-zero, row by row{lower}.");
        [(starts, &self.row_starts, doc_of_starts), (columns, &self.columns, doc_of_columns)]
    }
}

/// Those of all matrix results of a program; `lower`: of symmetric ones the lower triangle alone.
pub fn nonzeros(function: Function, graph: &Graph, lower: bool) -> Vec<NonzeroEntries> {
    let row = |port: &Port| function.spec().outputs.iter().find(|output| output.name == port.name);
    let mut first = 0;
    let mut all = Vec::new();
    for port in &graph.outputs {
        let results = &graph.results[first..first + port.len()];
        first += port.len();
        if let (Some(output), [.., width]) = (row(port).filter(|output| output.is_by_columns()), &port.shape[..]) {
            if port.shape.len() > 1 {
                all.push(of_matrix(output, graph, results, *width, lower));
            }
        }
    }
    all
}

fn of_matrix(output: &Output, graph: &Graph, results: &[NodeId], width: usize, lower: bool) -> NonzeroEntries {
    let is_zero = |k: usize| matches!(graph.op(results[k]), Op::Constant(c) if c.value().to_f64() == 0.0);
    let rows = results.len().checked_div(width).unwrap_or(0);
    let both = |i: usize, j: usize| results[i * width + j] == results[j * width + i];
    let is_symmetric = rows == width && (0..rows).all(|i| (0..i).all(|j| both(i, j)));
    let is_triangle = lower && output.is_symmetric && is_symmetric;
    let (mut row_starts, mut columns) = (vec![0], Vec::new());
    for i in 0..rows {
        let end = if is_triangle { i + 1 } else { width };
        columns.extend((0..end).filter(|j| !is_zero(i * width + j)));
        row_starts.push(columns.len());
    }
    NonzeroEntries { output: output.name.to_string(), width, row_starts, columns, is_triangle }
}

/// The same program, which puts out these entries alone of such outputs.
pub fn packed(graph: &Graph, entries: &[NonzeroEntries]) -> Graph {
    let mut packed = Graph { outputs: Vec::new(), results: Vec::new(), ..graph.clone() };
    let mut first = 0;
    for port in &graph.outputs {
        let results = &graph.results[first..first + port.len()];
        first += port.len();
        match entries.iter().find(|of| of.output == port.name) {
            Some(of) => {
                let places = of.places();
                packed.outputs.push(Port::new(&port.name, &[places.len()]));
                packed.results.extend(places.into_iter().map(|k| results[k]));
            }
            None => {
                packed.outputs.push(port.clone());
                packed.results.extend(results);
            }
        }
    }
    dead_code(&packed)
}

impl TracedProgram {
    /// With what is written of its matrices by these options.
    pub(crate) fn choose_entries(&mut self, options: &Options) {
        match options.entries {
            WrittenEntries::All => {}
            WrittenEntries::Patterns => self.entries = nonzeros(self.function, &self.graph, false),
            WrittenEntries::Nonzeros => {
                self.entries = nonzeros(self.function, &self.graph, true);
                // what has no matrices stays as it is, with its loops over limbs
                if self.entries.is_empty() {
                    return;
                }
                self.graph = super::passed("nonzeros", self.function.name(), packed(&self.graph, &self.entries));
                self.schedule = schedule(&self.graph, options.limits, options.schedule_machine().as_ref());
            }
        }
    }
}
