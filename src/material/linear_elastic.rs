//! Linear elasticity: `ψ = ½λ(tr ε)² + μ ε:ε`, `P = λ tr(ε) I + 2με` with the small strain `ε = sym(F − I)`. For small
//! displacements and rotations only; it is not objective, and a rotation is a strain to it.

use crate::tensor::{Tensor, Tensor4, contract, tensor4_of};

/// Linear elastic law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearElastic {
    /// First Lamé parameter λ, Pa; that of plane or uniaxial stress where the scene asks for it.
    pub lambda: f64,
    /// Shear modulus μ, Pa.
    pub shear_modulus: f64,
}

impl LinearElastic {
    fn strain<const D: usize>(f: &Tensor<D>) -> Tensor<D> {
        let g = f - Tensor::identity();
        (g + g.transpose()) * 0.5
    }

    /// ψ, J/m³.
    pub fn energy<const D: usize>(&self, f: &Tensor<D>) -> f64 {
        let strain = Self::strain(f);
        0.5 * self.lambda * strain.trace().powi(2) + self.shear_modulus * contract(&strain, &strain)
    }

    /// P, Pa.
    pub fn stress<const D: usize>(&self, f: &Tensor<D>) -> Tensor<D> {
        let strain = Self::strain(f);
        Tensor::identity() * (self.lambda * strain.trace()) + strain * (2.0 * self.shear_modulus)
    }

    /// `∂P/∂F`, the same everywhere.
    pub fn tangent<const D: usize>(&self) -> Tensor4<D> {
        tensor4_of(|direction| self.stress(&(Tensor::identity() + direction)))
    }
}
