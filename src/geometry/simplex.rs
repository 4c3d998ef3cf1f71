//! The part of a simplex where a function is negative, and what parts of a cell add up to. Lengths are in cells.

use crate::tensor::{Tensor, Vector, determinant};

/// Normals that enclose less than 30° belong to one patch.
const COSINE_OF_PATCH: f64 = 0.866_025_403_784_438_6;

/// A corner of a simplex with the value of the function.
#[derive(Debug, Clone, Copy)]
pub(super) struct Corner<const D: usize> {
    pub x: Vector<D>,
    pub value: f64,
}

/// What is inside of a cell.
#[derive(Debug, Clone)]
pub(super) struct Part<const D: usize> {
    pub volume: f64,
    /// `∫ X dV`.
    pub moment: Vector<D>,
    pub patches: Vec<Patch<D>>,
}

impl<const D: usize> Default for Part<D> {
    fn default() -> Self {
        Self { volume: 0.0, moment: Vector::zeros(), patches: Vec::new() }
    }
}

/// A nearly flat piece of the surface.
#[derive(Debug, Clone)]
pub(super) struct Patch<const D: usize> {
    /// Normal of the first piece.
    normal: Vector<D>,
    /// Sum of the area vectors.
    pub area: Vector<D>,
    /// Sum of the areas, and of the areas times places.
    size: f64,
    moment: Vector<D>,
}

impl<const D: usize> Patch<D> {
    /// The middle.
    pub fn point(&self) -> Vector<D> {
        self.moment / self.size
    }
}

impl<const D: usize> Part<D> {
    /// A cell that is inside as a whole.
    pub fn whole(lower: &Vector<D>) -> Self {
        Self { volume: 1.0, moment: lower.add_scalar(0.5), patches: Vec::new() }
    }

    /// Adds a piece of the surface with an area vector and a middle.
    pub fn add_piece(&mut self, area: Vector<D>, point: &Vector<D>) {
        let size = area.norm();
        if size > 0.0 {
            self.add_patch(&Patch { normal: area / size, area, size, moment: point * size });
        }
    }

    fn add_patch(&mut self, piece: &Patch<D>) {
        match self.patches.iter_mut().find(|patch| patch.normal.dot(&piece.normal) > COSINE_OF_PATCH) {
            Some(patch) => {
                patch.area += piece.area;
                patch.size += piece.size;
                patch.moment += piece.moment;
            }
            None => self.patches.push(piece.clone()),
        }
    }

    /// Takes over what another cell has.
    pub fn merge(&mut self, other: &Self) {
        self.volume += other.volume;
        self.moment += other.moment;
        other.patches.iter().for_each(|patch| self.add_patch(patch));
    }

    fn add_volume(&mut self, corners: &[Vector<D>], sign: f64) {
        let edges = Tensor::<D>::from_fn(|axis, corner| corners[corner + 1][axis] - corners[0][axis]);
        let factorial = (1..=D).product::<usize>() as f64;
        let volume = sign * determinant(&edges).abs() / factorial;
        self.volume += volume;
        self.moment += corners.iter().sum::<Vector<D>>() * (volume / corners.len() as f64);
    }

    /// Adds a simplex of the surface, whose normal points along `outwards`.
    fn add_facet(&mut self, corners: &[Vector<D>], outwards: &Vector<D>) {
        let area = area_vector(corners);
        let sign = if area.dot(outwards) < 0.0 { -1.0 } else { 1.0 };
        self.add_piece(area * sign, &(corners.iter().sum::<Vector<D>>() / corners.len() as f64));
    }
}

/// Area vector of `D` points, of either sign.
fn area_vector<const D: usize>(corners: &[Vector<D>]) -> Vector<D> {
    match D {
        1 => Vector::repeat(1.0),
        2 => {
            let along = corners[1] - corners[0];
            Vector::from_fn(|axis, _| if axis == 0 { along[1] } else { -along[0] })
        }
        _ => {
            let (a, b) = (corners[1] - corners[0], corners[2] - corners[0]);
            Vector::from_fn(|i, _| {
                let (j, k) = ((i + 1) % 3, (i + 2) % 3);
                0.5 * (a[j] * b[k] - a[k] * b[j])
            })
        }
    }
}

/// Orders in which the edges of a cube are walked from its lowest to its highest corner: one simplex each.
pub(super) fn permutations<const D: usize>() -> &'static [[usize; 3]] {
    match D {
        1 => &[[0, 0, 0]],
        2 => &[[0, 1, 0], [1, 0, 0]],
        _ => &[[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]],
    }
}

/// What a simplex asks of the function.
pub(super) trait Level<const D: usize> {
    /// Where it is zero between two corners, one negative and one not. Asked with the corners in their order, so that
    /// simplices which share an edge share the point.
    fn crossing(&self, a: &Corner<D>, b: &Corner<D>) -> Vector<D>;
    /// The value: zero on the surface, within rounding.
    fn value(&self, x: &Vector<D>) -> f64;
}

