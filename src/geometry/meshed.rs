//! Particles from the cells of a mesh, or from its nodes.
//!
//! Every cell is divided into simplices around its middle and those of its quadrilaterals. With particles in the *cells*,
//! a particle is the volume and centroid of one. With particles in the *nodes*, every simplex is shared by its corners, and
//! a middle by the nodes around it: `V_a = ∫ φ_a dV` with piecewise linear φ, so that
//!
//! ```text
//! Σ_a V_a = |Ω|      Σ_a V_a X_a = ∫ X dV      Σ_f a_f N_f = 0      Σ_f a_f N_f ⊗ X_f = |Ω| I
//! ```
//!
//! hold for both. Nodes lie *on* the boundary, where clamps are; cells do not.

use std::collections::{BTreeMap, HashMap};

use super::msh::{Element, Form, Mesh};
use crate::setup::{Face, Particles};
use crate::tensor::{Tensor, Vector, coordinates, determinant};

/// Which points of a mesh become particles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum MeshPoints {
    /// The centroids of the cells.
    #[default]
    Cells,
    /// The corners of the cells.
    Nodes,
}

/// Particles and pieces of boundary with a common name.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Group {
    /// Indices of particles, ascending.
    pub particles: Vec<usize>,
    /// Indices of faces, ascending; of groups on the boundary.
    pub faces: Vec<usize>,
}

/// A mesh as particles.
#[derive(Debug, Clone, PartialEq)]
pub struct Meshed<const D: usize> {
    /// Positions, volumes and faces.
    pub particles: Particles<D>,
    /// Edge of a cube with the average volume, m.
    pub spacing: f64,
    /// Physical groups by name, or by number where they have none.
    pub groups: BTreeMap<String, Group>,
    /// Cells that were taken.
    pub cells: usize,
}

/// Why a mesh cannot become particles.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MeshedError {
    /// It has no cells of that dimension.
    #[error("the mesh has no {0}-dimensional cells")]
    NoCells(usize),
    /// It has none in the wanted group.
    #[error("the mesh has no {0}-dimensional group `{1}`; it has {2}")]
    NoGroup(usize, String, String),
    /// A cell has no volume.
    #[error("the cell around {0:?} has no volume")]
    NoVolume([f64; 3]),
    /// It leaves the plane or the line.
    #[error("the mesh leaves the {0}-dimensional space: a node lies at {1:?}")]
    OffPlane(usize, [f64; 3]),
}

/// A corner of a simplex: the mean of some nodes.
struct Mean<'a, const D: usize> {
    x: Vector<D>,
    nodes: &'a [usize],
}

