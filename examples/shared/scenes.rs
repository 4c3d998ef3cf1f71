//! Scenes with overrides, for the programs that run scenes.

use std::path::Path;

use nicolson::scene::Scene;
use nicolson::simulation::{Prepared, prepare};

/// A scene, before its first step, with the values of some keys replaced.
///
/// # Errors
/// In words, if the scene is impossible.
pub fn prepared<const D: usize>(
    text: &str,
    name: &str,
    overrides: impl IntoIterator<Item = (&'static str, String)>,
) -> Result<Prepared<D>, String> {
    let overrides: Vec<(String, String)> = overrides.into_iter().map(|(key, value)| (key.to_owned(), value)).collect();
    let scene = Scene::parse(text, name, Path::new(""), &overrides).map_err(|errors| errors.to_string())?;
    prepare::<D>(&scene).map_err(|error| error.to_string())
}

/// The values asked for, or all.
pub fn chosen<T: Clone>(asked: &[T], all: impl IntoIterator<Item = T>) -> Vec<T> {
    if asked.is_empty() { all.into_iter().collect() } else { asked.to_vec() }
}
