//! A closed triangulated surface cut by the cells of a lattice: volumes and moments of all cells, exactly.
//!
//! Triangles are cut into pieces that lie in one cell each. Seen along the last direction z, a point is inside if the
//! pieces above it face up once more than down; so for a cell between `z₀` and `z₁`, with area vectors `a N` of pieces
//!
//! ```text
//! V = Σ_pieces inside a N_z (z − z₀)  +  Σ_pieces above a N_z (z₁ − z₀)
//! ```
//!
//! and likewise for moments. Cells without pieces must come out empty or whole: else the surface meets itself, and the
//! winding number has to decide.

use std::ops::Range;

use rayon::prelude::*;

use super::cut::CutLattice;
use super::simplex::Part;
use super::surface::Surface;
use crate::tensor::Vector;

/// Corners that are nearer to the side of a cell are moved onto it, cells: coordinates of files have seven digits.
const SNAP: f64 = 1e-4;
/// What a cell without pieces may be off from empty or whole.
const OFF: f64 = 1e-6;

/// A convex piece of a triangle in a cell of a column.
struct Piece {
    layer: usize,
    corners: Vec<Vector<3>>,
}

/// Parts of the cells inside of a closed surface, in the order of their numbers; none if it meets itself. In 3D only.
pub(super) fn clip<const D: usize>(lattice: &CutLattice<D>, surface: &Surface) -> Option<Vec<(usize, Part<D>)>> {
    let cells = lattice.cells();
    let [nx, ny, nz] = <[usize; 3]>::try_from(cells.as_slice()).ok()?;
    let mut columns: Vec<Vec<Piece>> = (0..nx * ny).map(|_| Vec::new()).collect();
    for triangle in surface.triangles() {
        let corners = triangle.map(|corner| {
            let cells = lattice.in_cells(&Vector::from_fn(|axis, _| corner[axis]));
            Vector::<3>::from_fn(|axis, _| {
                let (place, nearest) = (cells[axis % D], cells[axis % D].round());
                if (place - nearest).abs() < SNAP { nearest } else { place }
            })
        });
        let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
        for (i, slice) in slices(&corners, 0, normal[0], nx) {
            for (j, rod) in slices(&slice, 1, normal[1], ny) {
                let pieces = slices(&rod, 2, normal[2], nz);
                columns[i + nx * j].extend(pieces.map(|(layer, corners)| Piece { layer, corners }));
            }
        }
    }
    let column = |(index, pieces): (usize, &Vec<Piece>)| column::<D>([index % nx, index / nx], pieces, nz);
    let columns: Option<Vec<Vec<Part<D>>>> = columns.par_iter().enumerate().map(column).collect();
    let mut parts = Vec::new();
    let columns = columns?;
    for layer in 0..nz {
        for (index, column) in columns.iter().enumerate() {
            if let Some(part) = column.get(layer).filter(|part| part.volume > 0.0 || !part.patches.is_empty()) {
                parts.push((index + nx * ny * layer, part.clone()));
            }
        }
    }
    Some(parts)
}

/// Cuts a convex polygon along whole numbers of a coordinate: each piece with the cell it lies in. What lies between two
/// cells belongs to the one behind it.
fn slices(
    corners: &[Vector<3>],
    axis: usize,
    normal: f64,
    most: usize,
) -> impl Iterator<Item = (usize, Vec<Vector<3>>)> + '_ {
    let low = corners.iter().map(|corner| corner[axis]).fold(f64::INFINITY, f64::min);
    let high = corners.iter().map(|corner| corner[axis]).fold(f64::NEG_INFINITY, f64::max);
    let cell = |place: f64| place.clamp(0.0, most as f64 - 1.0) as usize;
    let range: Range<usize> = if corners.len() < 3 {
        0..0
    } else if low == high {
        let behind = if normal > 0.0 { low.ceil() - 1.0 } else { low.floor() };
        cell(behind)..cell(behind) + 1
    } else {
        cell(low.floor())..cell(high.ceil() - 1.0) + 1
    };
    let is_one = range.len() == 1;
    range.map(move |index| {
        if is_one {
            return (index, corners.to_vec());
        }
        let above = half(corners, axis, index as f64, 1.0);
        (index, half(&above, axis, index as f64 + 1.0, -1.0))
    })
}

