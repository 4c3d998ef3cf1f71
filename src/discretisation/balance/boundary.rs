//! What the faces of a body ask of its gradient weights.
//!
//! Every face `f` (area `a_f`, outward normal `N_f`) acts at a point `X_f` and is carried by particles
//! through an interpolation `r_f` that is exact for linear fields, `Σ_a r_f(a) = 1` and
//! `Σ_a r_f(a) X_a = X_f`. A particle gathers from its faces
//!
//! ```text
//! e_I(a) = Σ_f a_f N_f,I r_f(a)        m_IJ(a) = Σ_f a_f N_f,I r_f(a) (X_f − X_a)_J
//! ```
//!
//! Where a particle lies on the boundary (vertex layout), `X_f` is the particle and `r_f` names it alone.
//! Where it lies inside (cell layout), `r_f` extrapolates over its neighbours.

use super::super::{DiscretisationError, Neighbourhood, describe_particle};
use crate::kernel;
use crate::setup::{Body, Particles};
use crate::tensor::{Tensor, Vector, inverse, outer};

/// Faces whose normals enclose more than 30° meet at an edge; less is a curved surface in pieces.
const COSINE_OF_SMOOTH: f64 = 0.866_025_403_784_438_6;
/// Distances below this part of the spacing are rounding: the particle lies on the boundary.
const ON_BOUNDARY: f64 = 1e-9;
/// Relative error with which a surface must close.
const CLOSED: f64 = 1e-10;
/// Width of the weight of the extrapolation, in smoothing lengths: all neighbours of the particle
/// inside the face have a say (a narrower one makes larger changes of the gradient necessary).
const EXTRAPOLATION_WIDTH: f64 = 1.5;

/// What particles carry of the boundary; indices count from the first particle of the body.
pub(super) struct Boundary<const D: usize> {
    /// `e(a)`: the area vector.
    pub areas: Vec<Vector<D>>,
    /// `m(a)`: rows are the direction of the normal, columns that of the lever.
    pub moments: Vec<Tensor<D>>,
    /// Whether faces meet at an edge here.
    pub edges: Vec<bool>,
}

impl<const D: usize> Boundary<D> {
    /// Gathers the faces of a body.
    ///
    /// # Errors
    /// If there are none, if they do not close, or if they do not enclose the volume of the particles.
    pub fn new(
        body: &Body,
        particles: &Particles<D>,
        neighbourhood: &Neighbourhood,
    ) -> Result<Self, DiscretisationError> {
        let first = body.particles.start;
        let count = body.particles.len();
        let faces = || particles.faces.iter().filter(|face| body.particles.contains(&face.particle));
        if faces().next().is_none() {
            return Err(unsuited(
                body,
                "has no faces, and balanced weights need a description of the boundary".into(),
                "describe the body by a shape instead of a list of points, or use weights = \"separate\"",
            ));
        }
        check(body, particles)?;
        let mut boundary = Self {
            areas: vec![Vector::zeros(); count],
            moments: vec![Tensor::zeros(); count],
            edges: vec![false; count],
        };
        let mut normals: Vec<Option<Vector<D>>> = vec![None; count];
        for face in faces() {
            let own = face.particle - first;
            let normal = *normals[own].get_or_insert(face.normal);
            boundary.edges[own] |= normal.dot(&face.normal) < COSINE_OF_SMOOTH;
            let area = face.normal * face.area;
            let point = face.point;
            for (b, share) in face_shares(body, particles, neighbourhood, face.particle, &point)? {
                if b == face.particle && share == 1.0 {
                    boundary.areas[own] += area;
                    continue;
                }
                boundary.areas[b - first] += area * share;
                boundary.moments[b - first] += outer(&(area * share), &(point - particles.positions[b]));
            }
        }
        Ok(boundary)
    }
}

