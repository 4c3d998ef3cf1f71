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

mod builder;

use std::collections::{BTreeMap, HashMap};

use super::msh::{Element, Mesh};
use crate::setup::Particles;
use crate::tensor::coordinates;
use builder::{Builder, sides};

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

#[cfg(test)]
mod tests {
    use super::super::msh::{Form, read_msh, tests::OLD};
    use super::*;
    use crate::tensor::{Tensor, Vector, outer};

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
