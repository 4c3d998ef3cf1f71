//! Diagonal blocks of the tangent without its pattern: one sweep where velocities are the only unknowns.

use rayon::prelude::*;

use super::evaluation::GRAIN;
use super::{Model, Unknowns};
use crate::tensor::{Tensor, outer};

impl<const D: usize> Model<D> {
    /// Whether [`Self::write_diagonal`] knows the blocks.
    pub(super) fn knows_diagonal(&self) -> bool {
        self.unknowns.kind() == Unknowns::Velocity
    }

    /// Blocks of the particles one after the other, by rows. What upwinding adds through wave speeds and
    /// reconstruction is left out.
    pub(super) fn write_diagonal(&self, values: &mut [f64]) {
        let spread = self.hourglass_spread();
        let blocks: Vec<Tensor<D>> = (0..self.particles())
            .into_par_iter()
            .with_min_len(GRAIN)
            .map(|a| if self.unknowns.of(a).is_empty() { Tensor::zeros() } else { self.diagonal_block(a, &spread) })
            .collect();
        let mut out = values.iter_mut();
        for (a, block) in blocks.iter().enumerate() {
            let free = |i: &usize| self.unknowns.velocity(a, *i).is_some();
            for i in (0..D).filter(free) {
                for (k, out) in (0..D).filter(free).zip(out.by_ref()) {
                    *out = block[(i, k)];
                }
            }
        }
    }

    /// `Σ_b ½ k_cb X_cb ⊗ X_cb` of every particle; empty without hourglass control.
    fn hourglass_spread(&self) -> Vec<Tensor<D>> {
        let Some(control) = self.active_hourglass() else { return Vec::new() };
        let near = &self.gradient.neighbourhood;
        let sum = |c: usize| control.pairs(c, near).map(|(_, k, x)| outer(&x, &(x * (0.5 * k)))).sum();
        (0..self.particles()).into_par_iter().with_min_len(GRAIN).map(sum).collect()
    }

    fn diagonal_block(&self, a: usize, spread: &[Tensor<D>]) -> Tensor<D> {
        let frozen = &self.linearisation;
        let s = frozen.shift;
        let near = &self.gradient.neighbourhood;
        let mut through = Tensor::<D>::zeros();
        let mut direct = Tensor::<D>::zeros();
        for entry in near.row(a) {
            let c = near.neighbour(entry);
            let weight = self.gradient.transposed_weight(entry);
            let tangent = frozen.stress.at(c);
            for i in 0..D {
                for j in 0..D {
                    let row = tangent[i][j] * weight * weight[j];
                    (0..D).for_each(|k| through[(i, k)] += row[k]);
                }
            }
            if let Some(viscous) = frozen.viscous.get(c) {
                for i in 0..D {
                    for j in 0..D {
                        let row = viscous[i][j] * weight * weight[j];
                        (0..D).for_each(|k| direct[(i, k)] += row[k]);
                    }
                }
            }
            if let Some(pair) = self.frozen_velocity_pair(entry, a, c) {
                direct += pair.by_difference;
                through += pair.by_separation;
            }
        }
        if let Some(control) = self.active_hourglass() {
            let own = self.gradient.weights.at(a, near.own_entry(a));
            let mut sum = 0.0;
            for (entry, (c, k, separation)) in near.row(a).zip(control.pairs(a, near)) {
                let weight = self.gradient.transposed_weight(entry);
                // ½ Σ_b k_cb (g_ca·X_cb − δ_ab + δ_ac)²
                sum += weight.dot(&(spread[c] * weight));
                if c != a {
                    // X_ca = −X_ac.
                    sum += k * (weight.dot(&separation) + 0.5) + k * (own.dot(&separation) + 0.5);
                }
            }
            through += Tensor::identity() * sum;
        }
        let (mass, moving) = if frozen.at_rest { (0.0, 0.0) } else { (self.masses[a], 1.0) };
        Tensor::identity() * mass + direct * (s * moving) + through * (s * s)
    }
}
