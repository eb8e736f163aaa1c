//! Figures of machine code: rustc is run on the finished text, and budgets are compared with what its object says.

use super::compile_in_one_scalar;
use crate::diagnostic::{Diagnostics, Source};
use crate::emit::rust::{measurable, symbol};
use crate::emit::Generated;
use crate::function::Function;
use crate::machine_code::{machine_code, MachineFigures, ObjectError, RustCompiler};
use crate::options::Options;
use crate::report::budget;
use crate::scene::{messages as say, Scene, SceneContacts};
use std::collections::BTreeMap;
use straightline_core::model::Model;
use straightline_core::Dd;

/// The robot as its file has it, and what is compiled of it.
pub(super) struct Compilation<'a> {
    pub source: &'a Source,
    /// As they were given.
    pub options: &'a Options,
    pub whole: &'a Model<Dd>,
}

/// The same with figures, where they or budgets of them are asked for.
///
/// # Errors
/// That there is no machine code; budgets that are exceeded, or of what is not known.
pub(super) fn with_figures(generated: Generated, compilation: &Compilation<'_>) -> Result<Generated, Diagnostics> {
    let options = compilation.options;
    let is_there = |function: &Function| generated.report.functions.contains_key(function.name());
    let functions: Vec<Function> = options.measured().filter(is_there).collect();
    let Some(first) = functions.first() else { return Ok(generated) };
    let mut diagnostics = Diagnostics::reporting(&options.reporting);
    let (rustc, figures) = match measured(&generated.text, &functions, options) {
        Ok(found) => found,
        Err(why) => {
            let place = match options.figures {
                true => "options.figures".to_string(),
                false => format!("budget.{}", first.name()),
            };
            options.scene.places.complain(
                &place,
                say::no_machine_code(&why.to_string(), why.remedy()),
                &mut diagnostics,
            );
            return Err(diagnostics);
        }
    };
    let remedies = |function: Function| {
        let candidates = budget::promising(compilation.whole, &generated.frames, function, options);
        candidates
            .into_iter()
            .filter_map(|(what, scene)| Some((what, compilation.in_scene(function, scene)?)))
            .collect()
    };
    budget::check_machine_code(&figures, &remedies, options, &mut diagnostics);
    match diagnostics.has_errors() {
        true => Err(diagnostics),
        false => {
            let figures = figures.into_iter().map(|(function, figures)| (function.name(), figures)).collect();
            Ok(generated.with_figures(figures, options.figures.then_some(rustc.version)))
        }
    }
}

/// The compiler, and the figures of functions of a text.
fn measured(
    text: &str,
    functions: &[Function],
    options: &Options,
) -> Result<(RustCompiler, Vec<(Function, MachineFigures)>), ObjectError> {
    let machine = options.target.expect("who asks for figures names a machine");
    let rustc = RustCompiler::find(options.rustc.as_deref())?;
    let names: Vec<&str> = functions.iter().map(|f| f.name()).collect();
    let code = machine_code(&rustc, &measurable(text, &names), machine, options.memory)?;
    let symbols: Vec<String> = names.iter().map(|name| symbol(name)).collect();
    let figures = code.figures(&symbols, machine, options.memory);
    let figures = figures.ok_or_else(|| ObjectError::Object("a function is not in it".to_string()))?;
    Ok((rustc, functions.iter().copied().zip(figures).collect()))
}

impl Compilation<'_> {
    /// The figures of a function in another scene, if it can be made there.
    fn in_scene(&self, function: Function, scene: Scene) -> Option<MachineFigures> {
        let contacts = SceneContacts::default();
        let scene = Scene { budgets: BTreeMap::new(), contacts, staged: false, ..scene };
        let alone = Options {
            functions: vec![function],
            scene,
            figures: true,
            self_test: false,
            also: Vec::new(),
            certify: None,
            fixed: None,
            ..self.options.clone()
        };
        let generated = compile_in_one_scalar(self.source, &alone, false).ok()?;
        generated.report.function(function)?.machine.clone()
    }
}
