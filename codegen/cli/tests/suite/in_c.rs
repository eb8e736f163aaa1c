//! Exported packages as C meets them: built by cargo, called by a program that a strict compiler accepts.

use std::fs;
use std::path::Path;
use std::process::Command;

/// How a program gets the functions of a package.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(dead_code)] // every test file uses a part of it
pub enum Library {
    /// As it is built for trying it.
    StaticDebug,
    /// As it is delivered.
    SharedRelease,
}

/// What a command prints.
///
/// # Panics
/// If it fails.
pub fn succeeds(command: &mut Command) -> String {
    let output = command.output().expect("the program is there");
    assert!(output.status.success(), "{command:?}\n{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text")
}

/// Whether there is such a program.
pub fn is_there(program: &str) -> bool {
    Command::new(program).arg("--version").output().is_ok()
}

/// What the C program `text` prints, linked with the package of this name; nothing where there is no C compiler. The package is built in
/// any case, and neither may have a warning.
///
/// # Panics
/// If one of them does not compile, or the program fails.
pub fn printed(package: &Path, name: &str, library: Library, text: &str) -> Option<String> {
    let built = package.join("target");
    let is_release = library == Library::SharedRelease;
    succeeds(
        Command::new(env!("CARGO"))
            .args(["build", "--offline", "--manifest-path"])
            .arg(package.join("Cargo.toml"))
            .args(is_release.then_some("--release"))
            .env("CARGO_TARGET_DIR", &built)
            // warnings of generated code are ours to prevent
            .env("RUSTFLAGS", "-Dwarnings"),
    );
    if !is_there("cc") {
        eprintln!("skipped: there is no C compiler");
        return None;
    }
    let (source, program) = (package.with_extension("c"), package.with_extension("out"));
    fs::write(&source, text).expect("it can be written");
    let mut compiler = Command::new("cc");
    compiler.args(["-Wall", "-Wextra", "-Werror", "-pedantic", "-std=c99"]).arg(&source);
    compiler.arg("-I").arg(package.join("include"));
    match library {
        Library::StaticDebug => {
            compiler.arg(built.join(format!("debug/lib{name}.a"))).args(["-lm", "-lpthread", "-ldl"]);
        }
        Library::SharedRelease => {
            let folder = built.join("release");
            compiler.arg("-L").arg(&folder).arg(format!("-l{name}")).arg(format!("-Wl,-rpath,{}", folder.display()));
        }
    }
    succeeds(compiler.arg("-o").arg(&program));
    Some(succeeds(&mut Command::new(&program)))
}
