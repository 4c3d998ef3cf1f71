//! Isotropic stored energies: functions of `e₁ = tr E`, `e₂ = E:E` and J, with the Green–Lagrange strain
//! `E = ½(FᵀF − I)` of the whole three-dimensional body.
//!
//! ```text
//! P       = ψ₁ F + 2 ψ₂ F E + ψ_J ∂J/∂F
//! P*      = s₁ F̄ + 2 s₂ F̄ Ē + s_J H*           with s₁ Δe₁ + s₂ Δe₂ + s_J ΔJ = ψ(end) − ψ(start)
//! ```
//!
//! P* is the stress of an energy–momentum step: `Δe₁ = F̄:ΔF`, `Δe₂ = 2 F̄Ē:ΔF` with `Ē = ½(E₀ + E₁)`, and
//! `ΔJ = H*:ΔF` hold exactly, so each law only has to split its own change of energy into chords. No quotient
//! by a small ΔC appears anywhere. `P* F̄ᵀ` is symmetric: angular momentum is exact as well.
//!
//! Strains instead of stretches keep the digits of small deformations.
//!
//! In two dimensions and in one, the remaining `k = 3 − D` directions are stretched by f: 1 in plane (uniaxial)
//! strain; in plane (uniaxial) stress the value at which `∂ψ/∂f = 0`, found by Newton's method at every particle.
//! The condensed tangent is `𝔸 − P_f ⊗ P_f/ψ_ff`.

use super::Transverse;
use crate::tensor::{CofactorSecant, Tensor, Tensor4, cofactor, cofactor_variation, contract, dilation, tensor4_of};

/// Invariants of a strain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Invariants {
    /// `e₁ = tr E`.
    pub trace: f64,
    /// `e₂ = E : E`.
    pub square: f64,
    /// J.
    pub ratio: f64,
    /// `J − 1`, with the digits that J has lost.
    pub dilation: f64,
}

/// Derivatives of an energy with respect to `(e₁, e₂, J)`, Pa. For a chord: its slopes, and how they change with the
/// invariants at the end.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Response {
    /// First derivatives.
    pub slope: [f64; 3],
    /// `curvature[i][j]`: derivative of `slope[i]` with respect to invariant j.
    pub curvature: [[f64; 3]; 3],
}

/// An isotropic stored energy.
pub trait IsotropicEnergy {
    /// ψ, J/m³; zero at rest.
    fn energy(&self, at: &Invariants) -> f64;

    /// First and second derivatives of ψ.
    fn response(&self, at: &Invariants) -> Response;

    /// Chords between two states.
    fn chord(&self, start: &Invariants, end: &Invariants) -> Response;
}

/// A configuration, with what every formula needs of it.
#[derive(Debug, Clone, Copy)]
struct Configuration<const D: usize> {
    deformation: Tensor<D>,
    strain: Tensor<D>,
    /// `det F − 1` of the D dimensions, and its derivative.
    dilation: f64,
    cofactor: Tensor<D>,
}

/// Number of directions outside the D dimensions.
const fn outside<const D: usize>() -> f64 {
    (3 - D) as f64
}

impl<const D: usize> Configuration<D> {
    fn new(deformation: &Tensor<D>) -> Self {
        let g = deformation - Tensor::identity();
        let strain = (g + g.transpose() + g.transpose() * g) * 0.5;
        Self { deformation: *deformation, strain, dilation: dilation(&g), cofactor: cofactor(deformation) }
    }

    /// Invariants with the outer directions stretched by `f`.
    fn invariants(&self, f: f64) -> Invariants {
        let k = outside::<D>();
        let outer = 0.5 * (f - 1.0) * (f + 1.0);
        let volume = f.powi(3 - D as i32);
        let dilation = if f == 1.0 { self.dilation } else { volume * self.dilation + (volume - 1.0) };
        Invariants {
            trace: self.strain.trace() + k * outer,
            square: contract(&self.strain, &self.strain) + k * outer * outer,
            ratio: 1.0 + dilation,
            dilation,
        }
    }

