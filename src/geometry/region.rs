//! Regions of space by a function that is negative inside: shapes, and unions, intersections and differences of them.
//!
//! The value never exceeds the distance to the surface in magnitude, which is what lets [`CutLattice`](super::CutLattice)
//! skip cells without looking closer. Set operations take the largest or smallest value, which keeps that property.

use std::f64::consts::PI;
use std::sync::Arc;

use super::surface::Surface;
use crate::tensor::Vector;

/// A region of space.
#[derive(Debug, Clone)]
pub enum Region<const D: usize> {
    /// Between two corners, m.
    Box {
        /// Lower corner.
        lower: Vector<D>,
        /// Upper corner.
        upper: Vector<D>,
    },
    /// Between two concentric spheres (circles in 2D), m; `inner = 0` is a ball or disc.
    Shell {
        /// Centre.
        centre: Vector<D>,
        /// Inner radius.
        inner: f64,
        /// Outer radius.
        outer: f64,
    },
    /// Between two coaxial cylinders, m; `inner = 0` is a full one.
    Tube {
        /// Middle of one end.
        start: Vector<D>,
        /// Unit vector to the other end.
        axis: Vector<D>,
        /// Distance of the ends.
        length: f64,
        /// Inner radius.
        inner: f64,
        /// Outer radius.
        outer: f64,
    },
    /// Behind a plane: where `(X − point)·normal ≤ 0`.
    HalfSpace {
        /// A point of the plane, m.
        point: Vector<D>,
        /// Outward unit normal.
        normal: Vector<D>,
    },
    /// A polygon in the plane, in 3D extruded along z.
    Polygon {
        /// Corners in order, either way round, m.
        corners: Vec<[f64; 2]>,
        /// Ends along z, m; in 3D only.
        height: Option<[f64; 2]>,
    },
    /// Inside a triangulated surface; in 3D only.
    Inside(Arc<Surface>),
    /// In any of them.
    Union(Vec<Region<D>>),
    /// In all of them.
    Intersection(Vec<Region<D>>),
    /// In the first, but in none of the others.
    Difference(Vec<Region<D>>),
}

impl<const D: usize> Region<D> {
    /// Negative inside, positive outside, zero on the surface; at most the distance to the surface, m.
    pub fn value(&self, x: &Vector<D>) -> f64 {
        match self {
            Self::Box { lower, upper } => (lower - x).max().max((x - upper).max()),
            Self::Shell { centre, inner, outer } => between((x - centre).norm(), *inner, *outer),
            Self::Tube { start, axis, length, inner, outer } => {
                let from = x - start;
                let along = from.dot(axis);
                let radius = (from - axis * along).norm();
                between(radius, *inner, *outer).max(-along).max(along - length)
            }
            Self::HalfSpace { point, normal } => (x - point).dot(normal),
            Self::Polygon { corners, height } => {
                let plane = polygon_distance(corners, [x[0], x[D.min(2) - 1]]);
                height.map_or(plane, |[low, high]| plane.max(low - x[D - 1]).max(x[D - 1] - high))
            }
            Self::Inside(surface) => surface.signed_distance(&[x[0], x[1 % D], x[2 % D]].into()),
            Self::Union(parts) => parts.iter().map(|part| part.value(x)).fold(f64::INFINITY, f64::min),
            Self::Intersection(parts) => parts.iter().map(|part| part.value(x)).fold(f64::NEG_INFINITY, f64::max),
            Self::Difference(parts) => {
                let mut values = parts.iter().map(|part| part.value(x));
                let first = values.next().unwrap_or(f64::INFINITY);
                values.fold(first, |value, other| value.max(-other))
            }
        }
    }

    /// Corners of a box around it, infinite where it has no end.
    pub fn bounds(&self) -> (Vector<D>, Vector<D>) {
        let everywhere = (Vector::repeat(f64::NEG_INFINITY), Vector::repeat(f64::INFINITY));
        match self {
            Self::Box { lower, upper } => (*lower, *upper),
            Self::Shell { centre, outer, .. } => (centre.add_scalar(-outer), centre.add_scalar(*outer)),
            Self::Tube { start, axis, length, outer, .. } => {
                let end = start + axis * *length;
                // Extent of the discs at the ends.
                let reach = axis.map(|a| outer * (1.0 - a * a).max(0.0).sqrt());
                (start.inf(&end) - reach, start.sup(&end) + reach)
            }
            Self::HalfSpace { point, normal } => {
                let (mut lower, mut upper) = everywhere;
                for axis in 0..D {
                    if normal[axis].abs() == 1.0 {
                        let end = if normal[axis] > 0.0 { &mut upper } else { &mut lower };
                        end[axis] = point[axis];
                    }
                }
                (lower, upper)
            }
            Self::Polygon { corners, height } => {
                let (mut lower, mut upper) = everywhere;
                for axis in 0..D.min(2) {
                    let values = || corners.iter().map(|corner| corner[axis]);
                    lower[axis] = values().fold(f64::INFINITY, f64::min);
                    upper[axis] = values().fold(f64::NEG_INFINITY, f64::max);
                }
                if let Some([low, high]) = height {
                    (lower[D - 1], upper[D - 1]) = (*low, *high);
                }
                (lower, upper)
            }
            Self::Inside(surface) => {
                let (lower, upper) = surface.bounds();
                (Vector::from_fn(|axis, _| lower[axis]), Vector::from_fn(|axis, _| upper[axis]))
            }
            Self::Union(parts) => {
                let none = (Vector::repeat(f64::INFINITY), Vector::repeat(f64::NEG_INFINITY));
                parts.iter().map(Self::bounds).fold(none, |(l, u), (lower, upper)| (l.inf(&lower), u.sup(&upper)))
            }
            Self::Intersection(parts) => {
                let bounds = parts.iter().map(Self::bounds);
                bounds.fold(everywhere, |(l, u), (lower, upper)| (l.sup(&lower), u.inf(&upper)))
            }
            Self::Difference(parts) => parts.first().map_or(everywhere, Self::bounds),
        }
    }

