//! `ψ = κ(J−1)²/2`, `p = −κ(J−1)` (document 004, (3.11)). Defined for every J; collapse to `J = 0`
//! costs a finite energy `κ/2`, which is the instability of (6.28).

/// Linear volumetric law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearVolumetric {
    /// Reference density, kg/m³.
    pub density: f64,
    /// Bulk modulus κ, Pa.
    pub bulk_modulus: f64,
}

impl LinearVolumetric {
    /// `c = √(κ/ρ)`, m/s.
    pub fn wave_speed(&self) -> f64 {
        (self.bulk_modulus / self.density).sqrt()
    }

    /// `ψ = κ(J−1)²/2`, J/m³.
    pub fn energy(&self, j: f64) -> f64 {
        0.5 * self.bulk_modulus * (j - 1.0) * (j - 1.0)
    }

    /// `p = −κ(J−1)`, Pa.
    pub fn pressure(&self, j: f64) -> f64 {
        // Written so that the pressure at rest is +0, not −0.
        self.bulk_modulus * (1.0 - j)
    }

    /// `dp/dJ = −κ`, Pa.
    pub fn pressure_slope(&self, _j: f64) -> f64 {
        -self.bulk_modulus
    }

    /// `(ψ₁ − ψ₀)/(J₁ − J₀) = κ(½(J₀+J₁) − 1)` and its derivative with respect to `J₁`, Pa.
    pub fn discrete_slope(&self, j0: f64, j1: f64) -> (f64, f64) {
        (self.bulk_modulus * (0.5 * (j0 + j1) - 1.0), 0.5 * self.bulk_modulus)
    }

    /// `J = 1 − p/κ`.
    pub fn volume_ratio_at(&self, pressure: f64) -> Option<f64> {
        Some(1.0 - pressure / self.bulk_modulus)
    }
}
