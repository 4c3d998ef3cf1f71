//! Set-ups that tests share: perturbed lattices without a scene file.
#![allow(dead_code, reason = "every test file uses its own part of this module")]

pub mod scenes;
pub mod written;

use nicolson::material::Material;
use nicolson::model::Noise;
use nicolson::setup::*;
use nicolson::tensor::Vector;

/// A lattice of `counts` particles at `spacing`, vertex layout, interior positions shaken by
/// `shake` spacings.
pub fn particles<const D: usize>(counts: [usize; D], spacing: f64, shake: f64) -> Particles<D> {
    let mut noise = Noise::new(7);
    let mut particles = Particles::default();
    for flat in 0..counts.iter().product() {
        let mut rest: usize = flat;
        let index: [usize; D] = std::array::from_fn(|i| {
            let own = rest % counts[i];
            rest /= counts[i];
            own
        });
        let mut volume = 1.0;
        let mut position = Vector::<D>::zeros();
        for i in 0..D {
            let edge = index[i] == 0 || index[i] == counts[i] - 1;
            volume *= if edge { 0.5 * spacing } else { spacing };
            let shift = noise.next() * shake;
            position[i] = spacing * (index[i] as f64 + if edge { 0.0 } else { shift });
        }
        particles.positions.push(position);
        particles.volumes.push(volume);
        particles.kernel_volumes.push(spacing.powi(D as i32));
    }
    particles
}

/// A hyperelastic law with γ = 7, c = 10 m/s, ρ = 1000 kg/m³.
pub fn fluid() -> Material {
    Material::hyperelastic_volumetric(1000.0, 1e5 / 7.0, 7.0)
}

/// A linear law with the same wave speed.
pub fn linear() -> Material {
    Material::linear_volumetric(1000.0, 1e5)
}

/// One free body on a given cloud, at rest.
pub fn setup<const D: usize>(particles: Particles<D>, spacing: f64, material: Material) -> Setup<D> {
    let n = particles.positions.len();
    Setup {
        title: "test".into(),
        bodies: vec![Body {
            name: "body".into(),
            particles: 0..n,
            spacing,
            kernel: KernelChoice::CubicSpline,
            smoothing: 1.2,
            weights: WeightChoice::Separate,
            material,
            cofactor: CofactorChoice::Geometric,
            volume_ratio: VolumeRatioChoice::Auto,
            hourglass: Some(0.0),
        }],
        particles,
        constraints: vec![[Constraint::Free; D]; n],
        motions: Vec::new(),
        tractions: Vec::new(),
        gravity: Vector::zeros(),
        body_force: None,
        initial: InitialState {
            displacement: vec![Vector::zeros(); n],
            velocity: vec![Vector::zeros(); n],
            pressure: None,
            equilibrium: false,
        },
        stabilisation: None,
        probes: Vec::new(),
        exact: None,
        geometry: Vec::new(),
    }
}
