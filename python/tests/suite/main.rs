//! The tests of the Python package, by a Python that has NumPy: `PYTHON`, or that of `python/environment`, or `python3`. Without one they are skipped.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs};

/// A Python with NumPy: that of `PYTHON`, or what `environment` has made in the target directory, or `python3`.
fn python() -> Option<PathBuf> {
    let check = "import sys, numpy; sys.exit(sys.version_info < (3, 9))";
    let works = |python: &PathBuf| {
        Command::new(python).args(["-c", check]).output().is_ok_and(|output| output.status.success())
    };
    if let Some(python) = env::var_os("PYTHON") {
        return Some(PathBuf::from(python)).filter(works);
    }
    let test = env::current_exe().expect("a test knows where it is");
    let made = test.ancestors().skip(1).map(|folder| folder.join("python/bin/python"));
    made.filter(|python| python.exists()).chain([PathBuf::from("python3")]).find(works)
}

/// The extension, which cargo builds beside this test.
fn extension() -> PathBuf {
    let (prefix, suffix) = (env::consts::DLL_PREFIX, env::consts::DLL_SUFFIX);
    let name = format!("{prefix}straightline_python{suffix}");
    let test = env::current_exe().expect("a test knows where it is");
    let folder = test.parent().expect("a file is in a folder");
    let places = [folder.join(&name), folder.with_file_name(&name)];
    let built = places.into_iter().filter_map(|path| Some((fs::metadata(&path).ok()?.modified().ok()?, path)));
    built.max().map(|(_, path)| path).unwrap_or_else(|| panic!("{name} was not built beside {}", test.display()))
}

/// The package as it is installed: Python's files, and the extension beside them.
fn package(folder: &Path) {
    let package = folder.join("straightline");
    fs::create_dir_all(&package).expect("the folder can be made");
    let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("python/straightline");
    for entry in fs::read_dir(sources).expect("the sources are there") {
        let path = entry.expect("the folder can be read").path();
        if path.is_file() {
            fs::copy(&path, package.join(path.file_name().expect("it is a file"))).expect("it can be copied");
        }
    }
    let name = if cfg!(windows) { "_straightline.pyd" } else { "_straightline.abi3.so" };
    fs::copy(extension(), package.join(name)).expect("the extension can be copied");
}

#[test]
fn the_package_does_what_its_tests_say() {
    let Some(python) = python() else {
        println!("skipped: no Python 3.9 with NumPy (`python/environment` makes one, `PYTHON` names one)");
        return;
    };
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("python-{}", std::process::id()));
    package(&folder);
    let tests = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests");
    let files = fs::read_dir(&tests).expect("the tests are there").map(|entry| entry.expect("the folder can be read"));
    let mut files: Vec<String> = files.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    files.retain(|name| name.starts_with("test_") && name.ends_with(".py"));
    files.sort();
    let mut failed = String::new();
    // each in a process of its own: where JAX has threads, processes should not be forked
    for file in &files {
        let mut command = Command::new(&python);
        command
            .args(["-B", "-m", "unittest", "discover", "--verbose", "--pattern", file, "--start-directory"])
            .arg(&tests);
        // nothing of what an earlier build has kept
        command.env("PYTHONPATH", &folder).env("XDG_CACHE_HOME", folder.join("cache")).current_dir(&folder);
        let output = command.output().expect("Python starts");
        let said = String::from_utf8_lossy(&output.stderr);
        said.lines().filter(|line| line.contains("skipped")).for_each(|line| println!("{line}"));
        if !output.status.success() {
            failed += &format!("{file}\n{}\n{said}\n", String::from_utf8_lossy(&output.stdout));
        }
    }
    assert!(!files.is_empty(), "no tests are in {}", tests.display());
    let _ = fs::remove_dir_all(&folder);
    assert!(failed.is_empty(), "{failed}");
}
