//! Volumes that suit the stencil: balancing then changes weights beside the boundary only.
//!
//! Let `q_k` be the gradient weights inside a lattice at `k` spacings along a direction, summed over the other
//! directions, with `Σ_{k>0} k q_k = 1/2`. Weights exact for linear fields and for linear stress on both sides of a
//! cut parallel to a wall need, on the side of the wall and in spacings,
//!
//! ```text
//! 2 Σ V X = c² − Σ_{k>0} q_k k(2k²+1)/6        c: distance of the cut, X: distance of the particles
//! ```
//!
//! The trapezoid rule of the vertex layout has `c² − 1/4`, right for `q_1 = 1/2` alone; the mid-point rule of the cell
//! layout has `c²`, right for no stencil. Otherwise weights must change everywhere, the more the more particles there
//! are. Moving a share ν from the second row to the wall,
//!
//! ```text
//! M = Σ_{k>0} q_k k³/3 − 1/6        ν = M/2 (vertex)        ν = 1/8 + M/2 (cell)
//! ```
//!
//! mends it: `½+ν, 1−ν, 1, …` and `1+ν, 1−ν, 1, …`. These are the volumes of summation by parts (Kreiss and
//! Scherer 1974: `17/48, 59/48, …` for wider stencils). The sum stays; the second moment across `n` cells grows by
//! `24 ν/n²`, which a thin beam feels as stiffness.

use super::lattice::{BoxLattice, Layout};
use crate::kernel;
use crate::setup::{KernelChoice, Particles};
use crate::tensor::Vector;

/// Fewest particles along a direction: two rows at each wall.
const FEWEST: usize = 4;
/// Largest share that may be moved: the second row keeps a tenth.
const LARGEST: f64 = 0.9;

/// Gives the particles of a lattice volumes that suit the stencil of a kernel. Directions with fewer than
/// four particles keep theirs.
///
/// # Errors
/// The share ν if the kernel is so wide that the second row would have next to nothing left.
pub fn stencil_volumes<const D: usize>(
    lattice: &BoxLattice<D>,
    kernel: KernelChoice,
    smoothing_length: f64,
    particles: &mut Particles<D>,
) -> Result<(), f64> {
    let (counts, layout) = (lattice.counts(), lattice.layout());
    let mut shares = [0.0; D];
    for axis in (0..D).filter(|axis| counts[*axis] >= FEWEST) {
        let excess = excess(lattice, kernel, smoothing_length, axis);
        shares[axis] = if layout[axis] == Layout::Cell { 0.125 } else { 0.0 } + excess / 2.0;
        if shares[axis].is_nan() || shares[axis] > LARGEST {
            return Err(shares[axis]);
        }
    }
    if shares.iter().any(|share| *share != 0.0) {
        particles.cells.clear();
    }
    for (a, volume) in particles.volumes.iter_mut().enumerate() {
        let mut rest = a;
        let factor: f64 = (0..D)
            .map(|axis| {
                let index = rest % counts[axis];
                rest /= counts[axis];
                let whole = if layout[axis] == Layout::Vertex { 0.5 } else { 1.0 };
                match index.min(counts[axis] - 1 - index) {
                    // Relative to the volume that the wall row has already.
                    0 => 1.0 + shares[axis] / whole,
                    1 => 1.0 - shares[axis],
                    _ => 1.0,
                }
            })
            .product();
        *volume *= factor;
    }
    Ok(())
}

/// `M`: by what the third moment of the stencil exceeds that of next neighbours.
fn excess<const D: usize>(lattice: &BoxLattice<D>, kernel: KernelChoice, h: f64, axis: usize) -> f64 {
    let spacings = lattice.spacings();
    let support = kernel::support(kernel) * h;
    let reach: [usize; D] = spacings.map(|spacing| (support / spacing) as usize);
    let widths: [usize; D] = reach.map(|reach| 2 * reach + 1);
    let (mut first, mut third) = (0.0, 0.0);
    for code in 0..widths.iter().product() {
        let mut rest: usize = code;
        let offset: [f64; D] = std::array::from_fn(|i| {
            let index = rest % widths[i];
            rest /= widths[i];
            index as f64 - reach[i] as f64
        });
        let k = offset[axis];
        let r = Vector::<D>::from_fn(|i, _| offset[i] * spacings[i]).norm();
        // As the neighbour search has it: the edge of the support does not count.
        if k > 0.0 && r < support * (1.0 - 1e-9) {
            let weight = -kernel::slope_over_distance(kernel, D, r, h) * k;
            first += weight * k;
            third += weight * k.powi(3);
        }
    }
    0.5 * third / first / 3.0 - 1.0 / 6.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn next_neighbours_ask_for_the_trapezoid_rule_and_nine_eighths_in_cells() {
        let volumes = |layout, h| {
            let lattice = BoxLattice::with_counts([0.0], [1.0], [8], layout).unwrap();
            let mut particles = lattice.particles();
            stencil_volumes(&lattice, KernelChoice::CubicSpline, h * lattice.mean_spacing(), &mut particles).unwrap();
            let size = lattice.mean_spacing();
            particles.volumes.iter().map(|volume| volume / size).collect::<Vec<_>>()
        };
        for (found, expected) in volumes(Layout::Vertex, 1.0).iter().zip([0.5, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.5]) {
            assert!((found - expected).abs() < 1e-14);
        }
        for (found, expected) in volumes(Layout::Cell, 1.0).iter().zip([1.125, 0.875, 1.0, 1.0, 1.0, 1.0]) {
            assert!((found - expected).abs() < 1e-14);
        }
        let wide = volumes(Layout::Vertex, 1.5);
        // W′ at 2/3 and 4/3 of h, cubic spline: q₂/q₁ = (1/3)/2 over (1 − 1/2) · … = 1/6; q₁ + 2 q₂ = 1/2.
        assert!((wide[0] - 0.6).abs() < 1e-12 && (wide[1] - 0.9).abs() < 1e-12, "{wide:?}");
        assert!((wide.iter().sum::<f64>() - 7.0).abs() < 1e-13);
    }

    #[test]
    fn kernels_too_wide_are_refused() {
        let lattice = BoxLattice::with_counts([0.0], [1.0], [40], Layout::Cell).unwrap();
        let mut particles = lattice.particles();
        let result = stencil_volumes(&lattice, KernelChoice::QuinticSpline, 4.0 / 40.0, &mut particles);
        assert!(result.is_err_and(|share| share > 0.9));
        assert_eq!(particles, lattice.particles());
    }
}
