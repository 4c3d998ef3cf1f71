//! Numbering along a space-filling curve: particles that are near each other in space are near each other in memory.
//!
//! Lists of points and meshes may be numbered anyhow; the neighbours of a particle then are spread over the whole body.
//! Along a Z curve (Morton 1966) they are in a few blocks. What is numbered line by line keeps its lines: along those of
//! lattices rows repeat (`discretisation::stencils`), and for perturbed ones the curve is no faster (`benches/explicit.rs`).
//! What fits into the cache keeps the order in which it was given, too.

use crate::setup::Particles;
use crate::tensor::Vector;

/// Particles that fit into the cache, with their rows.
const SMALL: usize = 4096;
/// Distance within which particles are neighbours for certain, mean spacings.
const NEAR: f64 = 3.0;
/// Bits of a coordinate.
const BITS: u32 = 20;

/// Numbers particles along a Z curve if that is worth it; the new number of every old one, if they changed.
pub fn number_along_curve<const D: usize>(particles: &mut Particles<D>) -> Option<Vec<u32>> {
    let n = particles.positions.len();
    if n <= SMALL || D == 1 || is_coherent(particles) {
        return None;
    }
    let mut order: Vec<(u64, u32)> = keys(&particles.positions).into_iter().zip(0..).collect();
    order.sort_unstable();
    let mut numbers = vec![0; n];
    for (&(_, old), new) in order.iter().zip(0_u32..) {
        numbers[old as usize] = new;
    }
    let permuted = |values: &[f64]| -> Vec<f64> { order.iter().map(|&(_, old)| values[old as usize]).collect() };
    particles.volumes = permuted(&particles.volumes);
    particles.kernel_volumes = permuted(&particles.kernel_volumes);
    particles.positions = order.iter().map(|&(_, old)| particles.positions[old as usize]).collect();
    particles.faces.iter_mut().for_each(|face| face.particle = numbers[face.particle] as usize);
    particles.cells.iter_mut().for_each(|corner| *corner = numbers[*corner as usize]);
    Some(numbers)
}

/// Whether most particles follow one that is near, as in lines.
fn is_coherent<const D: usize>(particles: &Particles<D>) -> bool {
    let positions = &particles.positions;
    let mean = particles.volumes.iter().sum::<f64>() / positions.len() as f64;
    let near = NEAR * mean.powf(1.0 / D as f64);
    2 * positions.windows(2).filter(|x| (x[1] - x[0]).norm() < near).count() > positions.len()
}

/// Places along the curve: bits of the coordinates in turn, those of the last one first.
fn keys<const D: usize>(positions: &[Vector<D>]) -> Vec<u64> {
    let start = (Vector::repeat(f64::INFINITY), Vector::repeat(f64::NEG_INFINITY));
    let (lower, upper) = positions.iter().fold(start, |(l, u): (Vector<D>, Vector<D>), x| (l.inf(x), u.sup(x)));
    let unit = (upper - lower).amax().max(f64::MIN_POSITIVE) / f64::from((1_u32 << BITS) - 1);
    let key = |x: &Vector<D>| {
        let cell: [u64; D] = std::array::from_fn(|i| ((x[i] - lower[i]) / unit) as u64);
        (0..BITS).rev().fold(0, |key, bit| (0..D).rev().fold(key, |key, axis| key << 1 | cell[axis] >> bit & 1))
    };
    positions.iter().map(key).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::setup::Face;

    /// A square of points in lines, or as they come: in steps of `stride`, which has no factor in common with their number.
    fn square(side: usize, stride: usize) -> Particles<2> {
        let n = side * side;
        let place = |k: usize| Vector::from([(k * stride % n % side) as f64, (k * stride % n / side) as f64]);
        Particles {
            positions: (0..n).map(place).collect(),
            volumes: (0..n).map(|k| 1.0 + 1e-6 * k as f64).collect(),
            kernel_volumes: (0..n).map(|k| 2.0 * k as f64).collect(),
            faces: vec![Face { particle: 17, normal: Vector::x(), area: 1.0, point: place(17), side: None }],
            cells: vec![0, 1, side as u32, side as u32 + 1],
        }
    }

    #[test]
    fn everything_moves_with_its_particle_and_neighbours_come_near() {
        let (before, mut after) = (square(100, 4567), square(100, 4567));
        let numbers = number_along_curve(&mut after).expect("a large cloud without an order");
        for (old, &new) in numbers.iter().enumerate() {
            let new = new as usize;
            assert_eq!(after.positions[new], before.positions[old]);
            assert_eq!((after.volumes[new], after.kernel_volumes[new]), (before.volumes[old], 2.0 * old as f64));
        }
        assert_eq!(after.positions[after.faces[0].particle], after.faces[0].point);
        assert_eq!(after.cells, before.cells.iter().map(|&c| numbers[c as usize]).collect::<Vec<_>>());
        let steps = after.positions.windows(2).filter(|x| (x[1] - x[0]).norm() < 3.0).count();
        assert!(steps > 8000, "{steps}");
    }

    #[test]
    fn lines_and_small_clouds_keep_their_order() {
        assert_eq!(number_along_curve(&mut square(100, 1)), None);
        assert_eq!(number_along_curve(&mut square(64, 4567)), None);
        assert!(number_along_curve(&mut square(65, 4567)).is_some());
    }
}
