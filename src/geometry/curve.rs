//! Numbering along a space-filling curve: particles that are near each other in space are near each other in memory.
//!
//! Clouds, perturbed lattices and meshes are numbered line by line, or anyhow; the neighbours of a particle then are spread
//! over whole layers of the body, and each of them is a line of the cache that nobody else wants. Along a Z curve (Morton
//! 1966) they are in a few blocks. Lattices keep their lines, along which rows repeat (`discretisation::stencils`), and
//! what fits into the cache keeps the order in which it was given.

use crate::setup::Particles;
use crate::tensor::Vector;

/// Particles that fit into the cache, with their rows.
const SMALL: usize = 4096;
/// Bits of a coordinate.
const BITS: u32 = 20;

/// Numbers particles along a Z curve if that is worth it; the new number of every old one, if they changed.
pub fn number_along_curve<const D: usize>(particles: &mut Particles<D>) -> Option<Vec<u32>> {
    let n = particles.positions.len();
    if n <= SMALL || D == 1 || is_lined_up(&particles.positions) {
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

/// Whether most particles follow each other in straight lines of equal steps.
fn is_lined_up<const D: usize>(positions: &[Vector<D>]) -> bool {
    let straight = |x: &&[Vector<D>]| (x[2] - x[1] * 2.0 + x[0]).norm() < 1e-6 * (x[1] - x[0]).norm();
    2 * positions.windows(3).filter(straight).count() > positions.len()
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

    /// A square of points in lines, shaken if asked for.
    fn square(side: usize, shaken: bool) -> Particles<2> {
        let noise = |k: usize| if shaken { 0.2 * (k as f64 * 12.9898).sin() } else { 0.0 };
        let place = |k: usize| Vector::from([(k % side) as f64 + noise(k), (k / side) as f64 + noise(k + 7)]);
        let n = side * side;
        Particles {
            positions: (0..n).map(place).collect(),
            volumes: (0..n).map(|k| k as f64).collect(),
            kernel_volumes: (0..n).map(|k| 2.0 * k as f64).collect(),
            faces: vec![Face { particle: 17, normal: Vector::x(), area: 1.0, point: place(17), side: None }],
            cells: vec![0, 1, side as u32, side as u32 + 1],
        }
    }

    #[test]
    fn everything_moves_with_its_particle_and_neighbours_come_near() {
        let (before, mut after) = (square(100, true), square(100, true));
        let numbers = number_along_curve(&mut after).expect("a large cloud");
        for (old, &new) in numbers.iter().enumerate() {
            let new = new as usize;
            assert_eq!(after.positions[new], before.positions[old]);
            assert_eq!((after.volumes[new], after.kernel_volumes[new]), (old as f64, 2.0 * old as f64));
        }
        assert_eq!(after.positions[after.faces[0].particle], after.faces[0].point);
        assert_eq!(after.cells, before.cells.iter().map(|&c| numbers[c as usize]).collect::<Vec<_>>());
        // Neighbours across the lines: 100 numbers away before, half of them within 30 now.
        let near = (0..9900).filter(|&k| numbers[k].abs_diff(numbers[k + 100]) < 30).count();
        assert!(near > 4950, "{near}");
    }

    #[test]
    fn lattices_and_small_clouds_keep_their_order() {
        assert_eq!(number_along_curve(&mut square(100, false)), None);
        assert_eq!(number_along_curve(&mut square(64, true)), None);
        assert!(number_along_curve(&mut square(65, true)).is_some());
    }
}
