//! What multigrid asks of the tangent: where the unknowns are, and `Pᵀ A P` for tent functions.
//!
//! With the gradient `γ_i = Σ_b N_i(X_b) g_cb` of every tent at every particle, a sum over particles as in the weak form:
//!
//! ```text
//! (Pᵀ A P)_ij = Σ_c m_c N_i N_j + s² γ_i·A_c·γ_j + s γ_i·C_c·γ_j + s² Σ_b ½ k_cb e_i e_j,    e_i = γ_i·X_cb − N_i(X_b) + N_i(X_c)
//! ```
//!
//! with the tangents A_c of the stresses, C_c of the viscosities, and the hourglass control. Upwinding is left out: what
//! it adds is small against the rest wherever a step is long.

use nicolson_solvers::linear::{CoarseMatrix, Geometry, Tents};
use rayon::prelude::*;

use super::{Model, Unknowns};
use crate::tensor::{Tensor, Tensor4, Vector, add4, outer};

/// Cells whose sums are held at the same time.
const BATCH: usize = 64;

/// Dense sums over the particles of one cell, between the tents that they see.
struct CellSums {
    nodes: Vec<u32>,
    /// Blocks (i, j) by rows for `i ≥ j`.
    blocks: Vec<f64>,
}

impl CellSums {
    fn add_to(&self, coarse: &mut CoarseMatrix) {
        let d = coarse.dimension();
        let mut rest = &self.blocks[..];
        for (i, &row) in self.nodes.iter().enumerate() {
            for &column in &self.nodes[..=i] {
                let (block, tail) = rest.split_at(d * d);
                rest = tail;
                if block.iter().all(|&value| value == 0.0) {
                    continue;
                }
                let target = coarse.block_mut(row as usize, column as usize);
                target.iter_mut().zip(block).for_each(|(t, b)| *t += b);
                if row != column {
                    let target = coarse.block_mut(column as usize, row as usize);
                    (0..d * d).for_each(|k| target[k] += block[k % d * d + k / d]);
                }
            }
        }
    }

    /// Where the block of two tents starts, `i ≥ j`.
    fn start(i: usize, j: usize, size: usize) -> usize {
        (i * (i + 1) / 2 + j) * size
    }
}

/// Tents at one particle: gradients and values for every component, zero where that is held.
struct Local<const D: usize> {
    active: Vec<usize>,
    gradients: Vec<[Vector<D>; D]>,
    values: Vec<[f64; D]>,
}

impl<const D: usize> Local<D> {
    fn new(tents: usize) -> Self {
        Self { active: Vec::new(), gradients: vec![[Vector::zeros(); D]; tents], values: vec![[0.0; D]; tents] }
    }
}

impl<const D: usize> Model<D> {
    /// Places of the unknowns, if they are velocities only.
    pub(super) fn unknown_places(&self) -> Option<Geometry> {
        if self.unknowns.kind() != Unknowns::Velocity {
            return None;
        }
        let coordinates = |x: &Vector<D>| crate::tensor::coordinates(x);
        let own = |a: usize| {
            std::array::from_fn(|i| {
                let unknown = if i < D { self.unknowns.velocity(a, i) } else { None };
                unknown.map_or(u32::MAX, |unknown| unknown as u32)
            })
        };
        Some(Geometry {
            dimension: D,
            positions: self.setup.particles.positions.iter().map(coordinates).collect(),
            unknowns: (0..self.particles()).map(own).collect(),
            parts: self.setup.bodies.iter().map(|body| (body.particles.clone(), body.spacing)).collect(),
        })
    }

    /// Adds `Pᵀ A P`, cell by cell in a fixed order.
    pub(super) fn project_onto(&self, tents: &Tents, coarse: &mut CoarseMatrix) -> bool {
        if self.unknowns.kind() != Unknowns::Velocity || tents.points() != self.particles() {
            return false;
        }
        let (order, starts) = tents.cells();
        let cells = starts.len() - 1;
        for first in (0..cells).step_by(BATCH) {
            let sums: Vec<CellSums> = (first..(first + BATCH).min(cells))
                .into_par_iter()
                .map(|cell| self.project_cell(tents, &order[starts[cell]..starts[cell + 1]]))
                .collect();
            sums.iter().for_each(|sums| sums.add_to(coarse));
        }
        true
    }

    fn project_cell(&self, tents: &Tents, particles: &[u32]) -> CellSums {
        let near = &self.gradient.neighbourhood;
        let mut places = vec![u32::MAX; tents.nodes()];
        let mut nodes = Vec::new();
        for &b in particles.iter().flat_map(|&c| near.of(c as usize)) {
            for (node, _) in tents.at(b as usize).iter() {
                if places[node] == u32::MAX {
                    places[node] = nodes.len() as u32;
                    nodes.push(node as u32);
                }
            }
        }
        let count = nodes.len();
        let mut sums = CellSums { nodes, blocks: vec![0.0; count * (count + 1) / 2 * D * D] };
        let mut local = Local::<D>::new(count);
        for &c in particles {
            let c = c as usize;
            self.tents_at(c, tents, &places, &mut local);
            self.project_stress(c, &local, &mut sums);
            if !self.linearisation.at_rest {
                self.project_mass(c, &local, &mut sums);
            }
            self.project_hourglass(c, tents, &places, &local, &mut sums);
        }
        sums
    }

