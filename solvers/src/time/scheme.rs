//! The schemes by name.

use std::fmt;

use super::StepperError;
use super::rkc::RkcOptions;

/// A time integration scheme with its parameters.
///
/// `p` is the order of accuracy, "rates" the evaluations of `f` per step and "solves" the nonlinear
/// problems per step, both at constant step without error control.
///
/// | scheme | `p` | rates | solves | stability |
/// |---|---|---|---|---|
/// | [`ForwardEuler`](Self::ForwardEuler) | 1 | 1 | | amplifies every undamped oscillation |
/// | [`TvdRk2`](Self::TvdRk2) | 2 | 2 | | amplifies undamped oscillations by √(1 + z⁴/4), z = ωΔt |
/// | [`TvdRk3`](Self::TvdRk3) | 3 | 3 | | ωΔt ≤ √3 |
/// | [`Rk4`](Self::Rk4) | 4 | 4 | | ωΔt ≤ 2√2 |
/// | [`VelocityVerlet`](Self::VelocityVerlet) | 2 | 1 | | ωΔt < 2, no dissipation |
/// | [`Rkc`](Self::Rkc) | 2 | s | | damped systems up to Δtσ ≈ 0.653(s² − 1); none undamped |
/// | [`Theta`](Self::Theta) | 1 or 2 | 0 | 1 | A-stable for θ ≥ ½ |
/// | [`BackwardEuler`](Self::BackwardEuler) | 1 | 0 | 1 | L-stable |
/// | [`CrankNicolson`](Self::CrankNicolson) | 2 | 0 | 1 | A-stable, no dissipation |
/// | [`Midpoint`](Self::Midpoint) | 2 | 0 | 1 | A-stable, no dissipation, symplectic |
/// | [`TrBdf2`](Self::TrBdf2) | 2 | 0 | 2 | L-stable |
/// | [`Sdirk3`](Self::Sdirk3) | 3 | 0 | 3 | L-stable |
/// | [`GeneralisedAlpha`](Self::GeneralisedAlpha) | 2 | 0 | 1 | A-stable, ρ∞ chosen |
/// | [`EnergyMomentum`](Self::EnergyMomentum) | 2 | 0 | 1 | keeps a discrete energy, linear or not |
/// | [`Static`](Self::Static) | | 0 | 1 | no inertia: equilibrium at the end of every step |
///
/// A-stability is a statement about linear systems. For a nonlinear law only the last scheme bounds the
/// energy whatever the step.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Scheme {
    /// Forward Euler, `u₁ = u₀ + Δt f(t₀, u₀)`.
    ForwardEuler,
    /// Two-stage total-variation-diminishing Runge–Kutta (Shu & Osher 1988; Heun's method).
    TvdRk2,
    /// Three-stage total-variation-diminishing Runge–Kutta (Shu & Osher 1988).
    TvdRk3,
    /// The classical Runge–Kutta scheme of order 4.
    Rk4,
    /// Velocity Verlet, for systems with [`velocities`](super::System::velocities).
    VelocityVerlet,
    /// Runge–Kutta–Chebyshev of order 2 (Sommeijer, Shampine & Verwer 1998).
    Rkc(RkcOptions),
    /// `u₁ = u₀ + Δt ((1 − θ) f₀ + θ f₁)` with `0 < θ ≤ 1`.
    Theta(f64),
    /// The θ-scheme with θ = 1.
    BackwardEuler,
    /// The θ-scheme with θ = ½.
    CrankNicolson,
    /// Implicit mid-point rule, `u₁ = u₀ + Δt f(t₀ + Δt/2, (u₀ + u₁)/2)`.
    Midpoint,
    /// Trapezium to `t₀ + (2 − √2)Δt`, then BDF2 (Bank et al. 1985; Hosea & Shampine 1996).
    TrBdf2,
    /// Three-stage stiffly accurate singly diagonally implicit Runge–Kutta (Alexander 1977).
    Sdirk3,
    /// Generalised-α for first-order systems (Jansen, Whiting & Hulbert 2000).
    GeneralisedAlpha {
        /// Spectral radius ρ∞ at infinite frequency, 0 (annihilates) to 1 (no dissipation).
        spectral_radius: f64,
    },
    /// Energy–momentum step of a [`ConservingSystem`](super::ConservingSystem).
    EnergyMomentum,
    /// Equilibrium of an [`EquilibriumSystem`](super::EquilibriumSystem) at the end of every step of a pseudo-time.
    Static,
}

impl Scheme {
    /// Whether a step needs Newton's method.
    pub fn is_implicit(&self) -> bool {
        match self {
            Self::ForwardEuler | Self::TvdRk2 | Self::TvdRk3 | Self::Rk4 | Self::VelocityVerlet | Self::Rkc(_) => false,
            Self::Theta(_)
            | Self::BackwardEuler
            | Self::CrankNicolson
            | Self::Midpoint
            | Self::TrBdf2
            | Self::Sdirk3
            | Self::GeneralisedAlpha { .. }
            | Self::EnergyMomentum
            | Self::Static => true,
        }
    }

    /// Name in words, without parameters.
    pub fn name(&self) -> &'static str {
        match self {
            Self::ForwardEuler => "forward Euler",
            Self::TvdRk2 => "TVD-RK2",
            Self::TvdRk3 => "TVD-RK3",
            Self::Rk4 => "RK4",
            Self::VelocityVerlet => "velocity Verlet",
            Self::Rkc(_) => "Runge–Kutta–Chebyshev",
            Self::Theta(_) => "θ-scheme",
            Self::BackwardEuler => "backward Euler",
            Self::CrankNicolson => "Crank–Nicolson",
            Self::Midpoint => "implicit mid-point",
            Self::TrBdf2 => "TR-BDF2",
            Self::Sdirk3 => "SDIRK3",
            Self::GeneralisedAlpha { .. } => "generalised-α",
            Self::EnergyMomentum => "energy–momentum",
            Self::Static => "static",
        }
    }

    /// Order of accuracy.
    pub fn order(&self) -> usize {
        match self {
            Self::ForwardEuler | Self::BackwardEuler | Self::Static => 1,
            #[expect(clippy::float_cmp, reason = "only the exact value ½ raises the order")]
            Self::Theta(theta) => 1 + usize::from(*theta == 0.5),
            Self::TvdRk2
            | Self::VelocityVerlet
            | Self::Rkc(_)
            | Self::CrankNicolson
            | Self::Midpoint
            | Self::TrBdf2
            | Self::GeneralisedAlpha { .. }
            | Self::EnergyMomentum => 2,
            Self::TvdRk3 | Self::Sdirk3 => 3,
            Self::Rk4 => 4,
        }
    }

    /// Checks the parameters.
    pub(super) fn check(&self) -> Result<(), StepperError> {
        match *self {
            Self::Theta(theta) if !(theta > 0.0 && theta <= 1.0) => {
                Err(StepperError::Parameter { name: "θ", value: theta, expected: "0 < θ ≤ 1" })
            }
            Self::GeneralisedAlpha { spectral_radius } if !(0.0..=1.0).contains(&spectral_radius) => {
                Err(StepperError::Parameter {
                    name: "spectral radius at infinity",
                    value: spectral_radius,
                    expected: "0 to 1",
                })
            }
            Self::Rkc(options) => options.check(),
            _ => Ok(()),
        }
    }
}

impl fmt::Display for Scheme {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())?;
        match self {
            Self::Theta(theta) => write!(f, " (θ = {theta})"),
            Self::GeneralisedAlpha { spectral_radius } => write!(f, " (ρ∞ = {spectral_radius})"),
            _ => Ok(()),
        }
    }
}
