//! The hourglass control as part of the model: forces, their variation and their entries in the tangent.
//!
//! All of it is linear in the displacements: one function serves values and variations, and the derivatives are found
//! once per run.

use rayon::prelude::*;

use super::Model;
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

    /// Adds the derivatives of the force on particle `a` to the blocks of its members, which follow one for others.
    pub(super) fn add_hourglass(&self, a: usize, members: &[u32], blocks: &mut [Tensor<D>], scale: f64) {
        if self.active_hourglass().is_none() {
            return;
        }
        let add = |(block, value): (&mut Tensor<D>, &f64)| (0..D).for_each(|i| block[(i, i)] += scale * value);
        let blocks = blocks[1..].iter_mut();
        match self.linearisation.slots.get().filter(|slots| slots.ring(a).len() == members.len()) {
            Some(slots) => {
                let values = self.linearisation.hourglass.get_or_init(|| self.hourglass_stiffness(slots));
                blocks.zip(&values[slots.ring_range(a)]).for_each(add);
            }
            // Without the two-rings there is no room for what belongs to them.
            None => blocks.zip(&self.hourglass_row(a, members)).for_each(add),
        }
    }

    /// Derivatives of the forces with respect to displacements, N/m, one number per member of every ring. With
    /// `s_cd = ½ k_cd X_cd·g_ca`,
    ///
    /// ```text
    /// f_a = Σ_c Σ_d s_cd [(u_d − u_c) − G_c X_cd] + Σ_b k_ab [(u_b − u_a) − ½ (G_a + G_b) X_ab]
    /// ```
    ///
    /// so that the part through `G_c` is one vector per neighbour c, spread over c's neighbours.
    fn hourglass_stiffness(&self, slots: &Slots) -> Vec<f64> {
        let rows = (0..self.particles()).into_par_iter().with_min_len(GRAIN);
        rows.flat_map_iter(|a| self.hourglass_row(a, slots.ring(a))).collect()
    }

    /// The row of `a`, for the given members of its ring, ascending.
    fn hourglass_row(&self, a: usize, members: &[u32]) -> Vec<f64> {
        let mut out = vec![0.0; members.len()];
        let Some(control) = &self.hourglass else { return out };
        let near = &self.gradient.neighbourhood;
        // Neighbours come in ascending order, too: `from` is where the last one was found.
        let mut add = |from: &mut usize, e: usize, value: f64| {
            while members.get(*from).is_some_and(|&member| (member as usize) < e) {
                *from += 1;
            }
            if members.get(*from).is_some_and(|&member| member as usize == e) {
                out[*from] += value;
            }
        };
        let own: Vector<D> = control.pairs(a, near).map(|(_, k, separation)| separation * (0.5 * k)).sum();
        // The rows of a and of its neighbours belong to one body: pairs are missing for all of them or for none.
        for (entry, (c, k, separation)) in near.row(a).zip(control.pairs(a, near)) {
            let transposed = *self.gradient.transposed_weight(entry);
            let mut through = if c == a { -own } else { separation * (-0.5 * k) };
            add(&mut 0, a, -k);
            let (mut total, mut at) = (0.0, 0);
            for (d, k, separation) in control.pairs(c, near) {
                let s = 0.5 * k * separation.dot(&transposed);
                through -= separation * s;
                total += s;
                add(&mut at, d, s);
            }
            add(&mut 0, c, k - total);
            at = 0;
            for (&e, weight) in near.of(c).iter().zip(self.gradient.weights_of(c)) {
                add(&mut at, e as usize, through.dot(weight));
            }
        }
        out
    }
}
