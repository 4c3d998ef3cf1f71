//! Compressible neo-Hookean: `ψ = μ(½(I₁ − 3) − ln J) + λ U(J)` with `U = ½ ln²J` or `U = ½(J − 1)²`
//! (Bonet and Wood 2008, section 6.4; Simo and Hughes 1998). Here `½(I₁ − 3) = tr E`.

use super::isotropic::{Invariants, IsotropicEnergy, Response};
use super::{VolumetricForm, chord};

/// Compressible neo-Hookean law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NeoHookean {
    /// First Lamé parameter λ, Pa.
    pub lambda: f64,
    /// Shear modulus μ, Pa.
    pub shear_modulus: f64,
    /// U.
    pub volumetric: VolumetricForm,
}

impl IsotropicEnergy for NeoHookean {
    fn energy(&self, at: &Invariants) -> f64 {
        self.shear_modulus * (at.trace - at.dilation.ln_1p()) + self.lambda * self.volumetric.energy(at)
    }

    fn response(&self, at: &Invariants) -> Response {
        let (mu, j) = (self.shear_modulus, at.ratio);
        let (slope, second) = self.volumetric.slopes(at);
        let mut curvature = [[0.0; 3]; 3];
        curvature[2][2] = mu / (j * j) + self.lambda * second;
        Response { slope: [mu, 0.0, self.lambda * slope - mu / j], curvature }
    }

    fn chord(&self, start: &Invariants, end: &Invariants) -> Response {
        let mu = self.shear_modulus;
        let logarithm = chord::power(0.0, start.ratio, end.ratio);
        let volumetric = self.volumetric.chord(start, end);
        let mut curvature = [[0.0; 3]; 3];
        curvature[2][2] = self.lambda * volumetric.1 - mu * logarithm.1;
        Response { slope: [mu, 0.0, self.lambda * volumetric.0 - mu * logarithm.0], curvature }
    }
}
