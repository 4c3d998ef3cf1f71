//! Kelvin–Voigt viscosity beside any law: `S_v = 2η(Ė − ⅓ tr(Ė) I) + ζ tr(Ė) I` with the rate of the Green–Lagrange
//! strain, `Ė = sym(Fᵀ L)` and L the velocity gradient in reference coordinates. It is objective, and dissipates
//! `S_v : Ė ≥ 0` at every particle.

use crate::tensor::{Tensor, Tensor4, contract, tensor4_of};

/// Kelvin–Voigt viscosity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KelvinVoigt {
    /// Shear viscosity η, Pa s.
    pub shear: f64,
    /// Bulk viscosity ζ, Pa s.
    pub bulk: f64,
}

impl KelvinVoigt {
    fn strain_rate<const D: usize>(f: &Tensor<D>, l: &Tensor<D>) -> Tensor<D> {
        let rate = f.transpose() * l;
        (rate + rate.transpose()) * 0.5
    }

    fn second_stress<const D: usize>(&self, rate: &Tensor<D>) -> Tensor<D> {
        rate * (2.0 * self.shear) + Tensor::identity() * ((self.bulk - 2.0 / 3.0 * self.shear) * rate.trace())
    }

    /// `P_v = F S_v`, Pa.
    pub fn stress<const D: usize>(&self, f: &Tensor<D>, l: &Tensor<D>) -> Tensor<D> {
        f * self.second_stress(&Self::strain_rate(f, l))
    }

    /// Power taken out per volume, `P_v : L`, W/m³.
    pub fn dissipation<const D: usize>(&self, f: &Tensor<D>, l: &Tensor<D>) -> f64 {
        let rate = Self::strain_rate(f, l);
        contract(&self.second_stress(&rate), &rate)
    }

    /// `∂P_v/∂F` and `∂P_v/∂L`.
    pub fn tangents<const D: usize>(&self, f: &Tensor<D>, l: &Tensor<D>) -> (Tensor4<D>, Tensor4<D>) {
        let stress = self.second_stress(&Self::strain_rate(f, l));
        let by_deformation = tensor4_of(|direction: &Tensor<D>| {
            direction * stress + f * self.second_stress(&Self::strain_rate(direction, l))
        });
        let by_rate = tensor4_of(|direction| f * self.second_stress(&Self::strain_rate(f, direction)));
        (by_deformation, by_rate)
    }

    /// `2η + ζ`-like modulus of the fastest decay, Pa s.
    pub fn modulus(&self) -> f64 {
        self.bulk + 4.0 / 3.0 * self.shear
    }
}
