//! Laws of the volume ratio J alone: energy density `ψ(J)`, pressure `p = −dψ/dJ` (positive in
//! compression), and its slope. The stress is `P = −p H` with the cofactor H. Printed (3.12) of
//! document 004 has the opposite sign of p next to "negative is compression"; everywhere else
//! compression is positive, as here.

use super::{HyperelasticVolumetric, LinearVolumetric};

/// A law of the volume ratio.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Volumetric {
    /// See [`LinearVolumetric`].
    Linear(LinearVolumetric),
    /// See [`HyperelasticVolumetric`].
    Hyperelastic(HyperelasticVolumetric),
}

macro_rules! delegate {
    ($self:ident, $law:ident => $body:expr) => {
        match $self {
            Volumetric::Linear($law) => $body,
            Volumetric::Hyperelastic($law) => $body,
        }
    };
}

impl Volumetric {
    /// Reference density, kg/m³.
    pub fn density(&self) -> f64 {
        delegate!(self, law => law.density)
    }

    /// Speed of pressure waves at rest, m/s.
    pub fn wave_speed(&self) -> f64 {
        delegate!(self, law => law.wave_speed())
    }

    /// Energy density `ψ(J)`, J/m³. NaN or infinite outside the domain.
    pub fn energy(&self, j: f64) -> f64 {
        delegate!(self, law => law.energy(j))
    }

    /// Pressure `p(J) = −dψ/dJ`, Pa.
    pub fn pressure(&self, j: f64) -> f64 {
        delegate!(self, law => law.pressure(j))
    }

    /// Slope `dp/dJ`, Pa.
    pub fn pressure_slope(&self, j: f64) -> f64 {
        delegate!(self, law => law.pressure_slope(j))
    }

    /// Discrete derivative `(ψ(J₁) − ψ(J₀))/(J₁ − J₀)`, Pa, and its derivative with respect to `J₁`;
    /// smooth through `J₁ = J₀`, where it is `ψ′`.
    pub fn discrete_slope(&self, j0: f64, j1: f64) -> (f64, f64) {
        delegate!(self, law => law.discrete_slope(j0, j1))
    }

    /// The volume ratio at a given pressure; `None` if the law cannot reach it.
    pub fn volume_ratio_at(&self, pressure: f64) -> Option<f64> {
        delegate!(self, law => law.volume_ratio_at(pressure))
    }

    /// Whether the law needs `J > 0` and `det F > 0`.
    pub fn needs_positive_volume(&self) -> bool {
        matches!(self, Self::Hyperelastic(_))
    }

    /// Whether the pressure is linear in J.
    pub fn is_linear(&self) -> bool {
        matches!(self, Self::Linear(_))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn table() -> Vec<Volumetric> {
        let hyperelastic =
            |exponent| Volumetric::Hyperelastic(HyperelasticVolumetric { density: 900.0, bulk_modulus: 2e4, exponent });
        vec![
            Volumetric::Linear(LinearVolumetric { density: 1000.0, bulk_modulus: 1e6 }),
            hyperelastic(1.0),
            hyperelastic(1.4),
            hyperelastic(7.0),
        ]
    }

    #[test]
    fn pressure_and_slope_are_derivatives_of_the_energy() {
        for law in table() {
            for j in [0.6, 0.9, 1.0, 1.2, 2.0] {
                let h = 1e-6;
                let scale = law.density() * law.wave_speed().powi(2);
                let p = -(law.energy(j + h) - law.energy(j - h)) / (2.0 * h);
                assert_relative_eq!(law.pressure(j) / scale, p / scale, epsilon = 1e-7);
                let slope = (law.pressure(j + h) - law.pressure(j - h)) / (2.0 * h);
                assert_relative_eq!(law.pressure_slope(j) / scale, slope / scale, epsilon = 1e-6, max_relative = 1e-7);
            }
            assert_eq!(law.energy(1.0), 0.0);
            assert_eq!(law.pressure(1.0), 0.0);
            let c2 = -law.pressure_slope(1.0) / law.density();
            assert_relative_eq!(c2.sqrt(), law.wave_speed(), max_relative = 1e-14);
        }
    }

    #[test]
    fn the_discrete_slope_is_exact_and_smooth_through_equal_states() {
        for law in table() {
            let scale = law.density() * law.wave_speed().powi(2);
            for j0 in [0.7, 1.0, 1.5] {
                for step in [0.0, 1e-12, 1e-7, 9e-4, 1.1e-3, 1e-2, -0.2, 0.4] {
                    let j1 = j0 + step;
                    let (slope, by_end) = law.discrete_slope(j0, j1);
                    // Exactness, where the quotient itself can be trusted.
                    let quotient = (law.energy(j1) - law.energy(j0)) / step;
                    if step.abs() > 1e-3 {
                        assert_relative_eq!(slope / scale, quotient / scale, epsilon = 1e-13, max_relative = 1e-12);
                    }
                    // ψ* = ψ′(mean) + ψ‴ ΔJ²/24 + …, with ψ‴ up to 56 J⁻⁹ κ in this table.
                    let middle = -law.pressure(0.5 * (j0 + j1));
                    if step.abs() <= 1e-2 {
                        assert!((slope - middle).abs() < scale * (20.0 * step * step + 1e-13));
                    }
                    let h = 1e-5;
                    let numeric = (law.discrete_slope(j0, j1 + h).0 - law.discrete_slope(j0, j1 - h).0) / (2.0 * h);
                    assert_relative_eq!(by_end / scale, numeric / scale, epsilon = 1e-8, max_relative = 1e-7);
                }
            }
        }
    }

    #[test]
    fn volume_ratio_inverts_the_pressure() {
        for law in table() {
            for j in [0.7, 1.0, 1.3] {
                assert_relative_eq!(law.volume_ratio_at(law.pressure(j)).expect("reachable"), j, epsilon = 1e-12);
            }
        }
        // A hyperelastic fluid cannot be pulled below −κ.
        assert_eq!(table()[3].volume_ratio_at(-3e4), None);
    }
}
