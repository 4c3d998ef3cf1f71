//! One cell after the other: its simplices shared among particles, its sides on the boundary made faces.

use std::collections::HashMap;

use super::super::msh::{Element, Form, Mesh};
use super::{MeshPoints, MeshedError, sorted};
use crate::setup::{Face, Particles};
use crate::tensor::{Tensor, Vector, determinant};

/// Sides of a form, seen from outside counterclockwise, as places in its list of nodes.
pub(super) fn sides(form: Form) -> &'static [&'static [usize]] {
    match form {
        Form::Point => &[],
        Form::Line => &[&[0], &[1]],
        Form::Triangle => &[&[0, 1], &[1, 2], &[2, 0]],
        Form::Quadrilateral => &[&[0, 1], &[1, 2], &[2, 3], &[3, 0]],
        Form::Tetrahedron => &[&[0, 2, 1], &[0, 1, 3], &[1, 2, 3], &[0, 3, 2]],
        Form::Hexahedron => &[&[0, 3, 2, 1], &[4, 5, 6, 7], &[0, 1, 5, 4], &[1, 2, 6, 5], &[2, 3, 7, 6], &[3, 0, 4, 7]],
        Form::Prism => &[&[0, 2, 1], &[3, 4, 5], &[0, 1, 4, 3], &[1, 2, 5, 4], &[2, 0, 3, 5]],
        Form::Pyramid => &[&[0, 3, 2, 1], &[0, 1, 4], &[1, 2, 4], &[2, 3, 4], &[3, 0, 4]],
    }
}

/// A corner of a simplex: the mean of some nodes.
struct Mean<'a, const D: usize> {
    x: Vector<D>,
    nodes: &'a [usize],
}

/// The particles and faces of the cells so far.
pub(super) struct Builder<'a, const D: usize> {
    mesh: &'a Mesh,
    points: MeshPoints,
    /// In cell mode, positions are moments until the end.
    pub(super) particles: Particles<D>,
    pub(super) of_node: HashMap<usize, usize>,
}

impl<'a, const D: usize> Builder<'a, D> {
    pub(super) fn new(mesh: &'a Mesh, cells: &[&Element], points: MeshPoints) -> Self {
        let mut builder = Self { mesh, points, particles: Particles::default(), of_node: HashMap::new() };
        let count = if points == MeshPoints::Nodes {
            let used = sorted(cells.iter().flat_map(|cell| cell.nodes.iter().copied()));
            for node in used {
                if let std::collections::hash_map::Entry::Vacant(entry) = builder.of_node.entry(node) {
                    entry.insert(builder.particles.positions.len());
                    builder.particles.positions.push(place(mesh, node));
                }
            }
            builder.particles.positions.len()
        } else {
            builder.particles.positions = vec![Vector::zeros(); cells.len()];
            cells.len()
        };
        builder.particles.volumes = vec![0.0; count];
        builder
    }

