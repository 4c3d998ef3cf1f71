//! Scenes written out in a test, without a file of their own.

use std::path::Path;

use nicolson::scene::{Scene, SceneErrors};
use nicolson::setup::Setup;

/// All schemes that step in time.
pub const SCHEMES: [&str; 14] = [
    "forward_euler",
    "tvd_rk2",
    "tvd_rk3",
    "rk4",
    "rkc",
    "velocity_verlet",
    "backward_euler",
    "crank_nicolson",
    "theta",
    "midpoint",
    "tr_bdf2",
    "sdirk3",
    "generalised_alpha",
    "energy_momentum",
];

/// Reads `scene.toml`.
pub fn parse(text: &str) -> Result<Scene, SceneErrors> {
    Scene::parse(text, "scene.toml", Path::new(""), &[])
}

/// A scene that is right.
pub fn scene(text: &str) -> Scene {
    parse(text).unwrap_or_else(|errors| panic!("{errors}"))
}

/// Set-up and warnings; the files of the scene are sought in a folder.
pub fn read<const D: usize>(text: &str, folder: &Path) -> Result<(Setup<D>, Vec<String>), SceneErrors> {
    Scene::parse(text, "scene.toml", folder, &[])?.setup::<D>()
}

/// Set-up and warnings of a scene that is right.
pub fn set_up<const D: usize>(text: &str) -> (Setup<D>, Vec<String>) {
    read(text, Path::new("")).unwrap_or_else(|errors| panic!("{errors}"))
}
