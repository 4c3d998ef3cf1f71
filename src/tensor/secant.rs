//! The determinant's discrete derivative: a tensor `H*` with `H* : (F₁ − F₀) = det F₁ − det F₀` exactly,
//! and with `H* F̄ᵀ` symmetric, so that a stress along it turns no body (Gonzalez 2000; the polynomial
//! form in C after Betsch, Janz and Hesch 2018).
//!
//! | D | `H*` |
//! |---|---|
//! | 1 | 1 |
//! | 2 | `cof F̄` |
//! | 3 | `F̄ (2/(√det C₀ + √det C₁)) (cof C̄ + cof(ΔC)/12)` |
//!
//! The simpler `cof F̄ + cof(ΔF)/12` in 3D has the first property alone.

use super::{Tensor, cofactor, cofactor_variation, contract, determinant};

/// Two configurations and their mean `F̄`.
#[derive(Debug, Clone, Copy)]
pub struct CofactorSecant<const D: usize> {
    /// `F₀`.
    pub start: Tensor<D>,
    /// `F̄ = ½(F₀ + F₁)`.
    pub mean: Tensor<D>,
    /// `F₁`.
    pub end: Tensor<D>,
    /// `det F₀`.
    pub start_determinant: f64,
}

impl<const D: usize> CofactorSecant<D> {
    /// From the start (and its determinant) and the mean.
    pub fn new(start: Tensor<D>, start_determinant: f64, mean: Tensor<D>) -> Self {
        Self { start, mean, end: mean * 2.0 - start, start_determinant }
    }

    /// `H*`.
    pub fn value(&self) -> Tensor<D> {
        if D < 3 {
            cofactor(&self.mean)
        } else {
            let (core, scale) = self.core();
            self.mean * core * scale
        }
    }

    /// `∂H*/∂F̄ : A`.
    pub fn variation(&self, direction: &Tensor<D>) -> Tensor<D> {
        if D < 3 {
            return cofactor_variation(&self.mean, direction);
        }
        let (core, scale) = self.core();
        // δF₁ = 2 δF̄.
        let end_variation = direction * 2.0;
        let half = self.end.transpose() * end_variation;
        let c_variation = half + half.transpose();
        let (c0, c1) = self.cauchy_green();
        let core_variation = cofactor_variation(&((c0 + c1) * 0.5), &c_variation) * 0.5
            + cofactor_variation(&(c1 - c0), &c_variation) / 12.0;
        let scale_variation = -0.5 * scale * scale * contract(&cofactor(&self.end), &end_variation);
        (direction * core + self.mean * core_variation) * scale + self.mean * core * scale_variation
    }

    fn cauchy_green(&self) -> (Tensor<D>, Tensor<D>) {
        (self.start.transpose() * self.start, self.end.transpose() * self.end)
    }

    /// `cof C̄ + cof(ΔC)/12` and `2/(√det C₀ + √det C₁)`.
    fn core(&self) -> (Tensor<D>, f64) {
        let (c0, c1) = self.cauchy_green();
        let core = cofactor(&((c0 + c1) * 0.5)) + cofactor(&(c1 - c0)) / 12.0;
        (core, 2.0 / (self.start_determinant + determinant(&self.end)))
    }
}