/// Whether constant stress can be balanced: the faces must close, and enclose the volume of the particles.
fn check<const D: usize>(body: &Body, particles: &Particles<D>) -> Result<(), DiscretisationError> {
    let volume: f64 = particles.volumes[body.particles.clone()].iter().sum();
    let (mut total, mut sum) = (0.0, Vector::<D>::zeros());
    let mut enclosed = Tensor::<D>::zeros();
    // From a particle of the body, so that its place in space costs no digits.
    let origin = particles.positions[body.particles.start];
    for face in particles.faces.iter().filter(|face| body.particles.contains(&face.particle)) {
        total += face.area;
        sum += face.normal * face.area;
        enclosed += outer(&face.normal, &(face.point - origin)) * face.area;
    }
    if exceeds(sum.norm(), CLOSED * total) {
        let open = sum.norm() / total;
        return Err(unsuited(
            body,
            format!("has faces that do not close: |Σ a N| = {open:.1e} Σ a"),
            "give every piece of the boundary a face, or use weights = \"separate\"",
        ));
    }
    let found = enclosed.trace() / D as f64;
    if exceeds((found - volume).abs(), CLOSED * volume) {
        return Err(unsuited(
            body,
            format!("has faces that enclose a volume of {found:e}, where its particles add up to {volume:e}"),
            "make volumes and faces agree, or use weights = \"separate\"",
        ));
    }
    let skew = (enclosed - Tensor::identity() * volume).norm() / volume;
    if exceeds(skew, CLOSED) {
        return Err(unsuited(
            body,
            format!(
                "has faces with Σ a N ⊗ X off |Ω| I by {skew:.1e} |Ω|, so that no weights balance a constant stress"
            ),
            "make volumes and faces agree, or use weights = \"separate\"",
        ));
    }
    Ok(())
}

/// The interpolation `r_f` of a face: particles around `a`, which carries it, with their shares; `a` alone if it lies on
/// the face.
///
/// # Errors
/// If the neighbours of `a` do not span space.
pub(crate) fn face_shares<const D: usize>(
    body: &Body,
    particles: &Particles<D>,
    neighbourhood: &Neighbourhood,
    a: usize,
    point: &Vector<D>,
) -> Result<Vec<(usize, f64)>, DiscretisationError> {
    if (point - particles.positions[a]).norm() <= ON_BOUNDARY * body.spacing {
        return Ok(vec![(a, 1.0)]);
    }
    extrapolation(body, particles, neighbourhood, a, point)
}

/// Moving least squares over the neighbours of a particle, evaluated at a point nearby:
/// `r_b = ω_b (1/S − (d_b − d̄)·C⁻¹ d̄)` with `d_b = X_b − X_f`, its mean `d̄` and covariance `C`.
fn extrapolation<const D: usize>(
    body: &Body,
    particles: &Particles<D>,
    neighbourhood: &Neighbourhood,
    a: usize,
    point: &Vector<D>,
) -> Result<Vec<(usize, f64)>, DiscretisationError> {
    let width = EXTRAPOLATION_WIDTH * body.smoothing * body.spacing;
    let distances = || neighbourhood.of(a).iter().map(|&b| (b as usize, particles.positions[b as usize] - point));
    let weighted = || distances().map(|(b, d)| (b, d, kernel::value(body.kernel, D, d.norm(), width)));
    let total: f64 = weighted().map(|(_, _, weight)| weight).sum();
    let mut mean = Vector::<D>::zeros();
    for (_, distance, weight) in weighted() {
        mean += distance * (weight / total);
    }
    let mut covariance = Tensor::<D>::zeros();
    for (_, distance, weight) in weighted() {
        covariance += outer(&(distance - mean), &(distance - mean)) * weight;
    }
    let inverse = inverse(&covariance).filter(|inverse| inverse.iter().all(|entry| entry.is_finite()));
    let Some(inverse) = inverse else {
        return Err(DiscretisationError {
            place: describe_particle(a, &particles.positions[a]),
            reason: "its neighbours do not allow to extrapolate to its face".into(),
            remedy: "increase `smoothing`, or use weights = \"separate\"".into(),
        });
    };
    let slope = inverse * mean;
    Ok(weighted().map(|(b, distance, weight)| (b, weight * (1.0 / total - (distance - mean).dot(&slope)))).collect())
}

/// A body that cannot be balanced at all.
fn unsuited(body: &Body, reason: String, remedy: &str) -> DiscretisationError {
    DiscretisationError { place: format!("body `{}`", body.name), reason, remedy: remedy.into() }
}

/// Whether a value is above its limit, or no number at all.
fn exceeds(value: f64, limit: f64) -> bool {
    value.is_nan() || value > limit
}
