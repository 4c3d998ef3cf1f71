//! Rings and discs, filled with concentric rings of particles; in 3D tubes and cylinders along z.
//!
//! The rings are `dr` apart and their particles as near to `dr` as divides the circumference. The outer and
//! the inner one lie on the boundary, which is the polygon through their particles: volumes add up to the
//! area between the polygons, and every particle carries half of its two edges.

use std::f64::consts::{PI, TAU};

use super::volumes::adapt_volumes;
use crate::setup::{Face, Particles, Side};
use crate::tensor::Vector;

/// Fewest particles of a ring around a centre.
const FEWEST: usize = 6;

/// Concentric rings between two radii.
#[derive(Debug, Clone, PartialEq)]
pub struct RingLattice {
    centre: [f64; 2],
    inner: f64,
    outer: f64,
    /// Ends along z, m, and number of cells; only in 3D.
    height: Option<([f64; 2], usize)>,
    /// Gaps between rings.
    gaps: usize,
}

/// Why a ring cannot be filled.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RingError {
    /// Radii or heights that do not ascend from zero.
    #[error("a ring from {inner} to {outer} is impossible")]
    NoExtent {
        /// Inner radius or lower end, m.
        inner: f64,
        /// Outer radius or upper end, m.
        outer: f64,
    },
    /// A spacing that is not positive, or larger than the ring is wide or high.
    #[error("a spacing of {0} m does not fit the ring")]
    Spacing(f64),
}

/// A place in the plane with its shares.
struct Planar {
    position: [f64; 2],
    volume: f64,
    kernel_volume: f64,
    /// Half edges: normal, length, and whether it is the outer boundary.
    edges: Vec<([f64; 2], f64, bool)>,
}

impl RingLattice {
    /// Rings with a distance as near to the wanted one as divides the width; `inner = 0` is a disc.
    /// `height` makes it a tube, in 3D.
    ///
    /// # Errors
    /// [`RingError`] if radii, heights or the spacing are impossible.
    pub fn new(
        centre: [f64; 2],
        [inner, outer]: [f64; 2],
        height: Option<[f64; 2]>,
        spacing: f64,
    ) -> Result<Self, RingError> {
        if !(inner >= 0.0 && outer > inner && outer.is_finite()) {
            return Err(RingError::NoExtent { inner, outer });
        }
        if let Some([lower, upper]) = height.filter(|[lower, upper]| !(upper > lower && (upper - lower).is_finite())) {
            return Err(RingError::NoExtent { inner: lower, outer: upper });
        }
        let divided = |extent: f64| {
            let cells = (extent / spacing).round();
            // The cast saturates; the count says what is too many.
            if spacing > 0.0 && cells >= 1.0 { Ok(cells as usize) } else { Err(RingError::Spacing(spacing)) }
        };
        let height = match height {
            Some([lower, upper]) => Some(([lower, upper], divided(upper - lower)?)),
            None => None,
        };
        Ok(Self { centre, inner, outer, height, gaps: divided(outer - inner)? })
    }

    fn gap(&self) -> f64 {
        (self.outer - self.inner) / self.gaps as f64
    }

    fn layer(&self) -> Option<f64> {
        self.height.map(|([lower, upper], cells)| (upper - lower) / cells as f64)
    }

    fn radius(&self, ring: usize) -> f64 {
        if ring == self.gaps { self.outer } else { self.inner + self.gap() * ring as f64 }
    }

    /// Particles of a ring.
    fn members(&self, ring: usize) -> usize {
        let radius = self.radius(ring);
        if radius == 0.0 { 1 } else { ((TAU * radius / self.gap()).round() as usize).max(FEWEST) }
    }

    /// Number of particles as a plain number.
    pub fn approximate_count(&self) -> f64 {
        let plane = PI * (self.outer.powi(2) - self.inner.powi(2)) / self.gap().powi(2);
        let rims = PI * (self.outer + self.inner) / self.gap();
        (plane + rims) * self.height.map_or(1.0, |(_, cells)| cells as f64 + 1.0)
    }

