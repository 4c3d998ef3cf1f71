//! Smoothing kernels `W(r, h)`.
//!
//! Every kernel is normalised, `∫ W = 1`, and compactly supported. The gradient with respect to the
//! point of evaluation is `∇W = (W′(r)/r) (X_a − X_b)`; kernels give `W′(r)/r`, which is finite at
//! `r = 0`, so that no caller divides by a distance.
//!
//! To add a kernel: one arm in each function below and one in [`KernelChoice`].

use std::f64::consts::PI;

use crate::setup::KernelChoice;

/// Support radius in smoothing lengths.
pub fn support(kernel: KernelChoice) -> f64 {
    match kernel {
        KernelChoice::CubicSpline | KernelChoice::WendlandC2 => 2.0,
        KernelChoice::QuinticSpline => 3.0,
    }
}

/// Value `W(r, h)`, 1/m^D, in `dimension` dimensions.
pub fn value(kernel: KernelChoice, dimension: usize, r: f64, h: f64) -> f64 {
    normalisation(kernel, dimension) / h.powi(dimension as i32) * shape(kernel, dimension, r / h)
}

/// Slope over distance `W′(r)/r`, 1/m^(D+2); never positive.
pub fn slope_over_distance(kernel: KernelChoice, dimension: usize, r: f64, h: f64) -> f64 {
    normalisation(kernel, dimension) / h.powi(dimension as i32 + 2) * shape_slope(kernel, dimension, r / h)
}

/// Constant that makes the kernel integrate to one (Monaghan 2005; Dehnen and Aly 2012, table 1).
fn normalisation(kernel: KernelChoice, dimension: usize) -> f64 {
    match (kernel, dimension) {
        (KernelChoice::CubicSpline, 1) => 2.0 / 3.0,
        (KernelChoice::CubicSpline, 2) => 10.0 / (7.0 * PI),
        (KernelChoice::CubicSpline, _) => 1.0 / PI,
        // In one dimension the C2 function of Wendland is (1 − q/2)³ (1 + 3q/2).
        (KernelChoice::WendlandC2, 1) => 5.0 / 8.0,
        (KernelChoice::WendlandC2, 2) => 7.0 / (4.0 * PI),
        (KernelChoice::WendlandC2, _) => 21.0 / (16.0 * PI),
        (KernelChoice::QuinticSpline, 1) => 1.0 / 120.0,
        (KernelChoice::QuinticSpline, 2) => 7.0 / (478.0 * PI),
        (KernelChoice::QuinticSpline, _) => 1.0 / (120.0 * PI),
    }
}

/// Unnormalised shape as a function of `q = r/h`.
fn shape(kernel: KernelChoice, dimension: usize, q: f64) -> f64 {
    match kernel {
        KernelChoice::CubicSpline => {
            if q < 1.0 {
                1.0 - 1.5 * q * q + 0.75 * q * q * q
            } else {
                0.25 * (2.0 - q).max(0.0).powi(3)
            }
        }
        KernelChoice::WendlandC2 => {
            let s = (1.0 - 0.5 * q).max(0.0);
            if dimension == 1 { s.powi(3) * (1.5 * q + 1.0) } else { s.powi(4) * (2.0 * q + 1.0) }
        }
        KernelChoice::QuinticSpline => {
            (3.0 - q).max(0.0).powi(5) - 6.0 * (2.0 - q).max(0.0).powi(5) + 15.0 * (1.0 - q).max(0.0).powi(5)
        }
    }
}

/// Derivative of the shape divided by `q`.
fn shape_slope(kernel: KernelChoice, dimension: usize, q: f64) -> f64 {
    match kernel {
        KernelChoice::CubicSpline => {
            if q < 1.0 {
                -3.0 + 2.25 * q
            } else {
                -0.75 * (2.0 - q).max(0.0).powi(2) / q
            }
        }
        KernelChoice::WendlandC2 => {
            let s = (1.0 - 0.5 * q).max(0.0);
            if dimension == 1 { -3.0 * s * s } else { -5.0 * s.powi(3) }
        }
        KernelChoice::QuinticSpline => {
            let slope = |q: f64| {
                -5.0 * (3.0 - q).max(0.0).powi(4) + 30.0 * (2.0 - q).max(0.0).powi(4)
                    - 75.0 * (1.0 - q).max(0.0).powi(4)
            };
            // The slope is odd in q with finite curvature −120 at the centre.
            if q < 1e-6 { -120.0 } else { slope(q) / q }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    const ALL: [KernelChoice; 3] = [KernelChoice::CubicSpline, KernelChoice::WendlandC2, KernelChoice::QuinticSpline];

    #[test]
    fn kernels_integrate_to_one() {
        for kernel in ALL {
            for dimension in 1..=3 {
                let h = 0.7;
                let n = 20_000;
                let dr = support(kernel) * h / n as f64;
                let area = |r: f64| match dimension {
                    1 => 2.0,
                    2 => 2.0 * PI * r,
                    _ => 4.0 * PI * r * r,
                };
                let sum: f64 =
                    (0..n).map(|i| (i as f64 + 0.5) * dr).map(|r| value(kernel, dimension, r, h) * area(r) * dr).sum();
                assert_relative_eq!(sum, 1.0, epsilon = 1e-7);
            }
        }
    }

    #[test]
    fn slope_is_the_derivative_of_the_value_and_never_positive() {
        for kernel in ALL {
            for dimension in 1..=3 {
                for i in 1..60 {
                    let (r, h, e) = (0.05 * f64::from(i), 1.1, 1e-6);
                    let numeric = (value(kernel, dimension, r + e, h) - value(kernel, dimension, r - e, h)) / (2.0 * e);
                    let slope = slope_over_distance(kernel, dimension, r, h);
                    assert_relative_eq!(slope * r, numeric, epsilon = 1e-8);
                    assert!(slope <= 0.0);
                }
                assert!(slope_over_distance(kernel, dimension, 0.0, 1.0).is_finite());
                assert_eq!(value(kernel, dimension, 3.01, 1.0), 0.0);
            }
        }
    }
}