    /// Volume, m^D, where there is a formula.
    pub fn volume(&self) -> Option<f64> {
        let ball = |radius: f64| match D {
            1 => 2.0 * radius,
            2 => PI * radius * radius,
            _ => 4.0 / 3.0 * PI * radius.powi(3),
        };
        match self {
            Self::Box { lower, upper } => Some((upper - lower).product()),
            Self::Shell { inner, outer, .. } => Some(ball(*outer) - ball(*inner)),
            Self::Tube { length, inner, outer, .. } if D == 3 => Some(length * PI * (outer * outer - inner * inner)),
            Self::Polygon { corners, height } => {
                Some(polygon_area(corners).abs() * height.map_or(1.0, |[low, high]| high - low))
            }
            Self::Inside(surface) if surface.is_closed() => Some(surface.volume()),
            _ => None,
        }
    }
}

/// Distance to the nearer of two radii, negative between them.
fn between(radius: f64, inner: f64, outer: f64) -> f64 {
    let beyond = radius - outer;
    if inner > 0.0 { beyond.max(inner - radius) } else { beyond }
}

/// Area of a polygon, positive if its corners run counterclockwise.
pub fn polygon_area(corners: &[[f64; 2]]) -> f64 {
    let Some(&[x0, y0]) = corners.first() else { return 0.0 };
    let next = corners.iter().cycle().skip(1);
    corners.iter().zip(next).map(|(a, b)| (a[0] - x0) * (b[1] - y0) - (b[0] - x0) * (a[1] - y0)).sum::<f64>() / 2.0
}

/// Distance to the edges of a polygon, negative inside (even–odd rule).
fn polygon_distance(corners: &[[f64; 2]], [x, y]: [f64; 2]) -> f64 {
    let (mut nearest, mut inside) = (f64::INFINITY, false);
    let next = corners.iter().cycle().skip(1);
    for (a, b) in corners.iter().zip(next) {
        let (ex, ey) = (b[0] - a[0], b[1] - a[1]);
        let (dx, dy) = (x - a[0], y - a[1]);
        let length = ex * ex + ey * ey;
        let share = if length > 0.0 { ((dx * ex + dy * ey) / length).clamp(0.0, 1.0) } else { 0.0 };
        nearest = nearest.min((dx - share * ex).hypot(dy - share * ey));
        if (a[1] > y) != (b[1] > y) && x < a[0] + (y - a[1]) / ey * ex {
            inside = !inside;
        }
    }
    if inside { -nearest } else { nearest }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_volumes_and_bounds_of_shapes() {
        let square =
            Region::<2>::Polygon { corners: vec![[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]], height: None };
        let hole = Region::<2>::Shell { centre: Vector::from([1.0, 0.5]), inner: 0.0, outer: 0.25 };
        assert!((square.value(&Vector::from([1.0, 0.25])) + 0.25).abs() < 1e-15);
        assert!((square.value(&Vector::from([3.0, 2.0])) - 2.0_f64.sqrt()).abs() < 1e-15);
        let plate = Region::Difference(vec![square.clone(), hole]);
        assert!((plate.value(&Vector::from([1.0, 0.5])) - 0.25).abs() < 1e-15);
        assert_eq!((square.volume(), plate.volume()), (Some(2.0), None));
        assert_eq!(plate.bounds(), (Vector::from([0.0, 0.0]), Vector::from([2.0, 1.0])));

        let tube = Region::<3>::Tube {
            start: Vector::from([0.0, 0.0, 1.0]),
            axis: Vector::from([0.0, 0.0, 1.0]),
            length: 2.0,
            inner: 0.5,
            outer: 1.0,
        };
        assert_eq!(tube.bounds(), (Vector::from([-1.0, -1.0, 1.0]), Vector::from([1.0, 1.0, 3.0])));
        assert!((tube.value(&Vector::from([0.0, 0.75, 2.0])) + 0.25).abs() < 1e-15);
        assert!((tube.value(&Vector::from([0.0, 0.0, 2.0])) - 0.5).abs() < 1e-15);
        assert!((tube.volume().unwrap() - 1.5 * PI).abs() < 1e-14);
        let below = Region::HalfSpace { point: Vector::from([0.0, 0.0, 2.0]), normal: Vector::from([0.0, 0.0, 1.0]) };
        let cut = Region::Intersection(vec![tube, below]);
        assert_eq!(cut.bounds().1[2], 2.0);
        assert!(cut.value(&Vector::from([0.0, 0.75, 2.5])) > 0.0);
    }
}
