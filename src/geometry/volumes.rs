//! Quadrature volumes that add up: to the volume of the body, and to its first moments.

use nalgebra::DMatrix;

use crate::setup::Particles;
use crate::tensor::Vector;

/// Changes volumes as little as possible, relative to their size, such that `Σ V_a = |Ω|` and
/// `Σ V_a X_a = ∫ X dV`: `V_a ← V_a (1 + α + β·X_a)` minimises `Σ (ΔV_a)²/V_a`. The weights of the kernel sums
/// stay as they are. Without effect if the positions do not span space, or if a volume would not stay
/// positive: what is then off is told where it matters.
pub fn adapt_volumes<const D: usize>(particles: &mut Particles<D>, volume: f64, moment: &Vector<D>) {
    let Some(&origin) = particles.positions.first() else { return };
    // Relative to the centroid, in units of the size: a system of order one.
    let centre = moment / volume - origin;
    let size = particles.positions.iter().map(|x| (x - origin - centre).norm()).fold(0.0, f64::max);
    let place = |x: &Vector<D>| (x - origin - centre) / size;
    let shape = |x: &Vector<D>, j: usize| if j == 0 { 1.0 } else { place(x)[j - 1] };
    let mut matrix = DMatrix::<f64>::zeros(D + 1, D + 1);
    let mut lack = DMatrix::<f64>::zeros(D + 1, 1);
    lack[(0, 0)] = 1.0;
    for (x, v) in particles.positions.iter().zip(&particles.volumes) {
        let v = v / volume;
        for i in 0..=D {
            lack[(i, 0)] -= v * shape(x, i);
            for j in 0..=D {
                matrix[(i, j)] += v * shape(x, i) * shape(x, j);
            }
        }
    }
    let Some(factors) = matrix.lu().solve(&lack) else { return };
    let factor = |x: &Vector<D>| 1.0 + (0..=D).map(|j| factors[(j, 0)] * shape(x, j)).sum::<f64>();
    if particles.positions.iter().all(|x| factor(x) > 0.0) {
        for (x, v) in particles.positions.iter().zip(&mut particles.volumes) {
            *v *= factor(x);
        }
    }
}

/// Volume and first moments that the faces enclose: `∫ X_I dV = ½ Σ_f a_f N_f,I X_f,I²`.
pub fn enclosed<const D: usize>(particles: &Particles<D>) -> (f64, Vector<D>) {
    let Some(&origin) = particles.positions.first() else { return (0.0, Vector::zeros()) };
    let (mut volume, mut moment) = (0.0, Vector::<D>::zeros());
    for face in &particles.faces {
        let point = face.point - origin;
        volume += face.area * face.normal.dot(&point) / D as f64;
        moment += face.normal.component_mul(&point.component_mul(&point)) * (face.area / 2.0);
    }
    (volume, moment + origin * volume)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{BoxLattice, Layout};

    #[test]
    fn volumes_become_those_that_the_faces_enclose() {
        let lattice = BoxLattice::with_counts([3.0, -1.0], [5.0, 0.0], [9, 6], Layout::Vertex).unwrap();
        let mut particles = lattice.particles();
        let exact = particles.volumes.clone();
        for (a, volume) in particles.volumes.iter_mut().enumerate() {
            *volume *= 1.0 + 0.1 * (a as f64).sin();
        }
        let (volume, moment) = enclosed(&particles);
        assert!((volume - 2.0).abs() < 1e-14 && (moment - Vector::<2>::new(8.0, -1.0)).norm() < 1e-13, "{moment}");
        adapt_volumes(&mut particles, volume, &moment);
        let sum = particles.positions.iter().zip(&particles.volumes).fold(Vector::zeros(), |sum, (x, v)| sum + x * *v);
        assert!((particles.volumes.iter().sum::<f64>() - volume).abs() < 1e-14);
        assert!((sum - moment).norm() < 1e-13);
        // Little changed, and nothing where nothing was wrong.
        assert!(particles.volumes.iter().zip(&exact).all(|(v, e)| (v / e - 1.0).abs() < 0.13));
        let mut kept = lattice.particles();
        adapt_volumes(&mut kept, volume, &moment);
        assert!(kept.volumes.iter().zip(&exact).all(|(v, e)| (v / e - 1.0).abs() < 1e-14));
    }
}
