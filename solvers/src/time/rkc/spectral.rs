//! Dominant eigenvalue of `∂f/∂u` by a power iteration on differences of the rate.

use super::super::attempt::{Attempt, Span, Tools, evaluate};
use super::super::{RatePart, StepCause, System, TimeState};
use crate::EvaluationError;
use crate::vector::{dot, norm};

/// Iterations at most.
const LIMIT: usize = 60;

/// Relative change of the spectral radius, twice in a row, at which the iteration ends.
const TOLERANCE: f64 = 0.01;

/// Iterations from such a direction that do not enter the mean growth.
const TRANSIENT: usize = 6;

/// Iterations at least from a direction that knows nothing. The spectra of particle systems are dense at the
/// top: the radius creeps up from below as `1 − O(1/k)`, ever more slowly, and a small change alone
/// would end the iteration 15 % too low.
const FRESH: usize = 24;

/// The eigenvalue of largest magnitude of the linearised system, as far as a stability limit cares.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DominantEigenvalue {
    /// Magnitude `|λ|`.
    pub radius: f64,
    /// Damping ratio `−Re λ / |λ|`: 1 on the negative real axis, 0 for an undamped oscillation,
    /// negative where the solution grows.
    pub damping: f64,
}

/// The spectral radius from the growth of successive powers `zₖ₊₁ = A zₖ`, as it settles.
///
/// The growth of one application alternates for ever where the dominant pair is undamped (elongation and
/// velocity have different units); the geometric mean of two in a row does not. With a damped pair even that
/// turns round, and only the mean over many settles.
#[derive(Debug, Default)]
struct Growth {
    last: f64,
    pair: f64,
    agreements: usize,
    logarithms: f64,
    count: usize,
    mean: f64,
    mean_agreements: usize,
}

impl Growth {
    /// Takes in the growth of one application.
    fn push(&mut self, growth: f64, transient: bool) {
        if self.last > 0.0 {
            let pair = (self.last * growth).sqrt();
            self.agreements = if close(pair, self.pair) { self.agreements + 1 } else { 0 };
            self.pair = pair;
        }
        self.last = growth;
        if transient {
            return;
        }
        self.logarithms += growth.ln();
        self.count += 1;
        if self.count.is_multiple_of(2) {
            let mean = (self.logarithms / self.count as f64).exp();
            self.mean_agreements = if close(mean, self.mean) { self.mean_agreements + 1 } else { 0 };
            self.mean = mean;
        }
    }

    /// The radius, if it has settled.
    fn settled(&self) -> Option<f64> {
        if self.agreements >= 2 {
            Some(self.pair)
        } else {
            (self.count >= 10 && self.mean_agreements >= 2).then_some(self.mean)
        }
    }
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= TOLERANCE * a
}

impl DominantEigenvalue {
    /// Finds it for the system linearised at `(t, u)`, in at most 60 evaluations of its rate. Converges from
    /// below; where the spectrum is dense at its end it is some per cent too low.
    ///
    /// # Errors
    /// If the rate cannot be evaluated there.
    pub fn of(system: &mut dyn System, t: f64, u: &[f64]) -> Result<Self, StepCause> {
        if u.len() != system.len() {
            return Err(StepCause::WrongLength { expected: system.len(), found: u.len() });
        }
        let (mut start, mut end) = (TimeState::new(t, u.to_vec()), TimeState::default());
        let mut attempt = Attempt {
            system,
            tools: &mut Tools::default(),
            start: &mut start,
            end: &mut end,
            span: Span { step: 0.0, end: t },
            wants_estimate: false,
        };
        attempt.prepare();
        attempt.know_start_rate()?;
        attempt.dominant_eigenvalue()
    }
}

