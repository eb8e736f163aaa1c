//! The command `simulate` of a robot that touches objects.

use crate::arguments::Simulate;
use crate::files::{self, read as read_file};
use crate::motion::{failed, lines, print_run, undrawn, write_run};
use crate::{print, view, CommandFailure};
use anstream::stdout;
use std::io::Write;
use std::path::Path;
use straightline_cli::experiment;
use straightline_codegen::diagnostic::{Diagnostics, Severity};
use straightline_codegen::scene::contact::SceneContacts as Items;
use straightline_core::model::Model;
use straightline_simulation::contact::{ContactRun, Contacts};
use straightline_simulation::plant::Plant;
use straightline_simulation::plot::{stacked, Line, Plot};
use straightline_simulation::simulate::Failure as Stopped;

/// Size of the plots in pixels.
const PLOTS: (u32, u32) = (900, 900);
/// Events that are printed, at most.
const MOST_LINES: usize = 40;

/// The contacts of a scene as an experiment has them.
pub fn read(path: &Path, model: &Model<f64>, items: &Items) -> Result<Contacts, CommandFailure> {
    let source = read_file(path)?;
    let mut diagnostics = Diagnostics::new();
    let contacts = experiment::contact::read(&source, model, items, &mut diagnostics);
    print::diagnostics(&diagnostics, Severity::Warning);
    contacts.ok_or(CommandFailure::Input)
}

/// Writes and prints what came out.
pub fn finish(
    a: &Simulate,
    plant: &Plant,
    contacts: &Contacts,
    run: Result<ContactRun, Stopped>,
) -> Result<(), CommandFailure> {
    let ContactRun { run, events, drift } = run.map_err(|failure| failed(&failure))?;
    if let Some(path) = &a.output {
        write_run(path, &run.table, &plant.model)?;
    }
    if let Some(path) = &a.view {
        view::draw(path, &a.robot, &plant.model, (&a.input, &run.table))?;
    }
    if let Some(path) = &a.svg {
        let plot = |title, unit, prefixes: &[&str]| Plot {
            title,
            axes: ("t [s]", unit),
            lines: lines(&run.table, "")
                .into_iter()
                .filter(|l| prefixes.iter().any(|p| l.name.starts_with(p)))
                .collect(),
            levels: vec![0.0],
        };
        let mut energies = plot("energies, since the beginning", "J", &[]);
        for (name, column) in
            [("all", "energy"), ("kinetic", "kinetic"), ("objects", "objects"), ("work", "work"), ("heat", "losses")]
        {
            let mut line = Line { name, ..lines(&run.table, column).swap_remove(0) };
            let first = line.points[0].1;
            line.points.iter_mut().for_each(|p| p.1 -= first);
            energies.lines.push(line);
        }
        let plots = [plot("distance s", "m", &["s."]), plot("reaction F", "N or N·m", &["F.", "friction."]), energies];
        let svg = stacked(&plots, PLOTS).map_err(undrawn)?;
        files::write(path, &svg)?;
    }
    let mut out = stdout().lock();
    let width = contacts.touches.iter().map(|t| t.contact.name.chars().count()).max().unwrap_or(0);
    for event in events.iter().take(MOST_LINES) {
        writeln!(out, "{:>12.6} s  {:<width$}  {}", event.time, event.contact, event.what)?;
    }
    if events.len() > MOST_LINES {
        writeln!(out, "and {} more", events.len() - MOST_LINES)?;
    }
    writeln!(out, "closed rigid constraints stay within {drift:.1e} (m, or cosine)")?;
    drop(out);
    print_run(plant, &run)
}
