//! What gradient weights cost at set-up, by how they are balanced, up to a million particles.
//!
//! `cargo bench --bench balanced_weights [-- MOST]`: boxes, plain and with inner particles shaken by 20 %, of up to
//! `MOST` particles (default 1e6). Printed are the time of the kernel's weights without balancing, and with.
#![allow(clippy::print_stdout, reason = "a bench reports on the terminal")]

use std::time::Instant;

use nicolson::discretisation::Gradient;
use nicolson::geometry::{BoxLattice, Layout, MappedLattice};
use nicolson::material::Material;
use nicolson::model::Noise;
use nicolson::setup::{Body, CofactorChoice, KernelChoice, VolumeRatioChoice, WeightChoice};

fn measure<const D: usize>(cells: usize, shake: f64) -> Result<(), Box<dyn std::error::Error>> {
    let lattice = BoxLattice::with_counts([0.0; D], [1.0; D], [cells; D], Layout::Vertex)?;
    let (spacing, mut noise) = (lattice.mean_spacing(), Noise::new(1));
    let particles = match shake {
        0.0 => lattice.particles(),
        _ => MappedLattice::shaken(lattice, shake, || noise.next(), |x| x)?.particles(),
    };
    let count = particles.positions.len();
    print!("{D}D {count:>8} particles, shaken by {shake}:");
    for (name, weights) in
        [("separate", WeightChoice::Separate), ("cells", WeightChoice::Cells), ("least change", WeightChoice::Balanced)]
    {
        let mut body = body(spacing, count);
        body.weights = weights;
        let start = Instant::now();
        match Gradient::build(&[body], &particles) {
            Ok(built) => {
                let seconds = start.elapsed().as_secs_f64();
                let residual = built.balance.first().map_or(f64::NAN, |report| report.residual);
                print!("  {name} {seconds:.2} s (residual {residual:.0e})");
            }
            Err(error) => print!("  {name}: {}", error.reason),
        }
    }
    println!();
    Ok(())
}

fn body(spacing: f64, count: usize) -> Body {
    Body {
        name: "box".into(),
        particles: 0..count,
        spacing,
        kernel: KernelChoice::CubicSpline,
        smoothing: 1.0,
        weights: WeightChoice::Auto,
        material: Material::linear_volumetric(1.0, 1.0),
        cofactor: CofactorChoice::Geometric,
        volume_ratio: VolumeRatioChoice::Auto,
        hourglass: None,
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let most = std::env::args().skip(1).find_map(|text| text.parse::<f64>().ok()).unwrap_or(1e6);
    for total in [1e4, 1e5, 1e6].into_iter().filter(|total| *total <= most) {
        for shake in [0.0, 0.2] {
            measure::<2>(f64::sqrt(total).round() as usize, shake)?;
            measure::<3>(f64::cbrt(total).round() as usize, shake)?;
        }
    }
    Ok(())
}
