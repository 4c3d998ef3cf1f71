//! Powell's dogleg: within a radius `Δ` in which the linear model is trusted, the path from the iterate
//! to the Cauchy point and on to the Newton point replaces the search along one direction.
//!
//! Model `m(s) = ½ ‖R + J s‖²`, gradient `g = Jᵀ R`, Cauchy point `−(‖g‖² / ‖J g‖²) g`. J. Nocedal and
//! S. J. Wright, *Numerical Optimization* (2006), algorithms 4.1 and 11.5.
//!
//! Every trial step is `a d + b g` with the Newton direction `d`. Since `J d = −R` and
//! `R · J g = ‖g‖²`, the model needs no vector: `‖R + J s‖² = (1−a)² ‖R‖² + 2 (1−a) b ‖g‖² + b² ‖J g‖²`.

use super::NonlinearProblem;
use super::line_search::Blocked;
use super::ray::Trial;
use super::report::NewtonTotals;
use super::sample::{Sample, evaluate};
use crate::linear::{Symmetry, Tangent};
use crate::vector::{dot, norm};

/// A step is accepted if it brings this part of the predicted decrease.
const ACCEPT: f64 = 1e-4;
const POOR: f64 = 0.25;
const GOOD: f64 = 0.75;
/// Radius relative to the Newton step at which there is nothing left to try.
const SHORTEST: f64 = 1e-12;

/// The radius and the vectors of the dogleg.
#[derive(Debug, Clone, Default)]
pub(super) struct TrustRegion {
    radius: Option<f64>,
    gradient: Vec<f64>,
    image: Vec<f64>,
    entries: Vec<f64>,
}

/// Scalar products that describe the dogleg.
#[derive(Debug, Clone, Copy)]
struct Dogleg {
    newton: f64,
    gradient_squared: f64,
    image_squared: f64,
    gradient_along_newton: f64,
}

impl Dogleg {
    /// `(a, b)` of the point of the dogleg at distance `radius`, which is less than the Newton step.
    fn at(&self, radius: f64) -> (f64, f64) {
        if self.gradient_squared == 0.0 || self.image_squared == 0.0 {
            return (radius / self.newton, 0.0);
        }
        let cauchy = self.gradient_squared / self.image_squared;
        let length = cauchy * self.gradient_squared.sqrt();
        if length >= radius {
            return (0.0, -radius / self.gradient_squared.sqrt());
        }
        // ‖c + τ (d − c)‖ = Δ with c = −cauchy g.
        let along = -cauchy * self.gradient_along_newton;
        let a = self.newton * self.newton - 2.0 * along + length * length;
        let b = along - length * length;
        let c = length * length - radius * radius;
        let root = (b * b - a * c).max(0.0).sqrt();
        // The form without cancellation.
        let tau = if b > 0.0 { -c / (b + root) } else { (root - b) / a };
        let tau = tau.clamp(0.0, 1.0);
        (tau, -cauchy * (1.0 - tau))
    }
}

/// The state of an iterate and the buffers of a trial.
pub(super) struct TrustRegionStep<'a> {
    pub y: &'a [f64],
    pub here: Sample,
    pub residual: &'a [f64],
    pub direction: &'a [f64],
    pub trial: &'a mut [f64],
    pub trial_residual: &'a mut [f64],
    pub limit: usize,
}

impl TrustRegion {
    /// Forgets the radius: another problem has another scale.
    pub(super) fn begin_solve(&mut self, initial_radius: Option<f64>) {
        self.radius = initial_radius;
    }