/// The part of a convex polygon beyond a plane (Sutherland and Hodgman).
fn half(corners: &[Vector<3>], axis: usize, plane: f64, sign: f64) -> Vec<Vector<3>> {
    let mut kept = Vec::with_capacity(corners.len() + 1);
    let next = corners.iter().cycle().skip(1);
    for (a, b) in corners.iter().zip(next) {
        let (da, db) = (sign * (a[axis] - plane), sign * (b[axis] - plane));
        if da >= 0.0 {
            kept.push(*a);
        }
        if (da > 0.0 && db < 0.0) || (da < 0.0 && db > 0.0) {
            // From the same end whichever way the edge is run through: neighbours share the point.
            let (from, to, df, dt) = if da > 0.0 { (a, b, da, db) } else { (b, a, db, da) };
            let mut point = from + (to - from) * (df / (df - dt));
            point[axis] = plane;
            kept.push(point);
        }
    }
    kept
}

/// The cells of a column, from the highest down; none if one without pieces is neither empty nor whole.
fn column<const D: usize>([i, j]: [usize; 2], pieces: &[Piece], layers: usize) -> Option<Vec<Part<D>>> {
    if pieces.is_empty() {
        return Some(Vec::new());
    }
    let mut parts: Vec<Part<D>> = vec![Part::default(); layers];
    // Relative to the middle of the cell, where numbers are small.
    let mut sums = vec![[0.0_f64; 4]; layers];
    // `Σ a N_z`, and the same times x and y, of every layer.
    let mut faces = vec![[0.0_f64; 3]; layers];
    let vector = |from: Vector<3>| Vector::<D>::from_fn(|axis, _| from[axis]);
    let foot = Vector::<3>::new(i as f64 + 0.5, j as f64 + 0.5, 0.0);
    for Piece { layer, corners } in pieces {
        let foot = foot + Vector::<3>::new(0.0, 0.0, *layer as f64);
        for pair in corners[1..].windows(2) {
            let [a, b, c] = [corners[0], pair[0], pair[1]].map(|corner| corner - foot);
            let area = (b - a).cross(&(c - a)) / 2.0;
            parts[*layer].add_piece(vector(area), &vector((a + b + c) / 3.0 + foot));
            // Middles of the edges: exact for the squares below.
            for p in [(a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0] {
                let weight = area[2] / 3.0;
                let sum = &mut sums[*layer];
                sum[0] += weight * p[2];
                sum[1] += weight * p[2] * p[0];
                sum[2] += weight * p[2] * p[1];
                // From the middle of the cell: ∫ (z − ½) dz from 0.
                sum[3] += weight * 0.5 * (p[2] * p[2] - p[2]);
                let face = &mut faces[*layer];
                face[0] += weight;
                face[1] += weight * p[0];
                face[2] += weight * p[1];
            }
        }
    }
    let mut above = [0.0_f64; 3];
    for layer in (0..layers).rev() {
        let mut sum = sums[layer];
        (0..3).for_each(|k| sum[k] += above[k]);
        let part = &mut parts[layer];
        if part.patches.is_empty() {
            let whole = sum[0].round();
            if (sum[0] - whole).abs() > OFF || !(whole == 0.0 || whole == 1.0) {
                return None;
            }
            sum = [whole, 0.0, 0.0, 0.0];
        } else if !(-OFF..1.0 + OFF).contains(&sum[0]) {
            return None;
        }
        part.volume = sum[0].max(0.0);
        let centre = foot + Vector::<3>::new(0.0, 0.0, layer as f64 + 0.5);
        part.moment = vector(centre * part.volume + Vector::<3>::new(sum[1], sum[2], sum[3]));
        (0..3).for_each(|k| above[k] += faces[layer][k]);
    }
    Some(parts)
}