    /// First and second derivatives of the invariants with respect to `f`.
    fn by_stretch(&self, f: f64) -> ([f64; 3], [f64; 3]) {
        let k = outside::<D>();
        let det = 1.0 + self.dilation;
        let (first, second) = match D {
            1 => (2.0 * f, 2.0),
            _ => (1.0, 0.0),
        };
        ([k * f, k * f * (f * f - 1.0), first * det], [k, k * (3.0 * f * f - 1.0), second * det])
    }
}

/// Newton's iterations for the outer stretch, at most.
const MOST_ITERATIONS: usize = 60;

fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn along(curvature: &[[f64; 3]; 3], change: &[f64; 3]) -> [f64; 3] {
    [dot(&curvature[0], change), dot(&curvature[1], change), dot(&curvature[2], change)]
}

/// `∂ψ/∂f` and `∂²ψ/∂f²`.
fn stretch_slopes<const D: usize>(law: &impl IsotropicEnergy, at: &Configuration<D>, f: f64) -> (f64, f64) {
    let response = law.response(&at.invariants(f));
    let (first, second) = at.by_stretch(f);
    let curvature = dot(&first, &along(&response.curvature, &first)) + dot(&response.slope, &second);
    (dot(&response.slope, &first), curvature)
}

/// The outer stretch; `None` if no stretch is free of stress.
fn stretch<const D: usize>(law: &impl IsotropicEnergy, at: &Configuration<D>, transverse: Transverse) -> Option<f64> {
    if transverse == Transverse::Strain || D == 3 {
        return Some(1.0);
    }
    // The incompressible guess has the right sign for every law; ψ is finite for f > 0 only.
    let mut f = (1.0 + at.dilation).powf(-0.5 / outside::<D>()).clamp(0.2, 5.0);
    let unit = law.response(&at.invariants(f)).curvature[0][0].abs() + stretch_slopes(law, at, 1.0).1.abs();
    for _ in 0..MOST_ITERATIONS {
        let (slope, curvature) = stretch_slopes(law, at, f);
        if !slope.is_finite() || !curvature.is_finite() {
            return None;
        }
        // Away from a minimum, go downhill; never so far that f changes its sign.
        let step = if curvature > 0.0 { -slope / curvature } else { -slope.signum() * 0.1 * f };
        let step = step.clamp(-0.5 * f, f);
        f += step;
        if step.abs() <= 4.0 * f64::EPSILON * f || slope.abs() <= f64::EPSILON * unit {
            return Some(f);
        }
    }
    None
}

/// ψ, J/m³; `None` where no outer stretch is free of stress.
pub(super) fn energy<const D: usize>(law: &impl IsotropicEnergy, f: &Tensor<D>, transverse: Transverse) -> Option<f64> {
    let at = Configuration::new(f);
    stretch(law, &at, transverse).map(|outer| law.energy(&at.invariants(outer)))
}

/// P, Pa; `None` where no outer stretch is free of stress.
pub(super) fn stress<const D: usize>(
    law: &impl IsotropicEnergy,
    f: &Tensor<D>,
    transverse: Transverse,
) -> Option<Tensor<D>> {
    let at = Configuration::new(f);
    let outer = stretch(law, &at, transverse)?;
    Some(stress_at(&at, outer, &law.response(&at.invariants(outer)).slope))
}

fn stress_at<const D: usize>(at: &Configuration<D>, outer: f64, slope: &[f64; 3]) -> Tensor<D> {
    let along_strain = at.deformation * at.strain * (2.0 * slope[1]);
    at.deformation * slope[0] + along_strain + at.cofactor * (slope[2] * outer.powi(3 - D as i32))
}

/// J and the pressure `−⅓ tr σ`, Pa, with the stress across the outer directions.
pub(super) fn pressure<const D: usize>(
    law: &impl IsotropicEnergy,
    f: &Tensor<D>,
    transverse: Transverse,
) -> Option<(f64, f64)> {
    let at = Configuration::new(f);
    let outer = stretch(law, &at, transverse)?;
    let invariants = at.invariants(outer);
    let slope = law.response(&invariants).slope;
    let across = if D < 3 { outer * dot(&slope, &at.by_stretch(outer).0) } else { 0.0 };
    let trace = contract(&stress_at(&at, outer, &slope), f) + across;
    Some((invariants.ratio, -trace / (3.0 * invariants.ratio)))
}