    /// Distance of neighbouring particles, m.
    pub fn mean_spacing(&self) -> f64 {
        self.layer().map_or(self.gap(), |layer| (self.gap().powi(2) * layer).cbrt())
    }

    /// Longest distance of neighbouring particles, m.
    pub fn longest_edge(&self) -> f64 {
        let arc = (0..=self.gaps).map(|ring| TAU * self.radius(ring) / self.members(ring) as f64);
        arc.fold(self.gap().max(self.layer().unwrap_or(0.0)), f64::max)
    }

    /// Positions, volumes and faces, ring after ring from the inside, layer after layer. Particles off the
    /// boundary are moved by up to `amount` spacings in every direction and the volumes adapted to it
    /// ([`adapt_volumes`]); `noise` gives numbers between −1 and 1. The sides are those of radius (`x`) and
    /// height (`z`).
    pub fn particles<const D: usize>(&self, amount: f64, mut noise: impl FnMut() -> f64) -> Particles<D> {
        let plane: Vec<Planar> = (0..=self.gaps).flat_map(|ring| self.ring(ring)).collect();
        let (layers, low, layer) = match self.height {
            Some(([lower, _], cells)) => (cells, lower, self.layer().unwrap_or(1.0)),
            None => (0, 0.0, 1.0),
        };
        let mut particles = Particles::default();
        for k in 0..=layers {
            let end = D == 3 && (k == 0 || k == layers);
            let share = if end { 0.5 * layer } else { layer };
            for Planar { position, volume, kernel_volume, edges } in &plane {
                let particle = particles.positions.len();
                let mut point = Vector::from_fn(|axis, _| match axis {
                    0 | 1 => position[axis],
                    _ => low + layer * k as f64,
                });
                let outside = |normal: Vector<D>, area: f64, axis: usize, upper: bool| Face {
                    particle,
                    normal,
                    area,
                    point,
                    side: Some(Side { axis, upper }),
                };
                for (normal, length, upper) in edges {
                    let normal = Vector::from_fn(|axis, _| normal.get(axis).copied().unwrap_or(0.0));
                    particles.faces.push(outside(normal, length * share, 0, *upper));
                }
                if end {
                    let upper = k != 0;
                    let sign = if upper { 1.0 } else { -1.0 };
                    let normal = Vector::from_fn(|axis, _| if axis == 2 { sign } else { 0.0 });
                    particles.faces.push(outside(normal, *volume, 2, upper));
                } else if edges.is_empty() && amount > 0.0 {
                    point += Vector::from_fn(|_, _| amount * self.mean_spacing() * noise());
                }
                particles.positions.push(point);
                particles.volumes.push(volume * share);
                particles.kernel_volumes.push(kernel_volume * layer);
            }
        }
        if amount > 0.0 {
            let volume = particles.volumes.iter().sum();
            let middle = Vector::from_fn(|axis, _| match axis {
                0 | 1 => self.centre[axis],
                _ => low + layer * layers as f64 / 2.0,
            });
            adapt_volumes(&mut particles, volume, &(middle * volume));
        }
        particles
    }

