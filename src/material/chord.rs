//! Slopes of chords, `(f(J₁) − f(J₀))/(J₁ − J₀)`, and their derivatives with respect to `J₁`, with all
//! digits down to `J₁ = J₀`, where a plain quotient would lose them.

/// The chord of `(J^k − 1)/k`, or of `ln J` for `k = 0`.
///
/// With `r = ln(J₁/J₀)`: `J₀^{k−1} φ(r)`, `φ = expm1(kr)/(k expm1(r))`.
pub fn power(k: f64, j0: f64, j1: f64) -> (f64, f64) {
    let r = (j1 / j0).ln();
    let growth = r.exp_m1();
    let scaled = if k == 0.0 { r } else { (k * r).exp_m1() / k };
    let phi = if growth == 0.0 { 1.0 } else { scaled / growth };
    let by_r = if r.abs() < 1e-3 {
        // Series of φ′: the quotient below cancels like 1/r².
        0.5 * (k - 1.0)
            + 2.0 * r * (k * k / 6.0 - k / 4.0 + 1.0 / 12.0)
            + 3.0 * r * r * (k * k * k / 24.0 - k * k / 12.0 + k / 24.0)
    } else {
        ((k * r).exp() * growth - scaled * r.exp()) / (growth * growth)
    };
    let factor = j0.powf(k - 1.0);
    (factor * phi, factor * by_r / j1)
}

/// The chord of `½ ln² J`.
pub fn half_squared_logarithm(j0: f64, j1: f64) -> (f64, f64) {
    let (slope, by_end) = power(0.0, j0, j1);
    let mean = 0.5 * (j0.ln() + j1.ln());
    (mean * slope, 0.5 * slope / j1 + mean * by_end)
}
