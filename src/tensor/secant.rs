//! The determinant's discrete derivative: a tensor `H*` with `H* : (F₁ − F₀) = det F₁ − det F₀` exactly,
//! and with `H* F̄ᵀ` symmetric, so that a stress along it turns no body (Gonzalez 2000).
//!
//! | D | `H*` |
//! |---|---|
//! | 1 | 1 |
//! | 2 | `cof F̄` |
//! | 3 | `(I + K/4) cof F̄`, `K = cof(D)/3 + w⊗w`, with `ΔF F̄⁻¹ = D + w×`, D symmetric |
//!
//! In space symmetry takes K: there `ΔJ = cof F̄:ΔF + det(ΔF)/4`, and `det(D + w×) = det D + w·D w = K:D`. The simpler
//! `cof F̄ + cof(ΔF)/12` would lose angular momentum; the polynomial in C of Betsch, Janz and Hesch keeps it, too, but
//! after shear of size s it is nonlinear in `s³ ΔF` instead of `s ΔF`. In steps of 5 explicit ones a spinning body
//! could not go beyond s = 18 with it, and goes beyond 60 with this one (measured). The price of K: the mean
//! configuration must have a positive volume.

use super::{Tensor, Vector, cofactor, cofactor_variation, determinant, inverse, outer};

/// Two configurations, their mean `F̄`, and `H*` between them.
#[derive(Debug, Clone, Copy)]
pub struct CofactorSecant<const D: usize> {
    /// `F₀`.
    pub start: Tensor<D>,
    /// `F̄ = ½(F₀ + F₁)`.
    pub mean: Tensor<D>,
    /// `F₁`.
    pub end: Tensor<D>,
    /// `H*`.
    pub value: Tensor<D>,
    space: Option<Space<D>>,
}

/// The parts of `H* = (I + K/4) cof F̄` in three dimensions.
#[derive(Debug, Clone, Copy)]
struct Space<const D: usize> {
    inverse: Tensor<D>,
    cofactor: Tensor<D>,
    /// `A = ΔF F̄⁻¹`, its symmetric part and the axial vector of the skew one.
    increment: Tensor<D>,
    strain: Tensor<D>,
    spin: Vector<D>,
    /// `I + K/4`.
    factor: Tensor<D>,
}

impl<const D: usize> CofactorSecant<D> {
    /// From the start and the mean; `None` in three dimensions if the mean configuration has no positive volume.
    pub fn new(start: Tensor<D>, mean: Tensor<D>) -> Option<Self> {
        let end = mean * 2.0 - start;
        let cofactor = cofactor(&mean);
        if D < 3 {
            return Some(Self { start, mean, end, value: cofactor, space: None });
        }
        let inverse = inverse(&mean).filter(|_| determinant(&mean) > 0.0)?;
        let increment = (end - start) * inverse;
        let (strain, spin) = parts(&increment);
        let factor = Tensor::identity() + (super::cofactor(&strain) / 3.0 + outer(&spin, &spin)) * 0.25;
        let space = Space { inverse, cofactor, increment, strain, spin, factor };
        Some(Self { start, mean, end, value: factor * cofactor, space: Some(space) })
    }

    /// `∂H*/∂F̄ : A`.
    pub fn variation(&self, direction: &Tensor<D>) -> Tensor<D> {
        let by_cofactor = cofactor_variation(&self.mean, direction);
        let Some(space) = &self.space else { return by_cofactor };
        let (strain, spin) = parts(&((direction * 2.0 - space.increment * direction) * space.inverse));
        let change =
            cofactor_variation(&space.strain, &strain) / 3.0 + outer(&spin, &space.spin) + outer(&space.spin, &spin);
        change * space.cofactor * 0.25 + space.factor * by_cofactor
    }
}

/// Symmetric part of a tensor in three dimensions, and the axial vector of the skew one.
fn parts<const D: usize>(a: &Tensor<D>) -> (Tensor<D>, Vector<D>) {
    let spin = Vector::from_fn(|i, _| 0.5 * (a[((i + 2) % D, (i + 1) % D)] - a[((i + 1) % D, (i + 2) % D)]));
    ((a + a.transpose()) * 0.5, spin)
}
