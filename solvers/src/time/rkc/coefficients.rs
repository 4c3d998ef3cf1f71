//! Coefficients and stability of Runge–Kutta–Chebyshev with ε = 2/13, `b₀ = b₂`, `b₁ = 1/q₀`.

/// Damping parameter ε of `q₀ = 1 + ε/s²`.
const DAMPING: f64 = 2.0 / 13.0;

/// `β(s) / (s² − 1)` for large `s`: `⅔ (1 − 2ε/15)`, as printed in the stage rule.
const STABILITY: f64 = 0.653;

/// The coefficients for one number of stages; index `k` is the stage, index 0 is unused in most.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RkcCoefficients {
    /// Number of stages `s` (0: none yet).
    pub stages: usize,
    /// `q₀ = 1 + ε/s²`.
    pub q0: f64,
    /// `q₁ = T′ₛ(q₀) / T″ₛ(q₀)`.
    pub q1: f64,
    /// `bₖ = T″ₖ(q₀) / T′ₖ(q₀)²`, with `b₀ = b₂` and `b₁ = 1/q₀`.
    pub b: Vec<f64>,
    /// `μₖ = 2 q₀ bₖ / bₖ₋₁`, from k = 2.
    pub mu: Vec<f64>,
    /// `νₖ = −bₖ / bₖ₋₂`, from k = 2.
    pub nu: Vec<f64>,
    /// `μ̃ₖ = 2 q₁ bₖ / bₖ₋₁`, with `μ̃₁ = b₁ q₁`.
    pub mu_rate: Vec<f64>,
    /// `γ̃ₖ = −(1 − bₖ₋₁ Tₖ₋₁(q₀)) μ̃ₖ`, from k = 2.
    pub gamma_rate: Vec<f64>,
    /// Nodes `cₖ = q₁ T″ₖ(q₀) / T′ₖ(q₀)`, with `c₀ = 0`, `c₁ = c₂` and `cₛ = 1`.
    pub c: Vec<f64>,
}

impl RkcCoefficients {
    /// The coefficients for `stages` stages (at least 2).
    pub fn new(stages: usize) -> Self {
        let mut coefficients = Self::default();
        coefficients.set(stages);
        coefficients
    }

    /// Computes them anew unless the number of stages is the present one.
    pub(super) fn set(&mut self, stages: usize) {
        let s = stages.max(2);
        if self.stages == s {
            return;
        }
        for list in [&mut self.b, &mut self.mu, &mut self.nu, &mut self.mu_rate, &mut self.gamma_rate, &mut self.c] {
            list.clear();
            list.resize(s + 1, 0.0);
        }
        let q0 = 1.0 + DAMPING / (s * s) as f64;
        let q1 = chebyshev(q0).nth(s).map_or(1.0, |t| t.first / t.second);
        (self.stages, self.q0, self.q1) = (s, q0, q1);
        for (k, t) in chebyshev(q0).enumerate().take(s + 1).skip(2) {
            self.b[k] = t.second / (t.first * t.first);
            self.c[k] = q1 * t.second / t.first;
        }
        self.b[0] = self.b[2];
        self.b[1] = 1.0 / q0;
        self.c[1] = self.c[2];
        self.c[s] = 1.0;
        self.mu_rate[1] = self.b[1] * q1;
        for (before, t) in chebyshev(q0).enumerate().take(s).skip(1) {
            let k = before + 1;
            self.mu[k] = 2.0 * q0 * self.b[k] / self.b[before];
            self.nu[k] = -self.b[k] / self.b[k - 2];
            self.mu_rate[k] = 2.0 * q1 * self.b[k] / self.b[before];
            self.gamma_rate[k] = -(1.0 - self.b[before] * t.value) * self.mu_rate[k];
        }
    }

