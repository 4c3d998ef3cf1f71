//! `nicolson list`: what a scene can choose from, and which scenes there are.
#![allow(clippy::print_stdout, reason = "this is the command line's output")]

use std::path::{Path, PathBuf};

use super::DONE;
use crate::scene::Scene;

/// Choices by key, as in scene files.
const CHOICES: [(&str, &str); 12] = [
    ("body.shape", "box, mapped_box, ring"),
    (
        "body.material",
        "linear_volumetric, hyperelastic_volumetric, linear_elastic, st_venant_kirchhoff, neo_hookean, mooney_rivlin, nearly_incompressible",
    ),
    ("body.kernel", "cubic_spline, wendland_c2, quintic_spline"),
    ("body.weights", "auto, balanced, cells, separate, single"),
    ("body.cofactor", "geometric, evolved"),
    ("body.volume_ratio", "auto, determinant, evolved"),
    ("time.scheme (explicit)", "forward_euler, tvd_rk2, tvd_rk3, rk4, rkc, velocity_verlet"),
    (
        "time.scheme (implicit)",
        "backward_euler, crank_nicolson, theta, midpoint, tr_bdf2, sdirk3, generalised_alpha, energy_momentum",
    ),
    ("newton.line_search", "none, backtracking, more_thuente, hager_zhang, trust_region"),
    ("newton.tangent", "full, modified, lagged, lbfgs, broyden"),
    ("newton.unknowns", "auto, velocity, velocity_jacobian, full"),
    ("linear.solver", "auto, lu, ldlt, cholesky, gmres, bicgstab, cg"),
];

/// Prints the choices, and the scenes found in `directory`.
pub fn list(directory: &Path) -> u8 {
    for (key, values) in CHOICES {
        println!("{key:24} {values}");
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