/// `∂P/∂F`.
pub(super) fn tangent<const D: usize>(
    law: &impl IsotropicEnergy,
    f: &Tensor<D>,
    transverse: Transverse,
) -> Option<Tensor4<D>> {
    let at = Configuration::new(f);
    let outer = stretch(law, &at, transverse)?;
    let volume = outer.powi(3 - D as i32);
    let response = law.response(&at.invariants(outer));
    let along_strain = at.deformation * at.strain;
    // δP for given changes of the slopes.
    let by_slopes = |change: &[f64; 3]| {
        at.deformation * change[0] + along_strain * (2.0 * change[1]) + at.cofactor * (volume * change[2])
    };
    let condensed = (transverse == Transverse::Stress && D < 3).then(|| {
        let (first, _) = at.by_stretch(outer);
        let volume_slope = if D == 1 { 2.0 * outer } else { 1.0 };
        let by_stretch =
            by_slopes(&along(&response.curvature, &first)) + at.cofactor * (response.slope[2] * volume_slope);
        (by_stretch, stretch_slopes(law, &at, outer).1)
    });
    let (gradient, slope) = (at.deformation, response.slope);
    Some(tensor4_of(|direction| {
        let strain = symmetric(&(gradient.transpose() * direction));
        let change = [
            contract(&gradient, direction),
            2.0 * contract(&at.strain, &strain),
            volume * contract(&at.cofactor, direction),
        ];
        let mut out = by_slopes(&along(&response.curvature, &change))
            + direction * slope[0]
            + (direction * at.strain + gradient * strain) * (2.0 * slope[1])
            + cofactor_variation(&gradient, direction) * (slope[2] * volume);
        if let Some((by_stretch, curvature)) = &condensed {
            out -= by_stretch * (contract(by_stretch, direction) / curvature);
        }
        out
    }))
}

fn symmetric<const D: usize>(a: &Tensor<D>) -> Tensor<D> {
    (a + a.transpose()) * 0.5
}

/// P* of a step of plane strain or in three dimensions.
pub(super) fn conserving_stress<const D: usize>(law: &impl IsotropicEnergy, step: &CofactorSecant<D>) -> Tensor<D> {
    let (start, end) = (Configuration::new(&step.start), Configuration::new(&step.end));
    let slope = law.chord(&start.invariants(1.0), &end.invariants(1.0)).slope;
    let strain = (start.strain + end.strain) * 0.5;
    step.mean * slope[0] + step.mean * strain * (2.0 * slope[1]) + step.value * slope[2]
}

/// `∂P*/∂F̄`.
pub(super) fn conserving_tangent<const D: usize>(law: &impl IsotropicEnergy, step: &CofactorSecant<D>) -> Tensor4<D> {
    let (start, end) = (Configuration::new(&step.start), Configuration::new(&step.end));
    let response = law.chord(&start.invariants(1.0), &end.invariants(1.0));
    let slope = response.slope;
    let strain = (start.strain + end.strain) * 0.5;
    let along_strain = step.mean * strain;
    let cofactor = step.value;
    tensor4_of(|direction| {
        // δF₁ = 2 δF̄, and half of δE₁ reaches the mean strain.
        let end_strain = symmetric(&(step.end.transpose() * direction)) * 2.0;
        let change = [
            2.0 * contract(&step.end, direction),
            2.0 * contract(&end.strain, &end_strain),
            2.0 * contract(&end.cofactor, direction),
        ];
        let change = along(&response.curvature, &change);
        step.mean * change[0]
            + along_strain * (2.0 * change[1])
            + cofactor * change[2]
            + direction * slope[0]
            + (direction * strain + step.mean * end_strain * 0.5) * (2.0 * slope[1])
            + step.variation(direction) * slope[2]
    })
}