/// Adds the part of a simplex where the value is negative. Corners with the value zero are on the surface.
pub(super) fn add_simplex<const D: usize>(part: &mut Part<D>, corners: &[Corner<D>], level: &impl Level<D>) {
    if corners.iter().all(|corner| corner.value <= 0.0) {
        add_whole(part, corners, level);
        return;
    }
    let (mut inside, mut outside) = ([0; 4], [0; 4]);
    let (mut ins, mut outs) = (0, 0);
    for (index, corner) in corners.iter().enumerate() {
        let (list, count) = if corner.value < 0.0 { (&mut inside, &mut ins) } else { (&mut outside, &mut outs) };
        list[*count] = index;
        *count += 1;
    }
    if ins == 0 {
        return;
    }
    let x = |index: usize| corners[index].x;
    let between = |i: usize, o: usize| level.crossing(&corners[i.min(o)], &corners[i.max(o)]);
    let mut all = [Vector::zeros(); 4];
    (0..=D).for_each(|index| all[index] = x(index));
    let outwards = x(outside[0]) - x(inside[0]);
    let mut tip = [Vector::zeros(); 4];
    if ins == 1 || outs == 1 {
        // The simplex at the corner that is alone on its side.
        let alone = if ins == 1 { inside[0] } else { outside[0] };
        let others = if ins == 1 { &outside } else { &inside };
        tip[0] = x(alone);
        (0..D).for_each(|k| tip[k + 1] = between(alone, others[k]));
        if ins == 1 {
            part.add_volume(&tip[..=D], 1.0);
        } else {
            part.add_volume(&all[..=D], 1.0);
            part.add_volume(&tip[..=D], -1.0);
        }
        part.add_facet(&tip[1..=D], &outwards);
        return;
    }
    // Two and two in space: a wedge of three simplices, cut along the diagonal that its surface is cut along.
    let ([a, b], [c, d]) = ([inside[0], inside[1]], [outside[0], outside[1]]);
    let (ac, ad, bc, bd) = (between(a, c), between(a, d), between(b, c), between(b, d));
    part.add_volume(&[x(a), ac, ad, bd], 1.0);
    part.add_volume(&[x(a), ac, bd, bc], 1.0);
    part.add_volume(&[x(a), bc, bd, x(b)], 1.0);
    part.add_facet(&[ac, ad, bd], &outwards);
    part.add_facet(&[ac, bd, bc], &outwards);
}

/// A simplex with no corner outside: whole, with those of its faces on the surface that have the outside behind them. One
/// with all corners on the surface lies at an edge of the region, on either side.
fn add_whole<const D: usize>(part: &mut Part<D>, corners: &[Corner<D>], level: &impl Level<D>) {
    let mut all = [Vector::zeros(); 4];
    corners.iter().enumerate().for_each(|(index, corner)| all[index] = corner.x);
    let on_surface = corners.iter().filter(|corner| corner.value == 0.0).count();
    if on_surface > D && level.value(&mean(&all[..=D])) >= 0.0 {
        return;
    }
    part.add_volume(&all[..=D], 1.0);
    if on_surface < D {
        return;
    }
    for opposite in 0..=D {
        let mut face = [Vector::zeros(); 4];
        let mut others = (0..=D).filter(|index| *index != opposite);
        if others.clone().any(|index| corners[index].value < 0.0) {
            continue;
        }
        face.iter_mut().zip(&mut others).for_each(|(place, index)| *place = all[index]);
        let middle = mean(&face[..D]);
        let area = area_vector(&face[..D]);
        let outwards = if area.dot(&(all[opposite] - middle)) > 0.0 { -area } else { area };
        // What the simplex behind it makes of itself.
        face[D] = behind(&all[..=D], opposite);
        let value = level.value(&face[D]);
        if value > 0.0 || (value == 0.0 && level.value(&mean(&face[..=D])) >= 0.0) {
            part.add_facet(&face[..D], &outwards);
        }
    }
}

/// The corner of the simplex on the other side of the face that is opposite to a corner.
fn behind<const D: usize>(corners: &[Vector<D>], opposite: usize) -> Vector<D> {
    match opposite {
        0 => corners[D] + (corners[1] - corners[0]),
        last if last == D => corners[0] - (corners[D] - corners[D - 1]),
        middle => corners[middle - 1] + corners[middle + 1] - corners[middle],
    }
}

fn mean<const D: usize>(points: &[Vector<D>]) -> Vector<D> {
    points.iter().sum::<Vector<D>>() / points.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Linear;

    impl<const D: usize> Level<D> for Linear {
        fn crossing(&self, a: &Corner<D>, b: &Corner<D>) -> Vector<D> {
            a.x + (b.x - a.x) * (a.value.abs() / (a.value.abs() + b.value.abs()))
        }

        fn value(&self, _: &Vector<D>) -> f64 {
            1.0
        }
    }

    fn closed<const D: usize>(value: impl Fn(&Vector<D>) -> f64) {
        // Zero order of the values: all cases of inside and outside.
        let mut corners = [Corner { x: Vector::<D>::zeros(), value: 0.0 }; 4];
        for axis in 0..D {
            corners[axis + 1].x[axis] = 1.0 + 0.1 * axis as f64;
        }
        corners.iter_mut().for_each(|corner| corner.value = value(&corner.x));
        let other = corners.map(|corner| Corner { value: -corner.value, ..corner });
        let parts = [corners, other].map(|corners| {
            let mut part = Part::default();
            add_simplex(&mut part, &corners[..=D], &Linear);
            part
        });
        let mut whole = Part::<D>::default();
        whole.add_volume(&corners.map(|corner| corner.x)[..=D], 1.0);
        assert!((parts[0].volume + parts[1].volume - whole.volume).abs() < 1e-15);
        assert!((parts[0].moment + parts[1].moment - whole.moment).norm() < 1e-15);
        let areas = parts.map(|part| part.patches.iter().map(|patch| patch.area).sum::<Vector<D>>());
        assert!((areas[0] + areas[1]).norm() < 1e-15);
    }

    #[test]
    fn both_sides_of_a_cut_make_the_whole() {
        closed::<1>(|x| x[0] - 0.3);
        for shift in [0.2, 0.45, 0.6, 1.05] {
            closed::<2>(|x| x[0] + 0.7 * x[1] - shift);
            closed::<3>(|x| x[0] + 0.7 * x[1] + 0.9 * x[2] - shift);
            closed::<3>(|x| x[0] - 0.7 * x[1] - 0.2 * x[2] + 0.5 - shift);
        }
    }
}
