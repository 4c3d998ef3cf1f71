//! What is measured on the matrices of a case: a static problem and the spectrum.
//!
//! - The free beam bends under the acceleration cos(2πX/L) across it; measured is the work of the load, the compliance.
//! - The free ring expands under an inner pressure; measured is the amplitude of Lamé's exact displacement in it.
//! - Both vibrate freely. A mode is spurious if the energy of what the gradients do not see, that of the hourglass
//!   control for α = 1, outweighs the strain energy that they do see.

use std::f64::consts::TAU;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector, Matrix3, SymmetricEigen, Vector3};
use nicolson_solvers::linear::{LinearSolver, LinearSolverChoice, SparseMatrix, StoredTangent, Symmetry};

use super::case::{Case, Cloud, LENGTH, Matrices, POISSON, RADII};

/// Lowest elastic frequencies that are compared.
const MODES: usize = 3;
/// Rigid motions have no energy: this much less than the stiffest mode.
const RIGID: f64 = 1e-10;
/// Density over stiffness that makes the matrix of a free body definite; the load does no work on rigid motions.
const REGULARISATION: f64 = 1e-6;
/// Modes and rounds of the iteration for references.
const SUBSPACE: usize = 12;
const ROUNDS: usize = 40;

/// What is compared: a size of the static solution, and the lowest elastic frequencies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Values {
    pub response: f64,
    pub frequencies: [f64; MODES],
}

/// What one case with one coefficient of the control gives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Found {
    pub values: Values,
    /// Lowest frequency of a spurious mode, 1/s.
    pub spurious: f64,
}

fn combined(matrices: &Matrices, alpha: f64, shift: f64) -> Vec<f64> {
    let mut values: Vec<f64> =
        matrices.elastic.iter().zip(&matrices.control).map(|(elastic, control)| elastic + alpha * control).collect();
    for (row, mass) in matrices.masses.iter().enumerate() {
        let range = matrices.pattern.stored(row);
        if let Some(place) = matrices.pattern.row(row).iter().position(|column| *column == row) {
            values[range.start + place] += shift * mass;
        }
    }
    values
}

/// A factorised matrix.
struct Factor {
    tangent: StoredTangent,
    solver: Box<dyn LinearSolver>,
}

impl Factor {
    fn new(matrices: &Matrices, alpha: f64, shift: f64) -> Result<Self, String> {
        let values = combined(matrices, alpha, shift);
        let tangent = StoredTangent::new(&Arc::clone(&matrices.pattern), values, Symmetry::Symmetric);
        let mut solver = LinearSolverChoice::ldlt().build();
        solver.prepare(&tangent).map_err(|error| error.to_string())?;
        Ok(Self { tangent, solver })
    }

    fn solve(&mut self, right: &[f64]) -> Result<Vec<f64>, String> {
        let mut solution = vec![0.0; right.len()];
        self.solver.solve(&self.tangent, right, &mut solution, 1e-6).map_err(|error| error.to_string())?;
        Ok(solution)
    }
}

/// The load of a case, without its part on rigid motions, and what the response is measured with.
fn load(case: &Case, matrices: &Matrices) -> (Vec<f64>, Option<Vec<f64>>) {
    let positions = &matrices.setup.particles.positions;
    let masses = &matrices.masses;
    let mut force = vec![0.0; masses.len()];
    let mut exact = None;
    if case.cloud == Cloud::Ring {
        for face in matrices.setup.particles.faces.iter().filter(|face| face.side.is_some_and(|side| !side.upper)) {
            for i in 0..2 {
                force[2 * face.particle + i] -= face.area * face.normal[i];
            }
        }
        let [inner, outer] = RADII.map(|radius| radius * radius);
        let radial = |r: f64| inner / (outer - inner) * (1.0 + POISSON) * ((1.0 - 2.0 * POISSON) * r + outer / r);
        exact = Some(positions.iter().flat_map(|x| [0, 1].map(|i| radial(x.norm()) * x[i] / x.norm())).collect());
    } else {
        for (a, position) in positions.iter().enumerate() {
            force[2 * a + 1] = masses[2 * a] * (TAU * position[0] / LENGTH).cos();
        }
    }
    let rigid = |a: usize, i: usize| match i {
        0 => Vector3::new(1.0, 0.0, -positions[a][1]),
        _ => Vector3::new(0.0, 1.0, positions[a][0]),
    };
    let (mut gram, mut part) = (Matrix3::zeros(), Vector3::zeros());
    for (row, mass) in masses.iter().enumerate() {
        let motion = rigid(row / 2, row % 2);
        gram += motion * motion.transpose() * *mass;
        part += motion * force[row];
    }
    let motion = gram.try_inverse().unwrap_or_default() * part;
    force.iter_mut().enumerate().for_each(|(row, f)| *f -= masses[row] * motion.dot(&rigid(row / 2, row % 2)));
    (force, exact)
}

fn response(case: &Case, matrices: &Matrices, alpha: f64) -> Result<f64, String> {
    let (force, exact) = load(case, matrices);
    let moved = Factor::new(matrices, alpha, REGULARISATION)?.solve(&force)?;
    let product = |left: &[f64], right: &[f64]| -> f64 {
        left.iter().zip(right).zip(&matrices.masses).map(|((x, y), mass)| mass * x * y).sum()
    };
    Ok(match exact {
        Some(exact) => product(&moved, &exact) / product(&exact, &exact),
        None => force.iter().zip(&moved).map(|(f, u)| f * u).sum(),
    })
}

