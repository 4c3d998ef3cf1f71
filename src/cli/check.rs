//! `nicolson check`: validate and predict, run nothing.
#![allow(clippy::print_stdout, reason = "this is the command line's output")]

use std::path::{Path, PathBuf};

use super::console::complain;
use super::{DONE, FAILED, WRONG_INPUT, report_error};
use crate::output::{Hold, OutputError, Preview};
use crate::scene::Scene;
use crate::setup::{Constraint, GeometryRecord, Setup};
use crate::simulation::{Forecast, RunError, prepare};
use crate::tensor::coordinates;

/// Times at which the loads of a preview are looked at: each is drawn as it is when it is largest.
const INSTANTS: usize = 64;

/// What is told of a scene.
struct Found {
    forecast: Forecast,
    geometry: Vec<GeometryRecord>,
    warnings: Vec<String>,
    /// Files of the preview.
    drawn: Option<Result<[PathBuf; 2], OutputError>>,
}

/// Prints the forecast of a scene, and draws it if told where.
pub fn check(scene: &Scene, preview: Option<&Path>) -> u8 {
    if let Some(path) = preview.filter(|path| path.extension().is_none_or(|end| !end.eq_ignore_ascii_case("png"))) {
        complain(&format!("--preview {}: previews are PNG; give a name that ends in .png", path.display()));
        return WRONG_INPUT;
    }
    let found = match scene.dimension() {
        1 => look::<1>(scene, preview),
        2 => look::<2>(scene, preview),
        _ => look::<3>(scene, preview),
    };
    let found = match found {
        Ok(found) => found,
        Err(error) => return report_error(&error),
    };
    print(scene, &found.forecast, &found.geometry, &found.warnings);
    match found.drawn {
        None => DONE,
        Some(Ok([_, png])) => {
            println!("preview              {}", png.display());
            DONE
        }
        Some(Err(error)) => {
            complain(&error.to_string());
            FAILED
        }
    }
}

fn look<const D: usize>(scene: &Scene, preview: Option<&Path>) -> Result<Found, RunError> {
    let prepared = prepare::<D>(scene)?;
    let setup = prepared.model.setup();
    let drawn = preview.map(|path| draw(scene, setup, &path.with_extension("")));
    let (forecast, geometry) = (prepared.forecast(scene), setup.geometry.clone());
    Ok(Found { forecast, geometry, warnings: prepared.warnings, drawn })
}

/// Draws particles, constraints and loads.
fn draw<const D: usize>(scene: &Scene, setup: &Setup<D>, stem: &Path) -> Result<[PathBuf; 2], OutputError> {
    let mut holds: Vec<Hold> = setup
        .constraints
        .iter()
        .map(|constraint| {
            if constraint.iter().any(|axis| matches!(axis, Constraint::Moving(_))) {
                Hold::Moving
            } else if constraint.iter().all(|axis| *axis == Constraint::Fixed) {
                Hold::Fixed
            } else if constraint.contains(&Constraint::Fixed) {
                Hold::PartlyFixed
            } else {
                Hold::Free
            }
        })
        .collect();
    let mut loads = Vec::new();
    for traction in &setup.tractions {
        let mut particles: Vec<usize> = traction.areas.iter().map(|(particle, _)| *particle).collect();
        particles.sort_unstable();
        particles.dedup();
        for particle in particles {
            let place = coordinates(&setup.particles.positions[particle]);
            let at = |instant: usize| -> Vec<f64> {
                let time = scene.time.end * instant as f64 / INSTANTS as f64;
                traction.value.iter().map(|field| field.value(place, time)).collect()
            };
            let size = |load: &[f64]| load.iter().map(|x| x * x).sum::<f64>();
            let largest = (0..=INSTANTS).map(at).max_by(|a, b| size(a).total_cmp(&size(b)));
            if holds[particle] == Hold::Free {
                holds[particle] = Hold::Loaded;
            }
            loads.push((particle, largest.unwrap_or_default()));
        }
    }
    let positions: Vec<f64> = setup.particles.positions.iter().flat_map(|x| x.iter().copied()).collect();
    let mut notes = Vec::new();
    if setup.gravity.norm() > 0.0 {
        let components: Vec<String> = setup.gravity.iter().map(f64::to_string).collect();
        notes.push(format!("gravity ({}) m/s²", components.join(", ")));
    }
    if setup.body_force.is_some() {
        notes.push("a body force".to_owned());
    }
    let spacing = setup.bodies.iter().map(|body| body.spacing).fold(f64::INFINITY, f64::min);
    let notes = notes.join(", ");
    Preview {
        title: &setup.title,
        dim: D,
        positions: &positions,
        holds: &holds,
        loads: &loads,
        spacing: if spacing.is_finite() { spacing } else { 0.0 },
        notes: &notes,
    }
    .write(stem)
}

fn print(scene: &Scene, forecast: &Forecast, geometry: &[GeometryRecord], warnings: &[String]) {
    println!("scene                {}", scene.title);
    println!("particles            {}", forecast.particles);
    println!("neighbours (mean)    {:.1}", forecast.mean_neighbours);
    if forecast.unknowns > 0 {
        println!("unknowns             {}", forecast.unknowns);
        println!("tangent entries      {}", forecast.entries);
        println!("equations            {}", if forecast.linear { "linear: one factorisation" } else { "nonlinear" });
    }
    println!("memory (estimate)    {:.1} MB", forecast.memory / 1e6);
    if let Some(available) = scene.memory_limit() {
        println!("memory (available)   {:.1} MB", available as f64 / 1e6);
    }
    println!("explicit step limit  {:.4e} s", forecast.explicit_step_limit);
    println!(
        "step                 {:.4e} s ({:.1} × explicit)",
        forecast.step,
        forecast.step / forecast.explicit_step_limit
    );
    println!("steps                {:.0}", forecast.steps);
    println!("explicit steps       {:.0}", (scene.time.end / forecast.explicit_step_limit).ceil());
    for record in geometry {
        print_geometry(record, scene.dimension());
    }
    for warning in warnings {
        println!("warning: {warning}");
    }
}

/// What filling a body came to.
fn print_geometry(record: &GeometryRecord, dimension: usize) {
    let (volume_unit, mass_unit) = match dimension {
        1 => ("m", "kg/m²"),
        2 => ("m²", "kg/m"),
        _ => ("m³", "kg"),
    };
    println!("body '{}' ({})", record.body, record.source);
    println!(
        "  volume, mass       {:.6e} {volume_unit}, {:.6e} {mass_unit} in {} particles",
        record.volume, record.mass, record.particles
    );
    if let (Some(exact), Some(volume), Some(mass)) = (record.exact_volume, record.volume_error, record.mass_error) {
        println!(
            "  exact volume       {exact:.6e} {volume_unit}; cells are off by {volume:.1e}, the mass by {mass:.1e}"
        );
    }
    if let (Some(triangles), Some(open)) = (record.triangles, record.open_edges) {
        println!("  triangles          {triangles}, open edges {open}");
    }
    if record.thin_cells > 0 {
        println!("  thinner than the spacing in {} cells", record.thin_cells);
    }
    if !record.has_faces {
        println!("  boundary           not known: no tractions, no balanced weights");
    }
}