    /// One ring in the plane.
    fn ring(&self, ring: usize) -> Vec<Planar> {
        let (radius, members, gap) = (self.radius(ring), self.members(ring), self.gap());
        let polygon = |radius: f64| 0.5 * members as f64 * radius * radius * (TAU / members as f64).sin();
        let circle = |radius: f64| PI * radius * radius;
        let is_inner = ring == 0 && self.inner > 0.0;
        let is_outer = ring == self.gaps;
        let beyond = if is_outer { polygon(radius) } else { circle(radius + 0.5 * gap) };
        let within = match ring {
            0 if is_inner => polygon(radius),
            0 => 0.0,
            _ => circle(radius - 0.5 * gap),
        };
        let volume = (beyond - within) / members as f64;
        let kernel_volume = if radius == 0.0 { volume } else { TAU * radius * gap / members as f64 };
        let step = TAU / members as f64;
        // Every second ring begins half a step later, so that particles do not line up.
        let start = 0.5 * step * (ring % 2) as f64;
        let half = radius * (0.5 * step).sin();
        let place = |member: usize| {
            let angle = start + step * member as f64;
            let at = |angle: f64| [angle.cos(), angle.sin()];
            let [x, y] = at(angle);
            let mut edges = Vec::new();
            if is_inner || is_outer {
                let sign = if is_outer { 1.0 } else { -1.0 };
                for middle in [angle - 0.5 * step, angle + 0.5 * step] {
                    edges.push((at(middle).map(|n| sign * n), half, is_outer));
                }
            }
            let position = [self.centre[0] + radius * x, self.centre[1] + radius * y];
            Planar { position, volume, kernel_volume, edges }
        };
        (0..members).map(place).collect()
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;
    use crate::tensor::Tensor;

    fn consistent<const D: usize>(ring: &RingLattice, amount: f64, expected: f64) {
        let mut state = 0.4;
        let noise = || {
            state = (state * 13.0 + 0.17) % 1.0;
            2.0 * state - 1.0
        };
        let particles = ring.particles::<D>(amount, noise);
        let volume: f64 = particles.volumes.iter().sum();
        assert_relative_eq!(volume, expected, max_relative = 1e-12);
        assert!(particles.volumes.iter().chain(&particles.kernel_volumes).all(|v| *v > 0.0));
        let count = particles.positions.len() as f64;
        assert!((ring.approximate_count() / count - 1.0).abs() < 0.15, "{} {count}", ring.approximate_count());
        let (mut sum, mut enclosed) = (Vector::<D>::zeros(), Tensor::<D>::zeros());
        for face in &particles.faces {
            assert_eq!(face.point, particles.positions[face.particle]);
            sum += face.normal * face.area;
            enclosed += face.normal * face.point.transpose() * face.area;
        }
        assert!(sum.norm() < 1e-12 && (enclosed - Tensor::identity() * volume).norm() < 1e-12);
        let moment =
            particles.positions.iter().zip(&particles.volumes).fold(Vector::zeros(), |sum, (x, v)| sum + x * *v);
        let centre = Vector::<D>::from_fn(|axis, _| [1.0, 2.0, 0.25][axis]);
        assert!((moment / volume - centre).norm() < 1e-13, "{moment}");
    }

    /// Area of a regular polygon.
    fn polygon(count: usize, radius: f64) -> f64 {
        0.5 * count as f64 * radius * radius * (TAU / count as f64).sin()
    }

    #[test]
    fn volumes_moments_and_faces_agree() {
        let ring = RingLattice::new([1.0, 2.0], [0.5, 1.0], None, 0.1).unwrap();
        let expected = polygon(63, 1.0) - polygon(31, 0.5);
        consistent::<2>(&ring, 0.0, expected);
        consistent::<2>(&ring, 0.2, expected);
        let disc = RingLattice::new([1.0, 2.0], [0.0, 1.0], None, 0.1).unwrap();
        consistent::<2>(&disc, 0.0, polygon(63, 1.0));
        let tube = RingLattice::new([1.0, 2.0], [0.5, 1.0], Some([0.0, 0.5]), 0.1).unwrap();
        consistent::<3>(&tube, 0.0, 0.5 * expected);
        consistent::<3>(&tube, 0.2, 0.5 * expected);
    }

    #[test]
    fn impossible_rings_are_refused() {
        let ring = |radii, height, spacing| RingLattice::new([0.0; 2], radii, height, spacing);
        assert!(matches!(ring([1.0, 0.5], None, 0.1), Err(RingError::NoExtent { .. })));
        assert!(matches!(ring([-1.0, 0.5], None, 0.1), Err(RingError::NoExtent { .. })));
        assert!(matches!(ring([0.5, 1.0], Some([1.0, 1.0]), 0.1), Err(RingError::NoExtent { .. })));
        for spacing in [0.0, -1.0, f64::NAN, 2.0] {
            assert!(matches!(ring([0.5, 1.0], None, spacing), Err(RingError::Spacing(_))), "{spacing}");
        }
    }
}
