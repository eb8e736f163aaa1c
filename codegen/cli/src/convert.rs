//! `straightline convert`: a robot file in another format, written whole or not at all.

use crate::arguments::{robot_file, EXIT_CODES};
use crate::given::possible;
use crate::{files, print, CommandFailure};
use clap::builder::TypedValueParser;
use clap::Args;
use std::path::{Path, PathBuf};
use straightline_codegen::convert::{convert, format_of_path, format_of_word, written_formats, ConvertOptions};
use straightline_codegen::description::write::FormatWriter;
use straightline_codegen::diagnostic::wording::one_of;
use straightline_codegen::diagnostic::{Diagnostics, Severity};
use straightline_codegen::model;

/// What stands below the options in the help.
pub fn help() -> String {
    format!(
        "\
The format follows from the name of OUT, or from --to. Before anything is written the text is read back and compared with the robot:
joints and their order, limits, effects, couplings, frames, masses and poses. What the other format has no place for is listed; where the
robot would move in another way that is an error, and with --lossy a warning (codegen/CONVERT.md).

Examples:
  straightline convert panda.urdf panda.xml
  straightline convert solo12.urdf solo12.toml --floating-base
  straightline convert scene.xml robot.urdf --lossy

{EXIT_CODES}"
    )
}

#[derive(Debug, Args)]
pub struct ConvertArguments {
    #[arg(value_name = "IN", help = robot_file())]
    pub robot: PathBuf,
    /// Where to write
    #[arg(value_name = "OUT")]
    pub output: PathBuf,
    /// The format [default: that of OUT by its name]
    #[arg(long, value_name = "FORMAT", value_parser = formats())]
    pub to: Option<String>,
    /// Leave out what the format has no place for, with a warning, also where the robot then moves in another way
    #[arg(long)]
    pub lossy: bool,
    /// The root link moves freely in the world
    #[arg(long)]
    pub floating_base: bool,
    /// Say errors alone
    #[arg(short, long)]
    pub quiet: bool,
}

/// The formats that are written.
fn formats() -> impl TypedValueParser<Value = String> {
    possible(written_formats().map(|(format, writer)| (writer.word, format.name)).collect())
}

/// Writes the file, and says what the format cannot say.
pub fn convert_file(a: &ConvertArguments) -> Result<(), CommandFailure> {
    let source = files::read(&a.robot)?;
    let output = a.output.display().to_string();
    let format = a.to.as_deref().map_or_else(|| format_of_path(&output), format_of_word);
    let Some(format) = format else {
        let named = |(_, writer): (_, &FormatWriter)| writer.extensions.iter().map(|end| format!("`.{end}`"));
        let ends: Vec<String> = written_formats().flat_map(named).collect();
        let help = format!("let it end in {}, or give `--to`", one_of(&ends));
        return Err(print::failure_with(format!("{output}: the name says no format"), &[help]));
    };
    let mut said = Diagnostics::new();
    let options = ConvertOptions { floating_base: a.floating_base, lossy: a.lossy };
    let text = convert(&source, format, options, &mut said);
    model::finish(&mut said);
    print::diagnostics(&said, Severity::Note);
    let Some(text) = text else { return Err(CommandFailure::Input) };
    // what the file includes was read, too
    said.sources().for_each(|source| files::note(Path::new(source.path())));
    files::write(&a.output, &text)
}