/// Sides of a form, seen from outside counterclockwise, as places in its list of nodes.
fn sides(form: Form) -> &'static [&'static [usize]] {
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

/// Makes particles of the cells of dimension `D`; with `group`, of those that belong to it.
///
/// # Errors
/// [`MeshedError`].
pub fn mesh_particles<const D: usize>(
    mesh: &Mesh,
    points: MeshPoints,
    group: Option<&str>,
) -> Result<Meshed<D>, MeshedError> {
    let name = |dimension: usize, number: i64| {
        mesh.names.get(&(dimension, number)).cloned().unwrap_or_else(|| number.to_string())
    };
    let belongs = |element: &Element, wanted: &str| element.groups.iter().any(|number| name(D, *number) == wanted);
    let of_dimension =
        |dimension: usize| mesh.elements.iter().filter(move |element| element.form.size().0 == dimension);
    let cells: Vec<&Element> = of_dimension(D).filter(|e| group.is_none_or(|wanted| belongs(e, wanted))).collect();
    if cells.is_empty() {
        let mut names: Vec<String> = of_dimension(D).flat_map(|e| e.groups.iter().map(|n| name(D, *n))).collect();
        names.sort_unstable();
        names.dedup();
        let known = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
        return Err(group.map_or(MeshedError::NoCells(D), |group| MeshedError::NoGroup(D, group.to_owned(), known)));
    }
    let size = mesh.nodes.iter().map(|x| x.amax()).fold(0.0, f64::max);
    let off = cells.iter().flat_map(|cell| &cell.nodes).map(|node| mesh.nodes[*node]);
    if let Some(off) = off.clone().find(|x| (D..3).any(|axis| x[axis].abs() > 1e-9 * size)) {
        return Err(MeshedError::OffPlane(D, off.into()));
    }
    let mut builder = Builder::<D>::new(mesh, &cells, points);
    let mut signs = Vec::with_capacity(cells.len());
    for (index, cell) in cells.iter().enumerate() {
        signs.push(builder.cell(index, cell)?);
    }
    // Sides that one cell alone has are the boundary.
    let mut count: HashMap<Vec<usize>, u32> = HashMap::new();
    for (_, _, key) in all_sides(&cells) {
        *count.entry(key).or_default() += 1;
    }
    let mut faces_of: HashMap<Vec<usize>, Vec<usize>> = HashMap::new();
    for (cell, side, key) in all_sides(&cells) {
        if count.get(&key) == Some(&1) {
            let first = builder.particles.faces.len();
            builder.side(cell, &side, signs[cell]);
            faces_of.insert(key, (first..builder.particles.faces.len()).collect());
        }
    }
    let mut groups: BTreeMap<String, Group> = BTreeMap::new();
    for (index, cell) in cells.iter().enumerate() {
        for number in &cell.groups {
            groups.entry(name(D, *number)).or_default().particles.extend(builder.of_cell(index, &cell.nodes));
        }
    }
    for element in mesh.elements.iter().filter(|element| element.form.size().0 < D) {
        for number in &element.groups {
            let group = groups.entry(name(element.form.size().0, *number)).or_default();
            let faces = faces_of.get(&sorted(element.nodes.iter().copied()));
            if points == MeshPoints::Nodes {
                group.particles.extend(element.nodes.iter().filter_map(|node| builder.of_node.get(node)));
            } else {
                group.particles.extend(faces.into_iter().flatten().map(|face| builder.particles.faces[*face].particle));
            }
            group.faces.extend(faces.into_iter().flatten());
        }
    }
    for group in groups.values_mut() {
        for list in [&mut group.particles, &mut group.faces] {
            list.sort_unstable();
            list.dedup();
        }
    }
    let mut particles = builder.particles;
    // A cell that is turned inside out somewhere may take more from a node than the others give.
    if let Some(at) = particles.volumes.iter().position(|volume| !(volume.is_finite() && *volume > 0.0)) {
        return Err(MeshedError::NoVolume(coordinates(&particles.positions[at])));
    }
    let volume: f64 = particles.volumes.iter().sum();
    let kernel_volume = volume / particles.volumes.len() as f64;
    particles.kernel_volumes = vec![kernel_volume; particles.volumes.len()];
    if points == MeshPoints::Cells {
        particles.positions.iter_mut().zip(&particles.volumes).for_each(|(x, v)| *x /= *v);
    }
    Ok(Meshed { particles, spacing: kernel_volume.powf(1.0 / D as f64), groups, cells: cells.len() })
}

fn sorted(nodes: impl Iterator<Item = usize>) -> Vec<usize> {
    let mut nodes: Vec<usize> = nodes.collect();
    nodes.sort_unstable();
    nodes
}

/// Sides of all cells: cell, nodes in order, nodes sorted.
fn all_sides<'a>(cells: &'a [&'a Element]) -> impl Iterator<Item = (usize, Vec<usize>, Vec<usize>)> + 'a {
    cells.iter().enumerate().flat_map(|(index, cell)| {
        sides(cell.form).iter().map(move |side| {
            let nodes: Vec<usize> = side.iter().map(|at| cell.nodes[*at]).collect();
            (index, nodes.clone(), sorted(nodes.into_iter()))
        })
    })
}

struct Builder<'a, const D: usize> {
    mesh: &'a Mesh,
    points: MeshPoints,
    /// In cell mode, positions are moments until the end.
    particles: Particles<D>,
    of_node: HashMap<usize, usize>,
}

impl<'a, const D: usize> Builder<'a, D> {
    fn new(mesh: &'a Mesh, cells: &[&Element], points: MeshPoints) -> Self {
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

    fn of_cell<'b>(&'b self, index: usize, nodes: &'b [usize]) -> Vec<usize> {
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
    fn cell(&mut self, index: usize, cell: &Element) -> Result<f64, MeshedError> {
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
    fn side(&mut self, cell: usize, side: &[usize], sense: f64) {
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

#[cfg(test)]
mod tests {
    use super::super::msh::{read_msh, tests::OLD};
    use super::*;
    use crate::tensor::outer;

    fn consistent<const D: usize>(mesh: &Mesh, points: MeshPoints, volume: f64, centre: Vector<D>) -> Meshed<D> {
        let meshed = mesh_particles::<D>(mesh, points, None).unwrap();
        let particles = &meshed.particles;
        let found: f64 = particles.volumes.iter().sum();
        let moment: Vector<D> = particles.positions.iter().zip(&particles.volumes).map(|(x, v)| x * *v).sum();
        assert!((found - volume).abs() < 1e-14, "{found} {volume}");
        assert!((moment / found - centre).norm() < 1e-14, "{moment}");
        let (mut open, mut enclosed) = (Vector::<D>::zeros(), Tensor::<D>::zeros());
        for face in &particles.faces {
            open += face.normal * face.area;
            enclosed += outer(&face.normal, &face.point) * face.area;
        }
        assert!(open.norm() < 1e-14 && (enclosed - Tensor::identity() * found).norm() < 1e-13, "{enclosed}");
        meshed
    }

    fn mesh(nodes: &[[f64; 3]], elements: &[(Form, &[usize])]) -> Mesh {
        Mesh {
            nodes: nodes.iter().map(|x| (*x).into()).collect(),
            elements: elements
                .iter()
                .map(|(form, nodes)| Element { form: *form, nodes: nodes.to_vec(), groups: vec![1] })
                .collect(),
            names: HashMap::new(),
        }
    }

    #[test]
    fn volumes_moments_and_faces_agree_for_every_form() {
        let plate = read_msh(OLD.as_bytes()).unwrap();
        let cells = consistent::<2>(&plate, MeshPoints::Cells, 1.0, [0.5, 0.5].into());
        assert_eq!((cells.particles.positions.len(), cells.particles.faces.len()), (2, 4));
        let clamp = &cells.groups["clamp ä"];
        assert_eq!((clamp.particles.as_slice(), clamp.faces.len()), ([1].as_slice(), 1));
        let nodes = consistent::<2>(&plate, MeshPoints::Nodes, 1.0, [0.5, 0.5].into());
        assert_eq!((nodes.particles.positions.len(), nodes.particles.faces.len()), (4, 8));
        assert_eq!(nodes.groups["clamp ä"].particles, [0, 3]);
        assert_eq!(nodes.groups["plate"].particles, [0, 1, 2, 3]);

        // A prism on a hexahedron with warped sides, and a pyramid on it; a tetrahedron turned inside out.
        let warped = mesh(
            &[
                [0.0, 0.0, 0.0],
                [1.0, 0.0, 0.1],
                [1.1, 1.0, 0.0],
                [0.0, 1.0, 0.0],
                [0.0, 0.0, 1.0],
                [1.0, 0.0, 1.0],
                [1.0, 1.0, 1.2],
                [0.0, 1.0, 1.0],
                [0.5, 0.5, 2.0],
                [0.5, -1.0, 0.0],
                [0.5, -1.0, 1.0],
                [3.0, 0.5, 0.5],
            ],
            &[
                (Form::Hexahedron, &[0, 1, 2, 3, 4, 5, 6, 7]),
                (Form::Pyramid, &[4, 5, 6, 7, 8]),
                (Form::Prism, &[0, 9, 1, 4, 10, 5]),
            ],
        );
        let cells = mesh_particles::<3>(&warped, MeshPoints::Cells, None).unwrap().particles;
        let volume: f64 = cells.volumes.iter().sum();
        let moment: Vector<3> = cells.positions.iter().zip(&cells.volumes).map(|(x, v)| x * *v).sum();
        consistent::<3>(&warped, MeshPoints::Cells, volume, moment / volume);
        consistent::<3>(&warped, MeshPoints::Nodes, volume, moment / volume);
        let tetrahedra = mesh(
            &[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1.0, 1.0]],
            &[(Form::Tetrahedron, &[0, 1, 2, 3]), (Form::Tetrahedron, &[2, 1, 3, 4])],
        );
        let middle = Vector::from([0.25 / 6.0 + 0.5 / 3.0; 3]) / 0.5;
        consistent::<3>(&tetrahedra, MeshPoints::Cells, 0.5, middle);
        consistent::<3>(&tetrahedra, MeshPoints::Nodes, 0.5, middle);
        let line = mesh(&[[0.0; 3], [1.0, 0.0, 0.0], [3.0, 0.0, 0.0]], &[(Form::Line, &[0, 1]), (Form::Line, &[2, 1])]);
        consistent::<1>(&line, MeshPoints::Cells, 3.0, [1.5].into());
        consistent::<1>(&line, MeshPoints::Nodes, 3.0, [1.5].into());
    }

    #[test]
    fn impossible_meshes_are_refused() {
        let plate = read_msh(OLD.as_bytes()).unwrap();
        let refused = |mesh: &Mesh, group| mesh_particles::<2>(mesh, MeshPoints::Cells, group).unwrap_err().to_string();
        assert_eq!(mesh_particles::<3>(&plate, MeshPoints::Cells, None).unwrap_err(), MeshedError::NoCells(3));
        assert!(refused(&plate, Some("plat")).contains("it has plate"));
        let flat = mesh(&[[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]], &[(Form::Triangle, &[0, 1, 2])]);
        assert!(refused(&flat, None).contains("no volume"));
        let tilted = mesh(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 1.0]], &[(Form::Triangle, &[0, 1, 2])]);
        assert!(refused(&tilted, None).contains("leaves the 2-dimensional space"));
    }
}
