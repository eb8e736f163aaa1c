//! What the person sees.

use crate::table::name_width;
use crate::CommandFailure;
use anstream::{eprintln, stdout};
use anstyle::{AnsiColor, Style};
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;
use std::cell::Cell;
use std::io::{self, IsTerminal, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;
use straightline_codegen::description::{Description, Ignored};
use straightline_codegen::diagnostic::codes::Code;
use straightline_codegen::diagnostic::{Diagnostics, Severity};
use straightline_codegen::expr::Counts;
use straightline_codegen::model::{tolerance_that_mends, DoubtfulAngle, SpecialAngle};
use straightline_codegen::program::staged::{Remaining, StageReport, StagedReport};
use straightline_codegen::report::errors::four_digits;
use straightline_codegen::report::waterfall::{signed, Waterfall};
use straightline_codegen::report::Report;
use straightline_codegen::verify::Verification;
use straightline_codegen::Function;
use straightline_core::model::Model;
use straightline_core::Dd;

const ERROR: Style = AnsiColor::BrightRed.on_default().bold();
const HELP: Style = AnsiColor::BrightCyan.on_default().bold();
const GOOD: Style = AnsiColor::BrightGreen.on_default().bold();

/// An error that no diagnostic says.
pub fn error(text: &str) {
    eprintln!("{ERROR}error{ERROR:#}: {text}");
}

/// An error that no diagnostic says: why a command ends.
pub fn failure(text: impl AsRef<str>) -> CommandFailure {
    error(text.as_ref());
    CommandFailure::Input
}

/// The same with remedies.
pub fn failure_with(text: impl AsRef<str>, help: &[impl AsRef<str>]) -> CommandFailure {
    error(text.as_ref());
    help.iter().for_each(|help| eprintln!("{HELP}help{HELP:#}: {}", help.as_ref()));
    CommandFailure::Input
}

/// What is worth a warning, and that the command ends.
pub fn refused(all: &Diagnostics) -> CommandFailure {
    diagnostics(all, Severity::Warning);
    CommandFailure::Input
}

/// Whether warnings and progress are left out.
static QUIET: AtomicBool = AtomicBool::new(false);

/// Warnings, notes and progress are left out from now on.
pub fn be_quiet(quiet: bool) {
    QUIET.store(quiet, Ordering::Relaxed);
}

fn is_quiet() -> bool {
    QUIET.load(Ordering::Relaxed)
}

/// What is being done, and whether a bar on the terminal shows it.
static DOING: Mutex<(String, bool)> = Mutex::new((String::new(), false));
/// When it is said for the first time that something takes long; then each time after twice as long.
const SILENCE: Duration = Duration::from_secs(5);

fn now(what: String, on_terminal: bool) {
    *DOING.lock().unwrap_or_else(PoisonError::into_inner) = (what, on_terminal);
}

/// From now on says what is being done where that takes long, whatever it is; not if quiet, nor where a bar on the terminal shows it.
pub fn watch(command: &str) {
    now(command.to_string(), false);
    let say = || {
        let mut pause = SILENCE;
        let mut gone_by = Duration::ZERO;
        loop {
            std::thread::sleep(pause);
            gone_by += pause;
            pause = gone_by;
            let (what, on_terminal) = DOING.lock().unwrap_or_else(PoisonError::into_inner).clone();
            if !(is_quiet() || on_terminal && io::stderr().is_terminal()) {
                // nobody may be reading any more
                let _ = writeln!(anstream::stderr(), "{} s gone by: {what}", gone_by.as_secs());
            }
        }
    };
    // without another thread nothing is said; the work is done all the same
    let _ = std::thread::Builder::new().name("watch".to_string()).spawn(say);
}

/// How far something is, for [`watch`].
pub struct Progress(Cell<u32>);

impl Progress {
    pub fn new() -> Progress {
        Progress(Cell::new(0))
    }

    /// Often called, and cheap.
    pub fn say(&self, how_far: impl Fn() -> String) {
        self.0.set(self.0.get().wrapping_add(1));
        if self.0.get().is_multiple_of(1024) {
            now(how_far(), true);
        }
    }
}

/// Diagnostics of at least that severity; the stream drops the colours where there is no terminal.
pub fn diagnostics(all: &Diagnostics, least: Severity) {
    let least = if is_quiet() { Severity::Error } else { least };
    let shown = all.at_least(least);
    if !shown.is_empty() {
        eprintln!("{}", shown.render_coloured().trim_end());
        eprintln!();
    }
}

/// Codes, how bad each is, and what it is about.
pub fn codes(codes: &[Code]) -> io::Result<()> {
    let mut out = stdout().lock();
    for Code { code, severity, sentence, .. } in codes {
        writeln!(out, "{code:<26}{:<9}{sentence}", severity.to_string())?;
    }
    Ok(())
}

/// The functions that a word is about, or all of them.
pub fn functions(word: Option<&str>) -> io::Result<()> {
    let mut out = stdout().lock();
    let mut found: Vec<Function> = Function::known().filter(|f| word.is_none_or(|word| f.is_about(word))).collect();
    // `COM` is a name of the centre of mass, and the beginning of computed torque
    found.sort_by_key(|f| !word.is_some_and(|word| f.is_called(word)));
    let width = name_width(found.iter().map(|function| function.name()));
    for function in &found {
        writeln!(out, "{:<width$}{}", function.name(), function.summary())?;
        if !function.aliases().is_empty() {
            writeln!(out, "{:<width$}also: {}", "", function.aliases().join(", "))?;
        }
    }
    if found.is_empty() {
        writeln!(out, "no function is about `{}`", word.unwrap_or_default())?;
    }
    Ok(())
}

/// Generated source.
pub fn text(text: &str) -> io::Result<()> {
    stdout().lock().write_all(text.as_bytes())
}

/// Anything, for programs.
pub fn json(value: &impl Serialize) -> io::Result<()> {
    let text = serde_json::to_string_pretty(value).map_err(io::Error::other)?;
    writeln!(stdout().lock(), "{text}")
}

/// One line on a file that was checked.
pub fn verdict(path: &str, model: Option<&Model<Dd>>, diagnostics: &Diagnostics) -> io::Result<()> {
    let count = |severity, word: &str| {
        let n = diagnostics.count(severity);
        format!("{n} {word}{}", if n == 1 { "" } else { "s" })
    };
    let counts = format!("{}, {}", count(Severity::Warning, "warning"), count(Severity::Note, "note"));
    let mut out = stdout().lock();
    match model.filter(|_| !diagnostics.has_errors()) {
        Some(m) => {
            let (nq, nv, bodies) = (m.nq(), m.nv(), m.bodies.len());
            let name = &m.name;
            writeln!(out, "{path}: {GOOD}ok{GOOD:#}: {name}, {bodies} moving bodies, nq {nq}, nv {nv}; {counts}")
        }
        None => writeln!(out, "{path}: {ERROR}{}{ERROR:#}, {counts}", count(Severity::Error, "error")),
    }
}

/// What the reading assumed without a doubt: angles that are multiples of 30 or 45 degrees but for rounding, elements
/// that the dynamics do not need.
pub fn notes(description: &Description, angles: &[SpecialAngle], doubtful: &[DoubtfulAngle]) -> io::Result<()> {
    let mut out = stdout().lock();
    if is_quiet() {
        return Ok(());
    }
    if !doubtful.is_empty() {
        let tolerance = tolerance_that_mends(doubtful);
        writeln!(
            out,
            "  angles near right ones, taken as written (--angle-tolerance {tolerance:e} takes all as exact):"
        )?;
        for a in doubtful {
            writeln!(
                out,
                "    {}: {}: {} is {} only to {:.1e} rad",
                a.place,
                a.what,
                a.text,
                a.near,
                a.deviation.abs()
            )?;
        }
    }
    if !angles.is_empty() {
        writeln!(out, "  angles taken as exact (--angle-tolerance 0 takes them as written):")?;
        for a in angles {
            writeln!(out, "    {}: {}: {} as {}, {:.1e} rad off", a.place, a.what, a.text, a.taken_as, a.deviation)?;
        }
    }
    if !description.ignored.is_empty() {
        let each = |i: &Ignored| format!("{} ({}, first in line {})", i.what, i.count, i.place.line);
        let list: Vec<String> = description.ignored.iter().map(each).collect();
        writeln!(out, "  not needed for the dynamics: {}", list.join(", "))?;
    }
    Ok(())
}

/// The operations of the staged form.
fn staged_report(out: &mut impl Write, staged: &StagedReport, width: usize) -> io::Result<()> {
    let [of_stage, of_rest] = ["stage ", "then "].map(|word| width - word.len());
    writeln!(out)?;
    for s in &staged.stages {
        let StageReport { name, mul, add, div, sqrt, sincos, stored } = s;
        writeln!(
            out,
            "stage {name:<of_stage$}{mul:>8}{add:>8}{:>8}{div:>6}{sqrt:>6}{sincos:>8}, stores {stored} values",
            ""
        )?;
    }
    for (name, Remaining { mul, add, div, sqrt }) in &staged.remaining {
        writeln!(out, "then {name:<of_rest$}{mul:>8}{add:>8}{:>8}{div:>6}{sqrt:>6}", "")?;
    }
    let stored = [("inverse", staged.inverse_dynamics), ("forward", staged.forward_dynamics)];
    for (what, stored) in stored.into_iter().filter_map(|(what, stored)| Some((what, stored?))) {
        writeln!(out, "stored for {what} dynamics: {stored}")?;
    }
    Ok(())
}

/// The operations of every function.
pub fn report(report: &Report) -> io::Result<()> {
    let mut out = stdout().lock();
    let Report { robot, nq, nv, scalar, functions, .. } = report;
    writeln!(out, "{robot}: nq {nq}, nv {nv}, {scalar}\n")?;
    let width = name_width(functions.keys());
    writeln!(
        out,
        "{:<width$}{:>8}{:>8}{:>8}{:>6}{:>6}{:>8}{:>6}{:>6}{:>7}{:>8}",
        "function", "mul", "add", "fma", "div", "sqrt", "sincos", "tail", "live", "parts", "lines"
    )?;
    for (name, f) in functions {
        writeln!(
            out,
            "{name:<width$}{:>8}{:>8}{:>8}{:>6}{:>6}{:>8}{:>6}{:>6}{:>7}{:>8}",
            f.mul, f.add, f.fma, f.div, f.sqrt, f.sincos, f.tail, f.max_live, f.parts, f.lines
        )?;
    }
    for (k, c) in report.contact.iter().enumerate() {
        let Counts { mul, add, fma, div, sqrt, sin_cos, .. } = c.counts;
        let name = format!("{}::{}", c.mode, c.function);
        let start = if k == 0 { "\nin contact\n" } else { "" };
        writeln!(out, "{start}{name:<40}{mul:>8}{add:>8}{fma:>8}{div:>6}{sqrt:>6}{sin_cos:>8}")?;
    }
    if let Some(staged) = &report.staged {
        staged_report(&mut out, staged, width)?;
    }
    writeln!(
        out,
        "\nfma: instructions for mul and add when every a·b ± c is one; tail: additions within sincos that keep what sums of\n\
         angles lose to rounding; live: most values alive at once"
    )?;
    for (name, method) in functions.iter().filter_map(|(name, f)| Some((name, f.method?))) {
        writeln!(out, "\n{name}. {method}")?;
    }
    for (name, errors) in functions.iter().filter_map(|(name, f)| Some((name, f.errors.as_ref()?))) {
        match errors.refused {
            Some(why) => writeln!(out, "\n{name}: no bound of rounding errors: {why}")?,
            None => writeln!(out, "\n{name}: rounding errors, at most")?,
        }
        for output in &errors.outputs {
            let bounds: Vec<String> = output.bounds.iter().map(|e| format!("{:.3e}", four_digits(*e))).collect();
            for (k, row) in bounds.chunks(10).enumerate() {
                let name = if k == 0 { output.name.as_str() } else { "" };
                writeln!(out, "{name:>8}  {}", row.join(" "))?;
            }
        }
        for line in &errors.ranges {
            writeln!(out, "          for {line}")?;
        }
    }
    let explained = functions.iter().filter_map(|(name, f)| Some((name, f, f.waterfall.as_ref()?)));
    for (name, f, waterfall) in explained {
        let Waterfall { plain, full, savings } = waterfall;
        let full = full.flops();
        writeln!(out, "\n{name}: {} operations plain, {full} in full, {} here", plain.flops(), f.flops())?;
        for s in savings {
            let pairs = match s.sincos {
                0 => String::new(),
                n => format!(", sincos {}", signed(n)),
            };
            writeln!(out, "{:>8}  {}{pairs}", signed(s.operations), s.what)?;
        }
    }
    Ok(())
}

/// The worst error of every function.
pub fn verification(v: &Verification) -> io::Result<()> {
    let mut out = stdout().lock();
    writeln!(out, "{}: {} against the reference, {} states, seed {}\n", v.robot, v.scalar, v.states, v.seed)?;
    let width = name_width(v.functions.keys());
    writeln!(out, "{:<width$}{:>14}{:>8}   worst in", "function", "worst error", "state")?;
    for (name, f) in &v.functions {
        let (style, mark) = if f.error <= v.bound { (Style::new(), "") } else { (ERROR, "  exceeds the bound") };
        writeln!(out, "{name:<width$}{style}{:>14.2e}{style:#}{:>8}   {}{mark}", f.error, f.state, f.output)?;
    }
    for (name, f) in v.functions.iter().filter(|(_, f)| f.error > v.bound) {
        writeln!(out, "\n{name}, state {}:", f.state)?;
        for (input, values) in &f.inputs {
            writeln!(out, "let {input} = {values:?};")?;
        }
    }
    if !v.left_out.is_empty() {
        writeln!(out, "\nthe reference has no formulation of {}", v.left_out.join(", "))?;
    }
    writeln!(out, "\nerrors divided by natural scale; bound {:.1e}", v.bound)
}

/// Something is being done; shown on a terminal only.
pub fn spinner(what: &str) -> ProgressBar {
    now(what.to_string(), true);
    let bar = ProgressBar::new_spinner().with_message(what.to_string());
    if is_quiet() {
        return ProgressBar::hidden();
    }
    if io::stderr().is_terminal() {
        bar.enable_steady_tick(Duration::from_millis(100));
    }
    bar
}

/// So many things are being done; shown on a terminal only.
pub fn bar(what: &'static str, count: u64) -> ProgressBar {
    now(what.to_string(), true);
    if is_quiet() {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len}").expect("a template of indicatif");
    ProgressBar::new(count).with_style(style).with_message(what)
}