    /// Finds an acceptable step and returns it with the number of trials. The trial's `alpha` is its
    /// length relative to the Newton step.
    pub(super) fn step(
        &mut self,
        problem: &mut dyn NonlinearProblem,
        step: TrustRegionStep<'_>,
        work: &mut NewtonTotals,
    ) -> Result<(Trial, usize), Blocked> {
        let newton = norm(step.direction);
        let mut radius = self.radius.unwrap_or(newton);
        let value = 0.5 * step.here.norm * step.here.norm;
        let mut dogleg = None;
        let mut outside = None;
        let mut trials = 0;
        while trials < step.limit && radius > SHORTEST * newton {
            trials += 1;
            let (a, b) = if newton <= radius {
                (1.0, 0.0)
            } else {
                let dogleg = match dogleg {
                    Some(dogleg) => dogleg,
                    None => *dogleg.insert(self.dogleg(problem.tangent(), &step, newton)?),
                };
                dogleg.at(radius)
            };
            let length = if b == 0.0 { a * newton } else { radius };
            for (i, (trial, y)) in step.trial.iter_mut().zip(step.y).enumerate() {
                let along_gradient = if b == 0.0 { 0.0 } else { b * self.gradient[i] };
                *trial = y + (a * step.direction[i] + along_gradient);
            }
            let sample = match evaluate(problem, step.trial, step.trial_residual, work) {
                Ok(sample) => sample,
                Err(error) => {
                    outside = Some(error);
                    radius = 0.5 * length;
                    continue;
                }
            };
            let (gradient, image) = dogleg.map_or((0.0, 0.0), |d: Dogleg| (d.gradient_squared, d.image_squared));
            let rest = 1.0 - a;
            let model = rest * rest * value + rest * b * gradient + 0.5 * b * b * image;
            let trial_value = 0.5 * sample.norm * sample.norm;
            let ratio = (value - trial_value) / (value - model);
            if ratio.is_nan() || ratio < POOR {
                radius = POOR * length;
            } else if ratio > GOOD && length >= 0.99 * radius {
                radius *= 2.0;
            }
            if ratio > ACCEPT {
                self.radius = Some(radius);
                return Ok((Trial { alpha: length / newton, value: trial_value, sample }, trials));
            }
            outside = None;
        }
        match outside {
            Some(error) => Err(Blocked::Domain(error)),
            None => Err(Blocked::NoDecrease { trials, smallest: radius / newton }),
        }
    }

    fn dogleg(&mut self, tangent: &dyn Tangent, step: &TrustRegionStep<'_>, newton: f64) -> Result<Dogleg, Blocked> {
        self.gradient.resize(step.y.len(), 0.0);
        self.image.resize(step.y.len(), 0.0);
        self.transposed(tangent, step.residual)?;
        tangent.apply(&self.gradient, &mut self.image);
        Ok(Dogleg {
            newton,
            gradient_squared: dot(&self.gradient, &self.gradient),
            image_squared: dot(&self.image, &self.image),
            gradient_along_newton: dot(&self.gradient, step.direction),
        })
    }

    /// `g = Jᵀ v`.
    fn transposed(&mut self, tangent: &dyn Tangent, v: &[f64]) -> Result<(), Blocked> {
        if tangent.symmetry() != Symmetry::General {
            tangent.apply(v, &mut self.gradient);
            return Ok(());
        }
        let Some(pattern) = tangent.pattern() else { return Err(Blocked::NeedsTransposed) };
        self.entries.resize(pattern.entries(), 0.0);
        tangent.fill(&mut self.entries);
        self.gradient.fill(0.0);
        for (row, v) in v.iter().enumerate() {
            let entries = &self.entries[pattern.offsets()[row]..];
            for (column, entry) in pattern.row(row).iter().zip(entries) {
                self.gradient[*column] += entry * v;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_dogleg_has_the_length_of_the_radius_and_ends_at_the_newton_point() {
        // J = diag(1, 4), R = (1, 1): d = (−1, −1/4), g = (1, 4).
        let (d, g, image): ([f64; 2], [f64; 2], [f64; 2]) = ([-1.0, -0.25], [1.0, 4.0], [1.0, 16.0]);
        let dogleg = Dogleg {
            newton: norm(&d),
            gradient_squared: dot(&g, &g),
            image_squared: dot(&image, &image),
            gradient_along_newton: dot(&g, &d),
        };
        for radius in [1e-3, 0.1, 0.3, 0.5, 0.9, 1.03] {
            let (a, b) = dogleg.at(radius);
            let step = [a * d[0] + b * g[0], a * d[1] + b * g[1]];
            assert!((norm(&step) - radius).abs() < 1e-12 * radius, "{radius}: {step:?}");
        }
        let (a, b) = dogleg.at(norm(&d));
        assert!((a - 1.0).abs() < 1e-12 && b.abs() < 1e-12);
    }
}
