//! The hourglass control as part of the model: forces, their variation and their entries in the tangent.
//!
//! All of it is linear in the displacements, so one function serves values and variations.

use rayon::prelude::*;

use super::Model;
use super::assembly::Block;
use super::evaluation::GRAIN;
use super::slots::Slots;
use crate::stabilisation::Hourglass;
use crate::tensor::{Tensor, Vector};

impl<const D: usize> Model<D> {
    /// The hourglass control, if a body has any.
    pub fn hourglass(&self) -> Option<&Hourglass<D>> {
        self.hourglass.as_ref()
    }

    /// The control, if its term is evaluated.
    pub(super) fn active_hourglass(&self) -> Option<&Hourglass<D>> {
        self.hourglass.as_ref().filter(|_| self.terms.hourglass)
    }

    /// Pair forces on all particles, N, left in the workspace.
    pub(super) fn hourglass_forces(&mut self, displacement: &[f64]) {
        let mut forces = std::mem::take(&mut self.workspace.hourglass);
        let (near, points) = (&self.gradient.neighbourhood, &self.workspace.points);
        match self.active_hourglass() {
            Some(control) => forces.par_iter_mut().with_min_len(GRAIN).enumerate().for_each(|(a, force)| {
                *force = control.force(a, near, displacement, |b| points[b].deformation - Tensor::identity());
            }),
            None => forces.fill(Vector::zeros()),
        }
        self.workspace.hourglass = forces;
    }

    /// `Π`, J.
    pub(super) fn hourglass_energy(&self, displacement: &[f64]) -> f64 {
        let (Some(control), near) = (&self.hourglass, &self.gradient.neighbourhood) else { return 0.0 };
        self.sum(|a| control.energy(a, near, displacement, &self.gradient.of(a, displacement)))
    }

    /// Adds the derivatives of the force on particle `a`. With `s_cd = ½ k_cd X_cd·g_ca`,
    ///
    /// ```text
    /// f_a = Σ_c Σ_d s_cd [(u_d − u_c) − G_c X_cd] + Σ_b k_ab [(u_b − u_a) − ½ (G_a + G_b) X_ab]
    /// ```
    ///
    /// so that the part through `G_c` is one vector per neighbour c, spread over c's neighbours.
    pub(super) fn hourglass_blocks(&self, a: usize, slots: &Slots, blocks: &mut [Block<D>]) {
        let Some(control) = self.active_hourglass() else { return };
        let near = &self.gradient.neighbourhood;
        let own_slot = slots.position(a, a);
        let mut add = |slot: usize, value: f64| {
            for i in 0..D {
                blocks[slot].force_by_displacement[(i, i)] += value;
            }
        };
        let own: Vector<D> = control.pairs(a, near).map(|(_, k, separation)| separation * (0.5 * k)).sum();
        // The rows of a and of its neighbours belong to one body: pairs are missing for all of them or for none.
        for (entry, (c, k, separation)) in near.row(a).zip(control.pairs(a, near)) {
            let transposed = self.gradient.weights[near.twin(entry)];
            let mut through = if c == a { -own } else { separation * (-0.5 * k) };
            add(slots.position(a, c), k);
            add(own_slot, -k);
            let into = slots.of_entry(entry);
            let mut total = 0.0;
            for (&slot, (_, k, separation)) in into.iter().zip(control.pairs(c, near)) {
                let s = 0.5 * k * separation.dot(&transposed);
                through -= separation * s;
                total += s;
                add(slot as usize, s);
            }
            add(slots.position(a, c), -total);
            for (&slot, inner) in into.iter().zip(near.row(c)) {
                add(slot as usize, through.dot(&self.gradient.weights[inner]));
            }
        }
    }
}