    /// Tents and their gradients at particle c.
    fn tents_at(&self, c: usize, tents: &Tents, places: &[u32], local: &mut Local<D>) {
        for &i in &local.active {
            local.gradients[i] = [Vector::zeros(); D];
            local.values[i] = [0.0; D];
        }
        local.active.clear();
        for entry in self.gradient.neighbourhood.row(c) {
            let b = self.gradient.neighbourhood.neighbour(entry);
            let weight = self.gradient.weights.at(c, entry);
            for (node, value) in tents.at(b).iter() {
                let i = places[node] as usize;
                if !local.active.contains(&i) {
                    local.active.push(i);
                }
                for k in (0..D).filter(|&k| tents.is_free(b, k)) {
                    local.gradients[i][k] += weight * value;
                    if b == c {
                        local.values[i][k] = value;
                    }
                }
            }
        }
        local.active.sort_unstable();
    }

    /// `s² A_c + s C_c`, its symmetric part.
    fn scaled_tangent(&self, c: usize) -> Tensor4<D> {
        let s = self.linearisation.shift;
        let mut sum = [[Tensor::zeros(); D]; D];
        add4(&mut sum, &self.linearisation.stress.at(c), s * s);
        if let Some(viscous) = self.linearisation.viscous.get(c).filter(|_| !self.linearisation.at_rest) {
            add4(&mut sum, viscous, s);
        }
        std::array::from_fn(|i| {
            std::array::from_fn(|j| Tensor::from_fn(|k, l| 0.5 * (sum[i][j][(k, l)] + sum[k][l][(i, j)])))
        })
    }

    fn project_stress(&self, c: usize, local: &Local<D>, sums: &mut CellSums) {
        let tangent = self.scaled_tangent(c);
        for (position, &j) in local.active.iter().enumerate() {
            // Stress, row m, by a unit of component k of tent j.
            let stress: [[Vector<D>; D]; D] = std::array::from_fn(|k| {
                let gradient = &local.gradients[j][k];
                std::array::from_fn(|m| {
                    Vector::from_fn(|n, _| (0..D).map(|l| tangent[m][n][(k, l)] * gradient[l]).sum())
                })
            });
            for &i in &local.active[position..] {
                let start = CellSums::start(i, j, D * D);
                let block = &mut sums.blocks[start..start + D * D];
                for m in 0..D {
                    let gradient = &local.gradients[i][m];
                    for k in 0..D {
                        block[m * D + k] += gradient.dot(&stress[k][m]);
                    }
                }
            }
        }
    }

    fn project_mass(&self, c: usize, local: &Local<D>, sums: &mut CellSums) {
        let mass = self.masses[c];
        let own = |i: &&usize| local.values[**i].iter().any(|&value| value != 0.0);
        for (position, &j) in local.active.iter().enumerate().filter(|(_, j)| own(j)) {
            for &i in local.active[position..].iter().filter(own) {
                let start = CellSums::start(i, j, D * D);
                for k in 0..D {
                    sums.blocks[start + k * D + k] += mass * local.values[i][k] * local.values[j][k];
                }
            }
        }
    }

    fn project_hourglass(&self, c: usize, tents: &Tents, places: &[u32], local: &Local<D>, sums: &mut CellSums) {
        let Some(control) = self.active_hourglass() else { return };
        let near = &self.gradient.neighbourhood;
        let factor = 0.5 * self.linearisation.shift.powi(2);
        let (mut total, mut first, mut second) = (0.0, Vector::<D>::zeros(), Tensor::<D>::zeros());
        // Σ k N_i and Σ k N_i X, per component.
        let mut values = vec![[0.0; D]; local.active.len()];
        let mut moments = vec![[Vector::<D>::zeros(); D]; local.active.len()];
        for (b, k, separation) in control.pairs(c, near).filter(|(_, k, _)| *k != 0.0) {
            total += k;
            first += separation * k;
            second += outer(&separation, &(separation * k));
            let around = tents.at(b);
            for (node, value) in around.iter() {
                let i = places[node] as usize;
                let Ok(position) = local.active.binary_search(&i) else { continue };
                for component in (0..D).filter(|&component| tents.is_free(b, component)) {
                    values[position][component] += k * value;
                    moments[position][component] += separation * (k * value);
                }
                for (other, also) in around.iter() {
                    let j = places[other] as usize;
                    if j <= i {
                        let start = CellSums::start(i, j, D * D);
                        for component in (0..D).filter(|&component| tents.is_free(b, component)) {
                            sums.blocks[start + component * D + component] += factor * k * value * also;
                        }
                    }
                }
            }
        }
        if total == 0.0 {
            return;
        }
        for (q, &j) in local.active.iter().enumerate() {
            for (p, &i) in local.active.iter().enumerate().skip(q) {
                let start = CellSums::start(i, j, D * D);
                for k in 0..D {
                    let (left, right) = (&local.gradients[i][k], &local.gradients[j][k]);
                    let (own, other) = (local.values[i][k], local.values[j][k]);
                    let sum = left.dot(&(second * right)) - left.dot(&moments[q][k]) - right.dot(&moments[p][k])
                        + left.dot(&first) * other
                        + right.dot(&first) * own
                        - values[p][k] * other
                        - values[q][k] * own
                        + total * own * other;
                    sums.blocks[start + k * D + k] += factor * sum;
                }
            }
        }
    }
}