    /// Stability polynomial `Pₛ(z) = 1 − bₛ Tₛ(q₀) + bₛ Tₛ(q₀ + q₁ z)` at `z = x + i y`, as its (real,
    /// imaginary) parts.
    pub fn stability(&self, x: f64, y: f64) -> (f64, f64) {
        let s = self.stages;
        let Some(at_q0) = chebyshev(self.q0).nth(s).filter(|_| s >= 2) else { return (1.0, 0.0) };
        let (re, im) = (self.q0 + self.q1 * x, self.q1 * y);
        let mut previous = (1.0, 0.0);
        let mut current = (re, im);
        for _ in 2..=s {
            let next = (
                2.0 * (re * current.0 - im * current.1) - previous.0,
                2.0 * (re * current.1 + im * current.0) - previous.1,
            );
            (previous, current) = (current, next);
        }
        let b = self.b[s];
        (1.0 + b * (current.0 - at_q0.value), b * current.1)
    }
}

/// A Chebyshev polynomial with its first two derivatives.
#[derive(Debug, Clone, Copy)]
struct Chebyshev {
    value: f64,
    first: f64,
    second: f64,
}

/// `T₀, T₁, …` at `x`, which may lie outside `[−1, 1]`, by their recurrences.
fn chebyshev(x: f64) -> impl Iterator<Item = Chebyshev> {
    let zero = Chebyshev { value: 1.0, first: 0.0, second: 0.0 };
    let one = Chebyshev { value: x, first: 1.0, second: 0.0 };
    let next = move |&(before, now): &(Chebyshev, Chebyshev)| {
        let after = Chebyshev {
            value: 2.0 * x * now.value - before.value,
            first: 2.0 * x * now.first - before.first + 2.0 * now.value,
            second: 2.0 * x * now.second - before.second + 4.0 * now.first,
        };
        Some((now, after))
    };
    std::iter::successors(Some((zero, one)), next).map(|(now, _)| now)
}

/// Growth `|Pₛ(i y)|` per step of an *undamped* oscillation with `y = ωΔt`.
///
/// Above 1 for every `y ≠ 0`: `|Pₛ(i y)|² = 1 + Kₛ y⁴ + …` with `K₂ = 0.25`, `K₃ = 0.124`, …, `K∞ ≈ 0.07`. A caller
/// whose system is undamped should warn when `growth^steps` is not close to 1.
pub fn rkc_growth(stages: usize, y: f64) -> f64 {
    let (re, im) = RkcCoefficients::new(stages).stability(0.0, y);
    re.hypot(im)
}

/// Length `β(s)` of the real stability interval: the largest `β` with `|Pₛ(x)| ≤ 1` for all `−β ≤ x ≤ 0`.
///
/// `Pₛ` oscillates between `1 − bₛ(Tₛ(q₀) ± 1)` as long as `q₀ + q₁ x ≥ −1`; beyond that it grows
/// monotonically in magnitude, so the crossing is found by bisection.
pub fn rkc_stability_limit(stages: usize) -> f64 {
    let coefficients = RkcCoefficients::new(stages);
    let mut inside = (1.0 + coefficients.q0) / coefficients.q1;
    let mut outside = 2.0 * inside;
    while outside - inside > 1e-15 * outside {
        let middle = 0.5 * (inside + outside);
        if middle <= inside || middle >= outside {
            break;
        }
        if coefficients.stability(-middle, 0.0).0.abs() <= 1.0 { inside = middle } else { outside = middle }
    }
    inside
}

/// Stages for `Δtσ` = step × spectral radius: `s = 1 + ⌊√(1 + Δtσ / 0.653)⌋`, at least 2.
pub fn rkc_stages(step_times_radius: f64) -> usize {
    stages_from(step_times_radius / STABILITY)
}

/// Stages by the Courant number `c Δt / Δp`: `s = 1 + ⌊√(1 + c Δt / (0.131 Δp))⌋`, at least 2.
pub fn rkc_stages_by_courant(courant: f64) -> usize {
    stages_from(courant / 0.131)
}

fn stages_from(ratio: f64) -> usize {
    // A float-to-integer cast saturates, and NaN becomes 0: no input can do harm here.
    ((1.0 + ratio).max(1.0).sqrt() as usize).saturating_add(1).max(2)
}
