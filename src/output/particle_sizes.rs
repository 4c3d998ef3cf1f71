//! How large particles are drawn: from their volume, else from the distance to their neighbours.

use std::collections::HashMap;

use super::view::{NO_BOUNDS, has_place, widened};

/// Radius of a disc over the edge of its particle. In the plane large discs touch; small ones cover the plane, or the
/// white between them would wash out the colours.
const RADIUS_OF_LARGE: f64 = 0.5;
const RADIUS_OF_SMALL: f64 = 0.76;
/// Edge in points from which discs in the plane are large.
const LARGE_FROM: f64 = 8.0;
const RADIUS_IN_SPACE: f64 = 0.55;
/// Particles whose nearest neighbours are looked for.
const SAMPLED: usize = 2000;

/// Edge lengths of particles.
pub(super) struct Sizes<'a> {
    dim: usize,
    volumes: &'a [f64],
    /// Edge of most particles, m.
    pub(super) typical: f64,
    /// The edge that decides how discs are drawn, m: the typical one, or that of a series of pictures.
    pub(super) usual: f64,
}

impl<'a> Sizes<'a> {
    /// Sizes from volumes, or all the same from the spacing or, if that is of no use, from the positions.
    pub(super) fn new(dim: usize, volumes: &'a [f64], spacing: f64, positions: &[f64]) -> Self {
        let mut sizes = Self { dim, volumes, typical: spacing, usual: spacing };
        let mut edges: Vec<f64> = (0..volumes.len()).map(|at| sizes.of(at)).filter(|&edge| usable(edge)).collect();
        edges.sort_by(f64::total_cmp);
        sizes.typical = match edges.get(edges.len() / 2) {
            Some(&edge) => edge,
            None if usable(spacing) => spacing,
            None => nearest(dim, positions),
        };
        sizes.usual = sizes.typical;
        sizes
    }

    /// Of particles whose size does not matter.
    pub(super) fn none() -> Self {
        Self { dim: 1, volumes: &[], typical: 0.0, usual: 0.0 }
    }

    /// Edge of a particle, m.
    pub(super) fn of(&self, at: usize) -> f64 {
        let edge = |volume: &f64| match self.dim {
            2 => volume.sqrt(),
            3 => volume.cbrt(),
            _ => *volume,
        };
        self.volumes.get(at).map(edge).filter(|&edge| usable(edge)).unwrap_or(self.typical)
    }

    /// Radius in points of the disc of a particle with this edge.
    pub(super) fn radius(&self, edge: f64, scale: f64) -> f64 {
        let usual = self.usual * scale;
        match self.dim {
            3 => RADIUS_IN_SPACE * edge * scale,
            // Particles on a boundary may have half the volume of the others and the same distance: all alike, or
            // there would be holes.
            _ if usual < LARGE_FROM => RADIUS_OF_SMALL * (edge * scale).max(usual),
            _ => RADIUS_OF_LARGE * edge * scale,
        }
    }
}

fn usable(length: f64) -> bool {
    length > 0.0 && length < 1e150
}

/// Median distance of particles (of some, if there are many) to their nearest neighbour; 1 if there is none.
fn nearest(dim: usize, positions: &[f64]) -> f64 {
    let stride = (positions.len() / dim.max(1)).div_ceil(SAMPLED).max(1);
    let mut distances: Vec<f64> = distances(dim, positions, stride).into_iter().flatten().collect();
    distances.sort_by(f64::total_cmp);
    distances.get(distances.len() / 2).copied().unwrap_or(1.0)
}

/// What the volumes are to be multiplied by to get those of particles that are not cut by the boundary.
///
/// Particles *on* a boundary stand for half of the volume around them, or less, but are as far from their neighbours as
/// all others: drawn by that volume, a surface would be a row of small dots. The distance tells, up to twice the edge.
pub(super) fn uncut(dim: usize, positions: &[f64], volumes: &[f64]) -> Vec<f64> {
    let edge = |volume: f64| volume.powf(1.0 / dim as f64);
    let factor = |(distance, &volume): (Option<f64>, &f64)| match distance {
        Some(distance) if usable(edge(volume)) => (distance / edge(volume)).clamp(1.0, 2.0).powi(dim as i32),
        _ => 1.0,
    };
    distances(dim, positions, 1).into_iter().zip(volumes).map(factor).collect()
}

