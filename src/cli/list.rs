//! `nicolson list`: what a scene can choose from, and which scenes there are.
#![allow(clippy::print_stdout, reason = "this is the command line's output")]

use std::path::{Path, PathBuf};

use super::DONE;
use crate::scene::{Scene, schema};

/// Keys whose choices are shown; the choices are those of the schema.
const KEYS: [&str; 12] = [
    "body.shape",
    "body.material",
    "body.kernel",
    "body.weights",
    "body.cofactor",
    "body.volume_ratio",
    "time.scheme",
    "newton.line_search",
    "newton.tangent",
    "newton.unknowns",
    "linear.solver",
    "linear.preconditioner",
];

/// Prints the choices, and the scenes found in `directory`.
pub fn list(directory: &Path) -> u8 {
    for key in KEYS {
        println!("{key:24} {}", schema::choices(key).join(", "));
    }
    let mut scenes: Vec<PathBuf> = std::fs::read_dir(directory)
        .into_iter()
        .flatten()
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .collect();
    scenes.sort();
    if !scenes.is_empty() {
        println!("\nscenes in {}:", directory.display());
    }
    for path in scenes {
        let title = Scene::read(&path, &[]).map_or_else(|_| "(not a valid scene)".to_owned(), |scene| scene.title);
        println!("  {:40} {title}", path.display().to_string());
    }
    DONE
}
