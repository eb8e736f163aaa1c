//! What the page asks for, and the names by which it asks.

use crate::{base64, bench, code, drives};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use straightline_codegen::diagnostic::Source;
use straightline_codegen::options::{scene_file, Options};

/// A robot file and a scene file, as texts.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Files {
    /// The name of the robot file.
    pub name: String,
    /// Its text.
    pub text: String,
    /// Its bytes in base64 instead, where they are no text.
    pub bytes: Option<String>,
    /// The text of a scene file; empty: none.
    pub scene: String,
}

/// The name by which complaints call the scene.
pub const SCENE: &str = "scene.toml";

impl Files {
    /// The robot file.
    pub fn source(&self) -> Source {
        match self.bytes.as_deref().and_then(base64::decoded) {
            Some(bytes) => Source::from_bytes(&self.name, bytes),
            None => Source::new(&self.name, self.text.clone()),
        }
    }

    /// Options with the scene of these files and what is added to it.
    pub fn options(&self, added: &str, options: Options) -> Options {
        let scene = format!("{}{added}", self.scene);
        match scene.trim().is_empty() {
            true => options,
            false => scene_file::read_partly(&Source::new(SCENE, scene)).into_options(options),
        }
    }
}

/// The answer to a request by its name: JSON in, JSON out.
pub fn answer(name: &str, request: &[u8]) -> Vec<u8> {
    match name {
        "compile" => answered(request, code::compile),
        "bench" => answered(request, bench::bench),
        "drives" => answered(request, drives::answer),
        "version" => answered(request, |(): ()| straightline_codegen::VERSION),
        other => failure(&format!("there is no request `{other}`")),
    }
}

fn answered<R: DeserializeOwned, A: Serialize>(request: &[u8], of: impl FnOnce(R) -> A) -> Vec<u8> {
    match serde_json::from_slice(request) {
        Ok(request) => serde_json::to_vec(&of(request)).unwrap_or_else(|why| failure(&why.to_string())),
        Err(why) => failure(&format!("the request cannot be read: {why}")),
    }
}

fn failure(why: &str) -> Vec<u8> {
    serde_json::json!({ "failure": why }).to_string().into_bytes()
}