impl Attempt<'_> {
    /// The spectral radius at the start of the step: kept for `refresh` steps, else estimated from the
    /// last eigenvector (at first from a fixed pseudo-random one).
    pub(super) fn spectral_radius(&mut self, refresh: usize) -> Result<f64, StepCause> {
        let memory = &self.start.memory;
        if memory.spectral_radius > 0.0 && memory.steps_since_estimate < refresh {
            return Ok(memory.spectral_radius);
        }
        self.know_start_rate()?;
        let found = self.dominant_eigenvalue()?;
        for memory in [&mut self.start.memory, &mut self.end.memory] {
            memory.spectral_radius = found.radius;
            memory.dominant_damping = found.damping;
        }
        self.start.memory.steps_since_estimate = 0;
        self.end.memory.steps_since_estimate = 1;
        self.end.memory.dominant_direction.clone_from(&self.start.memory.dominant_direction);
        Ok(found.radius)
    }

    fn dominant_eigenvalue(&mut self) -> Result<DominantEigenvalue, StepCause> {
        let n = self.start.values.len();
        let size = norm(&self.start.values);
        // Balances rounding (ε·size) against curvature, as in any directional difference quotient.
        let length = f64::EPSILON.sqrt() * if size > 0.0 { size } else { 1.0 };
        let direction = &mut self.start.memory.dominant_direction;
        let known = direction.len() == n;
        if !known {
            direction.clear();
            direction.extend((0..n as u64).map(pseudo_random));
        }
        let Tools { rates: [image, ..], stages: [point, older, newer], base: free, counts, .. } = &mut *self.tools;
        // Prescribed entries are no unknowns. They are those that `impose` does not leave alone.
        for (p, u) in point.iter_mut().zip(&self.start.values) {
            *p = u + (1.0 + u.abs());
        }
        free.copy_from_slice(point);
        self.system.impose(self.start.time, free);
        for (free, p) in free.iter_mut().zip(point.iter()) {
            *free = f64::from(u8::from(*free == *p));
        }
        newer.copy_from_slice(&self.start.memory.dominant_direction);
        normalise(newer, free);

        // `older` and `newer` are unit vectors with A·older = stretch·newer; `stretch` is 0 at first.
        let mut growth = Growth::default();
        let mut damping = (0.0, 1.0);
        let mut stretch = 0.0;
        let mut radius = 0.0;
        for iteration in 0..LIMIT {
            for ((p, u), d) in point.iter_mut().zip(&self.start.values).zip(newer.iter()) {
                *p = u + length * d;
            }
            evaluate(self.system, counts, RatePart::All, self.start.time, point, image)?;
            for (f, f0) in image.iter_mut().zip(&self.start.memory.rate) {
                *f = (*f - f0) / length;
            }
            for (f, free) in image.iter_mut().zip(free.iter()) {
                *f *= free;
            }
            let next = norm(image);
            if !next.is_finite() {
                return Err(EvaluationError::not_finite("derivative of the rate", 0, next).into());
            }
            if next == 0.0 {
                break;
            }
            growth.push(next, !known && iteration < TRANSIENT);
            radius = growth.settled().unwrap_or(growth.pair.max(growth.mean));
            if stretch > 0.0 && radius > 0.0 {
                // z₂ + |λ|² z₀ ≈ 2 Re λ z₁, best where z₁ is large.
                let twice = dot(newer, image) + radius * radius * dot(newer, older) / stretch;
                if stretch >= damping.0 || iteration < 2 {
                    damping = (stretch, (-0.5 * twice / radius).clamp(-1.0, 1.0));
                } else {
                    // Each second application has a small z₁; the one before it is still good.
                    damping.0 = stretch;
                }
            }
            stretch = normalise(image, free);
            std::mem::swap(older, newer);
            newer.copy_from_slice(image);
            if growth.settled().is_some() && (known || iteration >= FRESH) {
                break;
            }
        }
        self.start.memory.dominant_direction.copy_from_slice(newer);
        Ok(DominantEigenvalue { radius, damping: damping.1 })
    }
}

/// Sets the entries that are not free to zero, scales the rest to length 1 and returns its length before.
fn normalise(vector: &mut [f64], free: &[f64]) -> f64 {
    for (v, free) in vector.iter_mut().zip(free) {
        *v *= free;
    }
    let size = norm(vector);
    if size > 0.0 {
        for v in vector {
            *v /= size;
        }
    }
    size
}

/// A fixed number in `[−1, 1)` for every index (the finaliser of SplitMix64): the same run on every
/// machine, and no structure that an eigenvector could be orthogonal to.
fn pseudo_random(index: u64) -> f64 {
    let mut bits = index.wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    bits ^= bits >> 31;
    (bits >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Growth of powers of a 2 × 2 matrix with the eigenvalues `ω(−ζ ± i√(1 − ζ²))`.
    fn settle(omega: f64, zeta: f64) -> f64 {
        let mut growth = Growth::default();
        let mut z = [1.0, 0.7];
        for iteration in 0..LIMIT {
            let image = [z[1], -omega * omega * z[0] - 2.0 * zeta * omega * z[1]];
            let size = norm(&image);
            z = [image[0] / size, image[1] / size];
            growth.push(size, iteration < TRANSIENT);
        }
        growth.settled().unwrap_or(growth.mean)
    }

    #[test]
    fn growth_settles_at_the_magnitude_of_a_pair_whatever_its_damping() {
        for omega in [1.0, 50.0, 1e4] {
            for zeta in [0.0, 0.05, 0.3, 0.8] {
                let found = settle(omega, zeta);
                assert!((found / omega - 1.0).abs() < 0.1, "{found} for {omega}, damping ratio {zeta}");
            }
        }
    }
}
