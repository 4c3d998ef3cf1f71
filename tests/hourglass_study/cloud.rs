//! Boxes of particles with their elastic stiffness and the forms of the control as dense matrices.

use nalgebra::{DMatrix, DVector};
use nicolson::discretisation::Gradient;
use nicolson::geometry::{BoxLattice, Layout};
use nicolson::setup::*;
use nicolson::stabilisation::Hourglass;

use super::support::{linear, setup};

/// Forms of the control.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Form {
    Own,
    Average,
    Force,
}

/// A box of particles with spacing `1/across` in the last direction.
pub struct Cloud<const D: usize> {
    pub setup: Setup<D>,
    pub gradient: Gradient<D>,
}

impl<const D: usize> Cloud<D> {
    pub fn new(length: f64, across: usize, smoothing: f64, weights: WeightChoice) -> Self {
        let mut upper = [1.0; D];
        upper[0] = length;
        let counts = std::array::from_fn(|i| (upper[i] * across as f64).round() as usize + 1);
        let lattice = BoxLattice::with_counts([0.0; D], upper, counts, Layout::Vertex).expect("a lattice");
        let mut setup = setup(lattice.particles(), 1.0 / across as f64, linear());
        setup.bodies[0].smoothing = smoothing;
        setup.bodies[0].weights = weights;
        setup.bodies[0].hourglass = Some(1.0);
        let gradient = Gradient::build(&setup.bodies, &setup.particles).expect("a gradient");
        Self { setup, gradient }
    }

    pub fn size(&self) -> usize {
        self.setup.particles.positions.len()
    }

    pub fn masses(&self) -> DVector<f64> {
        let volumes = &self.setup.particles.volumes;
        DVector::from_iterator(self.size() * D, (0..self.size() * D).map(|i| volumes[i % self.size()]))
    }

    /// `G_i` as matrices.
    fn gradients(&self) -> [DMatrix<f64>; D] {
        std::array::from_fn(|i| {
            let mut matrix = DMatrix::zeros(self.size(), self.size());
            for a in 0..self.size() {
                for entry in self.gradient.neighbourhood.row(a) {
                    matrix[(a, self.gradient.neighbourhood.neighbour(entry))] = self.gradient.weights.at(a, entry)[i];
                }
            }
            matrix
        })
    }

    /// Stiffness of linear elasticity, component after component.
    pub fn elastic(&self, lambda: f64, mu: f64) -> DMatrix<f64> {
        let n = self.size();
        let gradients = self.gradients();
        let volumes = DMatrix::from_diagonal(&DVector::from_column_slice(&self.setup.particles.volumes));
        let product = |i: usize, j: usize| gradients[i].transpose() * &volumes * &gradients[j];
        let products: Vec<DMatrix<f64>> = (0..D * D).map(|ij| product(ij / D, ij % D)).collect();
        let mut stiffness = DMatrix::zeros(n * D, n * D);
        for i in 0..D {
            for j in 0..D {
                let mut block = &products[i * D + j] * lambda + &products[j * D + i] * mu;
                if i == j {
                    (0..D).for_each(|k| block += &products[k * D + k] * mu);
                }
                stiffness.view_mut((i * n, j * n), (n, n)).copy_from(&block);
            }
        }
        stiffness
    }

    /// Stiffness of a form of the control for α = 1 and the given modulus.
    pub fn control(&self, form: Form, modulus: f64) -> DMatrix<f64> {
        let n = self.size();
        let moduli = vec![modulus; n];
        let (near, particles) = (&self.gradient.neighbourhood, &self.setup.particles);
        let table = Hourglass::build(&self.setup.bodies, particles, near, &moduli, &particles.volumes).expect("on");
        let mut stiffness = DMatrix::zeros(n * D, n * D);
        for a in 0..n {
            for (b, k, separation) in table.pairs(a, near).filter(|(b, _, _)| *b != a) {
                // Coefficients of the miss e in the displacements of one component, and of x_b − x_a in it.
                let mut miss: Vec<(usize, f64)> = vec![(a, 1.0), (b, -1.0)];
                let sides: &[(usize, f64)] = if form == Form::Own { &[(a, 1.0)] } else { &[(a, 0.5), (b, 0.5)] };
                for &(c, share) in sides {
                    for entry in near.row(c) {
                        let along = self.gradient.weights.at(c, entry).dot(&separation);
                        miss.push((near.neighbour(entry), share * along));
                    }
                }
                let normal = separation / separation.norm();
                let pair = [(a, 1.0), (b, -1.0)];
                // Every unordered pair comes twice.
                let k = 0.5 * k;
                for i in 0..D {
                    for j in 0..D {
                        let (rows, factor) = match form {
                            Form::Force => (&pair[..], k * normal[i] * normal[j]),
                            _ if i == j => (&miss[..], k),
                            _ => continue,
                        };
                        for &(row, x) in rows {
                            for &(column, y) in &miss {
                                stiffness[(i * n + row, j * n + column)] += factor * x * y;
                            }
                        }
                    }
                }
            }
        }
        stiffness
    }

    /// Unknowns that remain if the particles at `X = 0` are held.
    pub fn free(&self) -> Vec<usize> {
        let n = self.size();
        (0..n * D).filter(|i| self.setup.particles.positions[i % n][0] > 1e-9).collect()
    }
}

pub fn restrict(matrix: &DMatrix<f64>, free: &[usize]) -> DMatrix<f64> {
    matrix.select_rows(free).select_columns(free)
}