/// Response and spectrum with one coefficient of the control, from all modes.
///
/// # Errors
/// In words.
pub fn measure(case: &Case, matrices: &Matrices, alpha: f64) -> Result<Found, String> {
    let size = matrices.masses.len();
    let values = combined(matrices, alpha, 0.0);
    let mut dense = DMatrix::zeros(size, size);
    for row in 0..size {
        for (&column, entry) in matrices.pattern.row(row).iter().zip(matrices.pattern.stored(row)) {
            dense[(row, column)] = values[entry] / (matrices.masses[row] * matrices.masses[column]).sqrt();
        }
    }
    let modes = SymmetricEigen::new(dense);
    let mut order: Vec<usize> = (0..size).collect();
    order.sort_by(|a, b| modes.eigenvalues[*a].total_cmp(&modes.eigenvalues[*b]));
    let seen = SparseMatrix::new(&matrices.pattern, matrices.elastic.clone());
    let unseen = SparseMatrix::new(&matrices.pattern, matrices.control.clone());
    let largest = modes.eigenvalues.amax();
    let (mut physical, mut spurious) = (Vec::new(), f64::NAN);
    for mode in order {
        let motion: Vec<f64> =
            modes.eigenvectors.column(mode).iter().zip(&matrices.masses).map(|(x, mass)| x / mass.sqrt()).collect();
        let [seen, unseen] = [&seen, &unseen].map(|matrix| {
            let mut force = vec![0.0; size];
            matrix.apply(&motion, &mut force);
            motion.iter().zip(&force).map(|(u, f)| u * f).sum::<f64>()
        });
        let frequency = modes.eigenvalues[mode].max(0.0).sqrt();
        if seen + unseen <= RIGID * largest {
            continue;
        }
        if seen >= unseen {
            physical.push(frequency);
        } else if spurious.is_nan() {
            spurious = frequency;
        }
        if physical.len() >= MODES && !spurious.is_nan() {
            break;
        }
    }
    let frequencies = std::array::from_fn(|i| physical.get(i).copied().unwrap_or(f64::NAN));
    Ok(Found { values: Values { response: response(case, matrices, alpha)?, frequencies }, spurious })
}

/// The same without what is spurious, by an iteration on the lowest modes alone: for fine clouds with control.
fn fine(case: &Case, alpha: f64) -> Result<Values, String> {
    let matrices = case.matrices()?;
    let size = matrices.masses.len();
    let mut factor = Factor::new(&matrices, alpha, 1.0)?;
    let stiffness = SparseMatrix::new(&matrices.pattern, combined(&matrices, alpha, 0.0));
    let masses = DVector::from_column_slice(&matrices.masses);
    let mut noise = nicolson::model::Noise::new(1);
    let mut modes = DMatrix::from_fn(size, SUBSPACE, |_, _| noise.next());
    let mut frequencies = Vec::new();
    for _ in 0..ROUNDS {
        for mut mode in modes.column_iter_mut() {
            let right: Vec<f64> = mode.component_mul(&masses).iter().copied().collect();
            mode.copy_from_slice(&factor.solve(&right)?);
        }
        let weighted = DMatrix::from_fn(size, SUBSPACE, |i, j| masses[i] * modes[(i, j)]);
        let gram = modes.tr_mul(&weighted).cholesky().ok_or("the modes became dependent")?;
        let basis = gram.l().transpose().try_inverse().ok_or("the modes became dependent")?;
        modes *= basis;
        let mut forces = DMatrix::zeros(size, SUBSPACE);
        for (mode, mut force) in modes.column_iter().zip(forces.column_iter_mut()) {
            stiffness.apply(mode.as_slice(), force.as_mut_slice());
        }
        let small = modes.tr_mul(&forces);
        let turned = SymmetricEigen::new((&small + small.transpose()) * 0.5);
        modes *= &turned.eigenvectors;
        frequencies = turned.eigenvalues.iter().map(|square| square.max(0.0).sqrt()).collect();
    }
    frequencies.sort_by(f64::total_cmp);
    // After three rigid motions.
    let frequencies = std::array::from_fn(|i| frequencies.get(i + 3).copied().unwrap_or(f64::NAN));
    Ok(Values { response: response(case, &matrices, alpha)?, frequencies })
}

/// Values for ever finer clouds, from `cells` and twice as many, and how much the finer one misses them by: balanced
/// weights are of second order. The ring has an exact response.
///
/// # Errors
/// In words.
pub fn reference(cloud: Cloud, cells: usize) -> Result<(Values, f64), String> {
    let smoothing = if cloud == Cloud::Ring { 1.2 } else { 1.0 };
    let case = |cells| Case { cloud, layout: "vertex", kernel: "cubic_spline", smoothing, weights: "balanced", cells };
    let [coarse, finer] = [cells, 2 * cells].map(|cells| fine(&case(cells), 3.0));
    let (coarse, finer) = (coarse?, finer?);
    let limit = |coarse: f64, finer: f64| finer + (finer - coarse) / 3.0;
    let mut values = Values {
        response: limit(coarse.response, finer.response),
        frequencies: std::array::from_fn(|i| limit(coarse.frequencies[i], finer.frequencies[i])),
    };
    let pairs = values.frequencies.iter().zip(&finer.frequencies).chain([(&values.response, &finer.response)]);
    let missed = pairs.map(|(limit, finer)| (finer / limit - 1.0).abs()).fold(0.0, f64::max);
    if cloud == Cloud::Ring {
        values.response = 1.0;
    }
    Ok((values, missed))
}
