//! No file of the user is written over: neither the scene nor what it is made of.

use std::path::{Path, PathBuf};

use crate::output::REPORT_FILE;
use crate::scene::Scene;

/// Names that a run writes besides frames and pictures.
const WRITTEN: [&str; 4] = ["history.csv", "probes.csv", "fields.pvd", REPORT_FILE];

/// The scene and the files that it names, as far as they exist.
fn inputs(scene: &Scene) -> impl Iterator<Item = PathBuf> {
    let named = scene.files().into_iter().map(|file| scene.base().join(file));
    named.chain([PathBuf::from(scene.name())]).filter_map(|path| path.canonicalize().ok())
}

/// Refuses to write a file that the scene is read from.
pub fn spares(scene: &Scene, written: &[Option<&Path>]) -> Result<(), String> {
    let same = |path: &&Path| path.canonicalize().is_ok_and(|path| inputs(scene).any(|input| input == path));
    match written.iter().flatten().find(|path| same(path)) {
        None => Ok(()),
        Some(path) => Err(format!("{} is a file that the scene is read from; choose another name", path.display())),
    }
}

/// Refuses a directory where results would take the place of what the scene is read from.
pub fn spares_directory(scene: &Scene, directory: &Path) -> Result<(), String> {
    if directory.as_os_str().is_empty() {
        return Err("--out is empty; give a directory, such as results/first".to_owned());
    }
    let Ok(place) = directory.canonicalize() else { return Ok(()) };
    let taken = |input: &PathBuf| {
        let name = input.file_name().unwrap_or_default().to_string_lossy();
        let frame = name.starts_with("fields-") && name.ends_with(".vtu");
        input.parent() == Some(place.as_path()) && (frame || WRITTEN.contains(&&*name))
    };
    match inputs(scene).find(taken) {
        None => Ok(()),
        Some(input) => Err(format!(
            "results in {} would take the place of {}, which the scene is read from; choose another directory",
            directory.display(),
            input.display()
        )),
    }
}