    pub(super) fn of_cell<'b>(&'b self, index: usize, nodes: &'b [usize]) -> Vec<usize> {
        match self.points {
            MeshPoints::Cells => vec![index],
            MeshPoints::Nodes => nodes.iter().filter_map(|node| self.of_node.get(node).copied()).collect(),
        }
    }

    fn mean<'b>(&self, nodes: &'b [usize]) -> Mean<'b, D> {
        let sum: Vector<D> = nodes.iter().map(|node| place::<D>(self.mesh, *node)).sum();
        Mean { x: sum / nodes.len() as f64, nodes }
    }

    /// Pieces of a side: its corners, and for a quadrilateral its middle with every edge.
    fn pieces<'b>(&self, side: &'b [usize]) -> Vec<Vec<Mean<'b, D>>> {
        if side.len() <= D {
            return vec![side.iter().map(|node| self.mean(std::slice::from_ref(node))).collect()];
        }
        let pair = |k: usize| {
            let (a, b) = (&side[k..=k], std::slice::from_ref(&side[(k + 1) % side.len()]));
            vec![self.mean(side), self.mean(a), self.mean(b)]
        };
        (0..side.len()).map(pair).collect()
    }

    /// Adds a cell, and returns the sense in which its nodes run: 1 or −1.
    pub(super) fn cell(&mut self, index: usize, cell: &Element) -> Result<f64, MeshedError> {
        let middle = self.mean(&cell.nodes);
        let mut simplices = Vec::new();
        let lists: Vec<Vec<usize>> =
            sides(cell.form).iter().map(|side| side.iter().map(|at| cell.nodes[*at]).collect()).collect();
        for piece in lists.iter().flat_map(|side| self.pieces(side)) {
            let edges = Tensor::<D>::from_fn(|axis, corner| piece[corner].x[axis] - middle.x[axis]);
            // A line has one corner on each side, which run the same way seen from the middle.
            let sign = if D == 1 { edges[(0, 0)].signum() } else { 1.0 };
            simplices.push((sign * determinant(&edges) / [1.0, 2.0, 6.0][D - 1], piece));
        }
        let total: f64 = simplices.iter().map(|(volume, _)| volume).sum();
        let sense = if total < 0.0 { -1.0 } else { 1.0 };
        let extent = cell.nodes.iter().map(|node| (place::<D>(self.mesh, *node) - middle.x).norm()).fold(0.0, f64::max);
        if total.is_nan() || total.abs() <= 1e-12 * extent.powi(D as i32) {
            return Err(MeshedError::NoVolume(std::array::from_fn(|axis| if axis < D { middle.x[axis] } else { 0.0 })));
        }
        for (volume, piece) in &simplices {
            let volume = sense * volume;
            for mean in piece.iter().chain([&middle]) {
                let share = volume / (D + 1) as f64;
                if self.points == MeshPoints::Cells {
                    self.particles.volumes[index] += share;
                    self.particles.positions[index] += mean.x * share;
                    continue;
                }
                for node in mean.nodes {
                    if let Some(particle) = self.of_node.get(node) {
                        self.particles.volumes[*particle] += share / mean.nodes.len() as f64;
                    }
                }
            }
        }
        Ok(sense)
    }

    /// Adds the faces of a side on the boundary.
    pub(super) fn side(&mut self, cell: usize, side: &[usize], sense: f64) {
        let mut shares: Vec<(usize, Vector<D>, Vector<D>)> = Vec::new();
        for piece in self.pieces(side) {
            let area = match D {
                1 => {
                    // Away from the middle of the cell: the particle, or the sum of its two nodes.
                    let sign = self.outward(cell, &piece[0].x);
                    Vector::repeat(sign)
                }
                2 => {
                    let along = piece[1].x - piece[0].x;
                    Vector::from_fn(|axis, _| sense * if axis == 0 { along[1] } else { -along[0] })
                }
                _ => {
                    let (a, b) = (piece[1].x - piece[0].x, piece[2].x - piece[0].x);
                    Vector::from_fn(|i, _| {
                        let (j, k) = ((i + 1) % D, (i + 2) % D);
                        0.5 * sense * (a[j] * b[k] - a[k] * b[j])
                    })
                }
            };
            if self.points == MeshPoints::Cells {
                let middle = piece.iter().map(|mean| mean.x).sum::<Vector<D>>() / D as f64;
                shares.push((cell, area, middle));
                continue;
            }
            for mean in &piece {
                for node in mean.nodes {
                    let share = area / (D * mean.nodes.len()) as f64;
                    let Some(particle) = self.of_node.get(node) else { continue };
                    match shares.iter_mut().find(|(held, _, _)| held == particle) {
                        Some((_, sum, _)) => *sum += share,
                        None => shares.push((*particle, share, place(self.mesh, *node))),
                    }
                }
            }
        }
        for (particle, area, point) in shares {
            let size = area.norm();
            if size > 0.0 {
                self.particles.faces.push(Face { particle, normal: area / size, area: size, point, side: None });
            }
        }
    }

    /// Direction out of the body at an end of a line.
    fn outward(&self, cell: usize, end: &Vector<D>) -> f64 {
        let inside = match self.points {
            MeshPoints::Cells => self.particles.positions[cell][0] / self.particles.volumes[cell],
            // Of a line with particles in its nodes, the end is the lowest or the highest.
            MeshPoints::Nodes => {
                let positions = &self.particles.positions;
                positions.iter().map(|x| x[0]).sum::<f64>() / positions.len() as f64
            }
        };
        (end[0] - inside).signum()
    }
}

fn place<const D: usize>(mesh: &Mesh, node: usize) -> Vector<D> {
    Vector::from_fn(|axis, _| mesh.nodes[node][axis % 3])
}
