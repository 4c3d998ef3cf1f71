//! Balanced weights without equations: those of the cells whose corners the particles are.
//!
//! With the multilinear shape functions `φ` of the cells of a body, the weights
//!
//! ```text
//! Q_ab = ∫ φ_a ∇φ_b dV
//! ```
//!
//! meet the conditions by Gauss's theorem, because `V_a = ∫ φ_a dV`: `Q 1 = 0`, `Q X_J = V δ_J`, `Qᵀ 1 = ∫ φ N dA`,
//! `Qᵀ X_J = ∫ φ X_J N dA − V δ_J`: the traction of a linear stress comes out as its integral with the shape function,
//! which is its value at the particle times the area where the boundary is straight and evenly divided.
//!
//! They are no strangers to the kernel: across the derivative's direction, the cubic spline with h = Δx has
//! `0.163, 0.673, 0.163` on a square lattice, cells have `1/6, 2/3, 1/6`; on a cubic one `0.468, 4 × 0.114, 4 × 0.019` and
//! `0.444, 4 × 0.111, 4 × 0.028`. Errors differ in the third digit, except in bending, where those of cells fall with the
//! second order from the coarsest lattice on (`tests/solids.rs`, CSM1). They cost one pass over the cells.

use rayon::prelude::*;

use super::super::Neighbourhood;
use super::constraints::Constraints;
use super::failure::Failure;
use crate::geometry::gradient_products;
use crate::setup::{Body, Particles};
use crate::tensor::{Tensor, Vector};

/// Cells at a time, so that their integrals can be shared out.
const CHUNK: usize = 4096;

/// Cells of a body, by particles counted through all bodies.
pub(in super::super) fn of_body<'a, const D: usize>(
    body: &Body,
    particles: &'a Particles<D>,
) -> impl Iterator<Item = &'a [u32]> {
    let range = body.particles.clone();
    particles.cells.chunks_exact(1 << D).filter(move |cell| range.contains(&(cell[0] as usize)))
}

/// `Q_ab` of every entry of a body, and the largest residual of a condition in units of a particle's face.
///
/// # Errors
/// If there are no cells, if one is wider than the neighbourhood, or if volumes and faces are not those of the cells.
pub(super) fn weights<const D: usize>(
    body: &Body,
    particles: &Particles<D>,
    neighbourhood: &Neighbourhood,
    constraints: &Constraints<'_, D>,
    entries: usize,
) -> Result<(Vec<Vector<D>>, f64), Failure> {
    let first = neighbourhood.row(body.particles.start).start;
    let cells: Vec<&[u32]> = of_body(body, particles).collect();
    if cells.is_empty() {
        return Err(Failure::NoCells("its particles are not the corners of cells"));
    }
    let corners =
        |cell: &&[u32]| cell.iter().map(|corner| particles.positions[*corner as usize]).collect::<Vec<Vector<D>>>();
    let mut weights = vec![Vector::zeros(); entries];
    for chunk in cells.chunks(CHUNK) {
        // Integrals side by side, sums in the order of the cells.
        let products: Vec<Vec<Vector<D>>> = chunk.par_iter().map(|cell| gradient_products(&corners(cell))).collect();
        for (cell, products) in chunk.iter().zip(&products) {
            for (i, &a) in cell.iter().enumerate() {
                let start = neighbourhood.row(a as usize).start - first;
                for (j, b) in cell.iter().enumerate() {
                    let Ok(place) = neighbourhood.of(a as usize).binary_search(b) else {
                        return Err(Failure::NoCells("a cell is wider than the support of the kernel"));
                    };
                    weights[start + place] += products[i * cell.len() + j];
                }
            }
        }
    }
    let mut residuals = constraints.residuals(&weights);
    for face in particles.faces.iter().filter(|face| body.particles.contains(&face.particle)) {
        // Their linear stress is that of the shape functions, see above.
        residuals[face.particle - body.particles.start][1].linear = Tensor::zeros();
    }
    let (_, residual) = super::worst(&residuals);
    if residual <= constraints.tolerance() {
        Ok((weights, residual / constraints.scale()))
    } else {
        Err(Failure::NoCells("volumes or faces are not those of its cells"))
    }
}
