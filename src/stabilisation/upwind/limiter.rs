//! The limiter of reconstructed interface jumps.
//!
//! Reconstruction replaces the jump `Δ = φ_b − φ_a` of a pair by `Δ_r = Δ − ½(𝒢_a + 𝒢_b) X_ab`: zero for linear fields,
//! the whole of Δ for a sawtooth. With `r = Δ_r/Δ` the limited jump is
//!
//! ```text
//! Δ_l = ψ(r) Δ,     ψ = 2 r²/(1 + r⁴) for r > 0, else 0
//! ```
//!
//! - `0 ≤ ψ ≤ 1`, so Δ_l has the sign of Δ: whatever the states, no pair feeds energy, and none dissipates more
//!   than with constant states. `ψ(1) = 1`: what the gradients do not see is damped in full.
//! - `ψ ~ 2 r²` for small r: a smooth field, whose r is O(Δx²), is damped far less than by the reconstruction alone.
//! - For the same reason a sawtooth that is small against a pair's smooth jump is damped little, until it has grown to the
//!   size of that jump: linear stability is not to be had from this term, bounded noise is.
//! - Δ_l is homogeneous of degree one in (Δ, Δ_r) and continuously differentiable but at the origin, because ψ and ψ′
//!   vanish at r = 0, and ψ as r⁻² at infinity. Newton's method needs that; the limiters of the min–max kind have
//!   kinks where most pairs are.

/// Ratios beyond this count as infinite.
const LARGEST_RATIO: f64 = 1e8;

/// `ψ(r)` and `ψ′(r)` of `r = along/size`; size ≥ 0, and (0, 0) where it is zero.
pub(super) fn limiter(along: f64, size: f64) -> (f64, f64) {
    if along <= 0.0 || along >= LARGEST_RATIO * size {
        return (0.0, 0.0);
    }
    let r = along / size;
    let (square, fourth) = (r * r, r * r * r * r);
    (2.0 * square / (1.0 + fourth), 4.0 * r * (1.0 - fourth) / ((1.0 + fourth) * (1.0 + fourth)))
}

/// The limited jump of a scalar, and its derivatives with respect to Δ and Δ_r.
pub(super) fn limited(jump: f64, reconstructed: f64) -> (f64, [f64; 2]) {
    let (factor, slope) = limiter(reconstructed * jump, jump * jump);
    let ratio = if factor == 0.0 { 0.0 } else { reconstructed / jump };
    (factor * jump, [factor - ratio * slope, slope])
}

#[cfg(test)]
mod tests {
    use super::{limited, limiter};

    #[test]
    fn the_factor_is_between_zero_and_one() {
        for i in -400..=400 {
            let r = f64::from(i) * 0.05;
            let (factor, slope) = limiter(r, 1.0);
            assert!((0.0..=1.0).contains(&factor), "{r}: {factor}");
            let step = 1e-6;
            let difference = (limiter(r + step, 1.0).0 - limiter(r - step, 1.0).0) / (2.0 * step);
            assert!((slope - difference).abs() < 1e-5, "{r}: {slope} against {difference}");
        }
        assert_eq!(limiter(1.0, 1.0), (1.0, 0.0));
    }

    #[test]
    fn the_limited_jump_is_differentiable_away_from_the_origin() {
        let step = 1e-6;
        for i in 0..360 {
            let angle = f64::from(i).to_radians();
            let (jump, reconstructed) = (angle.cos(), angle.sin());
            let (value, slopes) = limited(jump, reconstructed);
            assert!(value * jump >= 0.0 && value.abs() <= jump.abs());
            let numbers = [
                limited(jump + step, reconstructed).0 - limited(jump - step, reconstructed).0,
                limited(jump, reconstructed + step).0 - limited(jump, reconstructed - step).0,
            ];
            for (slope, number) in slopes.iter().zip(numbers) {
                assert!((slope - number / (2.0 * step)).abs() < 1e-5, "{i}°: {slopes:?}");
            }
        }
    }

    #[test]
    fn extremes_are_finite() {
        for (jump, reconstructed) in
            [(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1e-300, 1.0), (1e-300, 1e-300), (-1e-9, -1.0)]
        {
            let (value, slopes) = limited(jump, reconstructed);
            assert!(value.is_finite() && slopes.iter().all(|s| s.is_finite()), "{jump}, {reconstructed}: {slopes:?}");
        }
    }
}