/// Distance of every `stride`-th particle to its nearest neighbour, where that is anywhere near.
fn distances(dim: usize, positions: &[f64], stride: usize) -> Vec<Option<f64>> {
    let points: Vec<&[f64]> = positions.chunks_exact(dim.max(1)).collect();
    let bounds = widened(NO_BOUNDS, positions, dim);
    let longest = bounds[..dim.clamp(1, 3)].iter().map(|(low, high)| high - low).fold(0.0, f64::max);
    let wanted = points.len().div_ceil(stride);
    if points.len() < 2 || !usable(longest) {
        return vec![None; wanted];
    }
    // Cells that hold a particle or so in the mean, and never more of them than can be numbered.
    let filled = bounds[..dim].iter().map(|(low, high)| (high - low).max(1e-3 * longest)).product::<f64>();
    let cell = (filled / points.len() as f64).powf(1.0 / dim as f64).max(1e-6 * longest);
    let place = |point: &[f64]| -> [i64; 3] {
        std::array::from_fn(|axis| point.get(axis).map_or(0, |x| ((x - bounds[axis].0) / cell) as i64))
    };
    let mut cells: HashMap<[i64; 3], Vec<usize>> = HashMap::new();
    for (at, point) in points.iter().enumerate().filter(|(_, point)| has_place(point)) {
        cells.entry(place(point)).or_default().push(at);
    }
    let reach = |axis: usize, ring: i64| if axis < dim { -ring..=ring } else { 0..=0 };
    let distance = |at: usize| {
        let [x, y, z] = place(points[at]);
        let near = |ring: i64| {
            let around = reach(0, ring).flat_map(|i| reach(1, ring).map(move |j| (i, j)));
            let around = around.flat_map(|(i, j)| reach(2, ring).map(move |k| [x + i, y + j, z + k]));
            let others = around.filter_map(|cell| cells.get(&cell)).flatten().filter(|&&other| other != at);
            let square = |&other: &usize| points[at].iter().zip(points[other]).map(|(a, b)| (a - b).powi(2)).sum();
            others.map(square).filter(|&square: &f64| square > 0.0).min_by(f64::total_cmp)
        };
        [1, 2, 4].into_iter().find_map(near).map(f64::sqrt)
    };
    (0..points.len()).step_by(stride).map(|at| has_place(points[at]).then(|| distance(at)).flatten()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_follow_volumes_else_spacing_else_neighbours() {
        let volumes = [0.25, 0.25, 0.0625, f64::NAN];
        let sizes = Sizes::new(2, &volumes, 9.0, &[]);
        assert_eq!((sizes.of(0), sizes.of(2), sizes.of(3), sizes.typical), (0.5, 0.25, 0.5, 0.5));
        assert_eq!(Sizes::new(3, &[8e-3; 4], 0.0, &[]).of(1), 8e-3f64.cbrt());
        assert_eq!(Sizes::new(3, &[], 0.5, &[]).of(7), 0.5);
        let lattice: Vec<f64> = (0..900).flat_map(|i| [f64::from(i % 30) * 0.2, f64::from(i / 30) * 0.3]).collect();
        assert!((Sizes::new(2, &[], 0.0, &lattice).typical - 0.2).abs() < 1e-12);
        assert_eq!(Sizes::new(2, &[], f64::NAN, &[1.0, 1.0]).typical, 1.0);
        // Vertex layout: half the volume on edges, a quarter in corners.
        let volume = |i: i32, count: i32, h: f64| if i == 0 || i == count - 1 { 0.5 * h } else { h };
        let halved: Vec<f64> = (0..900).map(|i| volume(i % 30, 30, 0.2) * volume(i / 30, 30, 0.2)).collect();
        let square: Vec<f64> = (0..900).flat_map(|i| [f64::from(i % 30) * 0.2, f64::from(i / 30) * 0.2]).collect();
        let whole: Vec<f64> =
            uncut(2, &square, &halved).iter().zip(&halved).map(|(factor, volume)| factor * volume).collect();
        assert!(whole.iter().all(|volume| (volume - 0.04).abs() < 1e-12), "{whole:?}");
        assert_eq!(uncut(2, &[1.0, 1.0, f64::NAN, 0.0], &[0.04, 0.04]), [1.0, 1.0]);
        // Small discs cover the plane, large ones show their size.
        assert_eq!(sizes.radius(0.25, 4.0), 0.76 * 2.0);
        assert_eq!(sizes.radius(0.25, 40.0), 5.0);
    }
}
