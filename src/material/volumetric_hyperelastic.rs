//! `ψ = κ(J−1−(J^{1−γ}−1)/(1−γ))` for γ > 1 and `κ(J−1−ln J)` for γ = 1; `p = κ(J^{−γ}−1)`
//! (document 004, (6.29)–(6.31)). Domain `J > 0`.

use super::chord;

/// Hyperelastic volumetric law (a nearly incompressible fluid of Tait type).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HyperelasticVolumetric {
    /// Reference density, kg/m³.
    pub density: f64,
    /// Bulk modulus κ, Pa.
    pub bulk_modulus: f64,
    /// Exponent γ ≥ 1.
    pub exponent: f64,
}

impl HyperelasticVolumetric {
    /// `c = √(γκ/ρ)`, m/s.
    pub fn wave_speed(&self) -> f64 {
        (self.exponent * self.bulk_modulus / self.density).sqrt()
    }

    /// Energy density, J/m³; NaN for `J < 0`, infinite at `J = 0`.
    ///
    /// `(J^{1−γ}−1)/(1−γ)` is written with `expm1`, so that γ → 1 has its limit `ln J` and small
    /// strains keep their digits.
    pub fn energy(&self, j: f64) -> f64 {
        let log = j.ln();
        let k = 1.0 - self.exponent;
        let power = if k == 0.0 { log } else { (k * log).exp_m1() / k };
        self.bulk_modulus * (j - 1.0 - power)
    }

    /// `p = κ(J^{−γ}−1)`, Pa; NaN for `J < 0`, infinite at `J = 0`.
    pub fn pressure(&self, j: f64) -> f64 {
        self.bulk_modulus * (-self.exponent * j.ln()).exp_m1()
    }

    /// `dp/dJ = −γκ J^{−γ−1}`, Pa.
    pub fn pressure_slope(&self, j: f64) -> f64 {
        -self.exponent * self.bulk_modulus * j.powf(-self.exponent - 1.0)
    }

    /// `(ψ₁ − ψ₀)/(J₁ − J₀)` and its derivative with respect to `J₁`, Pa.
    ///
    /// The first is `κ(1 − s)`, with the chord s of `(J^{1−γ}−1)/(1−γ)`.
    pub fn discrete_slope(&self, j0: f64, j1: f64) -> (f64, f64) {
        let (slope, by_end) = chord::power(1.0 - self.exponent, j0, j1);
        (self.bulk_modulus * (1.0 - slope), -self.bulk_modulus * by_end)
    }

    /// `J = (1 + p/κ)^{−1/γ}`; `None` at or below the largest tension −κ.
    pub fn volume_ratio_at(&self, pressure: f64) -> Option<f64> {
        let base = 1.0 + pressure / self.bulk_modulus;
        (base > 0.0).then(|| base.powf(-1.0 / self.exponent))
    }
}
