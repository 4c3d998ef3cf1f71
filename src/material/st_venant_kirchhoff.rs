//! St Venant–Kirchhoff: `ψ = ½λ(tr E)² + μ E:E`, `S = λ tr(E) I + 2μE`. Large rotations, small strains: in strong
//! compression it softens.

use super::isotropic::{Invariants, IsotropicEnergy, Response};

/// St Venant–Kirchhoff law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StVenantKirchhoff {
    /// First Lamé parameter λ, Pa.
    pub lambda: f64,
    /// Shear modulus μ, Pa.
    pub shear_modulus: f64,
}

impl IsotropicEnergy for StVenantKirchhoff {
    fn energy(&self, at: &Invariants) -> f64 {
        0.5 * self.lambda * at.trace * at.trace + self.shear_modulus * at.square
    }

    fn response(&self, at: &Invariants) -> Response {
        let mut curvature = [[0.0; 3]; 3];
        curvature[0][0] = self.lambda;
        Response { slope: [self.lambda * at.trace, self.shear_modulus, 0.0], curvature }
    }

    fn chord(&self, start: &Invariants, end: &Invariants) -> Response {
        let mut curvature = [[0.0; 3]; 3];
        curvature[0][0] = 0.5 * self.lambda;
        Response { slope: [self.lambda * 0.5 * (start.trace + end.trace), self.shear_modulus, 0.0], curvature }
    }
}
