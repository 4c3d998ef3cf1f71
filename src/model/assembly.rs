//! Entries of the tangent on a pattern that is fixed for the whole run.
//!
//! Row a couples to its two-ring: a's force reads the stress of every neighbour c, which reads the
//! displacement of every neighbour e of c. So a row is a double loop over c and e, into slots found
//! once per run; no sorting, no scatter between rows, and each row is written by its owner.
//!
//! Every derivative of a force or a rate with respect to displacements through F has the form
//! `Σ_c B_ac : δF_c`, whatever the term; the double loop runs once for the sum of all terms.

use std::sync::Arc;

use nicolson_solvers::linear::{SparseMatrix, StoredTangent, Symmetry, Tangent};

use super::slots::Slots;
use super::{Model, Unknowns};
use crate::tensor::{Tensor, Vector, contract};

/// Particles assembled as one piece of work.
const PIECE: usize = 32;

/// The part of the tangent that couples direct neighbours only: the other entries are dropped, which
/// makes a far better preconditioner than lumping them onto the diagonal.
pub type OneRing = StoredTangent;

/// Derivatives of a particle's force f and rate j with respect to one ring member.
#[derive(Clone, Copy)]
pub(super) struct Block<const D: usize> {
    pub(super) force_by_displacement: Tensor<D>,
    force_by_velocity: Tensor<D>,
    force_by_volume: Vector<D>,
    rate_by_displacement: Vector<D>,
    rate_by_velocity: Vector<D>,
    rate_by_volume: f64,
}

impl<const D: usize> Block<D> {
    fn zero() -> Self {
        Self {
            force_by_displacement: Tensor::zeros(),
            force_by_velocity: Tensor::zeros(),
            force_by_volume: Vector::zeros(),
            rate_by_displacement: Vector::zeros(),
            rate_by_velocity: Vector::zeros(),
            rate_by_volume: 0.0,
        }
    }
}

/// What the pair terms of one particle add, per neighbour: coefficients of `δc`, `δH`, `δp`.
struct PairSums<const D: usize> {
    force_by_speed: Vec<Vector<D>>,
    rate_by_speed: Vec<f64>,
    rate_by_cofactor: Vec<Tensor<D>>,
}

impl<const D: usize> PairSums<D> {
    fn zero(neighbours: usize) -> Self {
        Self {
            force_by_speed: vec![Vector::zeros(); neighbours],
            rate_by_speed: vec![0.0; neighbours],
            rate_by_cofactor: vec![Tensor::zeros(); neighbours],
        }
    }
}

impl<const D: usize> Model<D> {
    /// The tangent at the last linearised point as a matrix of its own.
    pub fn tangent_matrix(&self) -> SparseMatrix {
        let mut matrix = SparseMatrix::zeros(self.slots().pattern());
        self.fill(matrix.values_mut());
        matrix
    }

    /// The one-ring part of the tangent at the last linearised point. Only its own entries are ever
    /// stored, so it serves the matrix-free path where the whole tangent would not fit.
    pub(super) fn one_ring(&self) -> OneRing {
        let neighbourhood = &self.gradient.neighbourhood;
        let pattern = self.linearisation.one_ring_pattern.get_or_init(|| Arc::new(self.one_ring_pattern()));
        let mut values = vec![0.0; pattern.entries()];
        let mut blocks = Vec::new();
        let mut rest = &mut values[..];
        for a in 0..self.particles() {
            let unknowns = self.unknowns.of(a);
            let (own, tail) = rest.split_at_mut(pattern.offsets()[unknowns.end] - pattern.offsets()[unknowns.start]);
            rest = tail;
            // The two-ring of one particle at a time: all of them together are what this path avoids.
            let row;
            let slots = match self.linearisation.slots.get() {
                Some(slots) => slots,
                None => {
                    row = self.slots_of(a);
                    &row
                }
            };
            blocks.clear();
            blocks.resize(slots.ring(a).len(), Block::<D>::zero());
            self.row_blocks(a, slots, &mut blocks);
            let near: Vec<Block<D>> =
                neighbourhood.of(a).iter().map(|&e| blocks[slots.position(a, e as usize)]).collect();
            self.write_rows(a, neighbourhood.of(a), &near, own);
        }
        OneRing::new(pattern, values, Symmetry::General)
    }

    /// Writes all entries.
    pub(super) fn assemble(&self, values: &mut [f64]) {
        let slots = self.slots();
        self.assemble_range(0..self.particles(), slots, values);
    }

    fn assemble_range(&self, range: std::ops::Range<usize>, slots: &Slots, values: &mut [f64]) {
        if range.len() > PIECE {
            let middle = range.start + range.len() / 2;
            let (left, right) = values.split_at_mut(slots.values[middle] - slots.values[range.start]);
            rayon::join(
                || self.assemble_range(range.start..middle, slots, left),
                || self.assemble_range(middle..range.end, slots, right),
            );
            return;
        }
        let mut blocks = Vec::new();
        let mut rest = values;
        for a in range {
            let (own, tail) = rest.split_at_mut(slots.values[a + 1] - slots.values[a]);
            rest = tail;
            if own.is_empty() {
                continue;
            }
            blocks.clear();
            blocks.resize(slots.ring(a).len(), Block::<D>::zero());
            self.row_blocks(a, slots, &mut blocks);
            self.write_rows(a, slots.ring(a), &blocks, own);
        }
    }

    /// Derivatives of force and rate of particle `a` with respect to all ring members.
    fn row_blocks(&self, a: usize, slots: &Slots, blocks: &mut [Block<D>]) {
        let neighbourhood = &self.gradient.neighbourhood;
        let with_volume = self.unknowns.kind() != Unknowns::Velocity;
        let own = neighbourhood.own_entry(a) - neighbourhood.row(a).start;
        self.hourglass_blocks(a, slots, blocks);
        let sums = self.upwind.is_some().then(|| self.pair_blocks(a, own, slots, blocks));
        for (local, entry) in neighbourhood.row(a).enumerate() {
            let c = neighbourhood.neighbour(entry);
            let tangent = self.linearisation.stress.at(c);
            let frozen = self.linearisation.particles.get(c);
            let transposed = self.gradient.weights[neighbourhood.twin(entry)];
            // B_ac: force row, one tensor over (k, l) per component i.
            let mut force: [Tensor<D>; D] = std::array::from_fn(|i| {
                let mut b = Tensor::zeros();
                for j in 0..D {
                    b -= tangent[i][j] * transposed[j];
                }
                b
            });
            let mut rate = Tensor::zeros();
            if let (Some(sums), Some(frozen)) = (&sums, frozen) {
                for (i, b) in force.iter_mut().enumerate() {
                    *b += frozen.speed_by_gradient * sums.force_by_speed[local][i];
                }
                if with_volume {
                    rate += frozen.speed_by_gradient * sums.rate_by_speed[local];
                    rate += self.cofactor_along(c, &frozen.point, &sums.rate_by_cofactor[local]);
                }
            }
            if let (true, Some(frozen)) = (with_volume, frozen) {
                let slot = slots.position(a, c);
                blocks[slot].force_by_volume -= frozen.stress_by_volume * transposed;
                if let Some(sums) = &sums {
                    blocks[slot].rate_by_volume += contract(&sums.rate_by_cofactor[local], &frozen.cofactor_by_volume);
                }
                if local == own {
                    rate += frozen.rate_by_gradient;
                    blocks[slot].rate_by_volume += frozen.rate_by_volume;
                }
            }
            for (&slot, inner) in slots.of_entry(entry).iter().zip(neighbourhood.row(c)) {
                let weight = &self.gradient.weights[inner];
                let block = &mut blocks[slot as usize];
                for (i, b) in force.iter().enumerate() {
                    for k in 0..D {
                        for l in 0..D {
                            block.force_by_displacement[(i, k)] += b[(k, l)] * weight[l];
                        }
                    }
                }
                if with_volume {
                    block.rate_by_displacement += rate * weight;
                }
            }
            if let Some(viscous) = self.linearisation.viscous.get(c) {
                for (&slot, inner) in slots.of_entry(entry).iter().zip(neighbourhood.row(c)) {
                    let weight = &self.gradient.weights[inner];
                    let block = &mut blocks[slot as usize].force_by_velocity;
                    for i in 0..D {
                        for (j, tangent) in viscous[i].iter().enumerate() {
                            let row = (tangent * weight) * transposed[j];
                            (0..D).for_each(|k| block[(i, k)] -= row[k]);
                        }
                    }
                }
            }
        }
        if with_volume && self.terms.volume_rate {
            let cofactor = &self.linearisation.particles[a].point.cofactor;
            for entry in neighbourhood.row(a) {
                let slot = slots.position(a, neighbourhood.neighbour(entry));
                blocks[slot].rate_by_velocity += cofactor * self.gradient.weights[entry];
            }
        }
    }

    /// Pair terms of particle `a`: what acts directly on displacements, velocities and volume ratios
    /// goes into the blocks; what acts through F is returned per neighbour.
    fn pair_blocks(&self, a: usize, own: usize, slots: &Slots, blocks: &mut [Block<D>]) -> PairSums<D> {
        let neighbourhood = &self.gradient.neighbourhood;
        let row = neighbourhood.row(a);
        let mut sums = PairSums::zero(row.len());
        let own_slot = slots.position(a, a);
        let Some(upwind) = self.upwind.as_ref() else { return sums };
        for (local, entry) in row.enumerate() {
            let b = neighbourhood.neighbour(entry);
            let slot = slots.position(a, b);
            let half = upwind.reference_separation(a, b) * 0.5;
            if let Some(pair) = self.frozen_velocity_pair(entry, a, b) {
                sums.force_by_speed[local] += pair.by_speed * 0.5;
                sums.force_by_speed[own] += pair.by_speed * 0.5;
                blocks[slot].force_by_velocity += pair.by_difference;
                blocks[own_slot].force_by_velocity -= pair.by_difference;
                blocks[slot].force_by_displacement += pair.by_separation;
                blocks[own_slot].force_by_displacement -= pair.by_separation;
                self.slope_blocks(a, [(a, own_slot), (b, slot)], slots, |side, coefficient, member, centre| {
                    let _ = side;
                    blocks[member].force_by_velocity -= pair.by_increment * (coefficient.dot(&half));
                    blocks[centre].force_by_velocity += pair.by_increment * (coefficient.dot(&half));
                });
            }
            if self.unknowns.kind() == Unknowns::Velocity {
                continue;
            }
            if let Some(pair) = self.frozen_pressure_pair(entry, a, b) {
                let slope = |particle: usize| self.linearisation.particles[particle].pressure_slope;
                sums.rate_by_speed[local] += 0.5 * pair.by_speed;
                sums.rate_by_speed[own] += 0.5 * pair.by_speed;
                sums.rate_by_cofactor[own] += pair.by_cofactor[0];
                sums.rate_by_cofactor[local] += pair.by_cofactor[1];
                blocks[own_slot].rate_by_volume += pair.by_pressure[0] * slope(a);
                blocks[slot].rate_by_volume += pair.by_pressure[1] * slope(b);
                blocks[slot].rate_by_displacement += pair.by_separation;
                blocks[own_slot].rate_by_displacement -= pair.by_separation;
                // p⁻ gains +½ 𝒢_a·d, p⁺ loses ½ 𝒢_b·d.
                let sign = [pair.by_increment[0], -pair.by_increment[1]];
                self.slope_blocks(a, [(a, own_slot), (b, slot)], slots, |side, coefficient, member, centre| {
                    let factor = sign[side] * coefficient.dot(&half);
                    let particle = |position: usize| slots.ring(a)[position] as usize;
                    blocks[member].rate_by_volume += factor * slope(particle(member));
                    blocks[centre].rate_by_volume -= factor * slope(particle(centre));
                });
            }
        }
        sums
    }

    /// Visits the members of the reconstruction stencils of both sides of a pair of particle `a`:
    /// side, least-squares weight, and the ring positions of the member and of the stencil's centre.
    fn slope_blocks(
        &self,
        a: usize,
        sides: [(usize, usize); 2],
        slots: &Slots,
        mut visit: impl FnMut(usize, &Vector<D>, usize, usize),
    ) {
        let Some(upwind) = self.upwind.as_ref().filter(|u| u.options.interface.reconstructs()) else { return };
        let neighbourhood = &self.gradient.neighbourhood;
        for (side, (centre, centre_slot)) in sides.into_iter().enumerate() {
            // The entry (a, centre) knows the slots of the centre's neighbours in a's ring.
            let entry = neighbourhood.row(a).start + neighbourhood.of(a).partition_point(|&c| (c as usize) < centre);
            for (&member, inner) in slots.of_entry(entry).iter().zip(neighbourhood.row(centre)) {
                visit(side, &upwind.reconstruction[inner], member as usize, centre_slot);
            }
        }
    }

    /// Writes the rows of particle `a` from its blocks.
    fn write_rows(&self, a: usize, ring: &[u32], blocks: &[Block<D>], values: &mut [f64]) {
        let s = self.linearisation.shift;
        let full = self.unknowns.kind() == Unknowns::Full;
        // An equilibrium knows neither inertia nor velocities.
        let (mass, moving) = if self.linearisation.at_rest { (0.0, 0.0) } else { (self.masses[a], 1.0) };
        let mut out = values.iter_mut();
        let mut put = |value: f64| {
            if let Some(slot) = out.next() {
                *slot = value;
            }
        };
        for i in (0..D).filter(|&i| self.unknowns.velocity(a, i).is_some()) {
            for (&e, block) in ring.iter().zip(blocks) {
                let e = e as usize;
                let free = |k: &usize| self.unknowns.velocity(e, *k).is_some();
                let (through, direct) = (&block.force_by_displacement, &block.force_by_velocity);
                for k in (0..D).filter(free) {
                    let inertia = if e == a && i == k { mass } else { 0.0 };
                    let eliminated = if full { 0.0 } else { s * through[(i, k)] };
                    put(inertia - s * (moving * direct[(i, k)] + eliminated));
                }
                if self.unknowns.volume_ratio(e).is_some() {
                    put(-s * block.force_by_volume[i] / self.volume_unit(e));
                }
                for k in (0..D).filter(|k| full && free(k)) {
                    put(-s * s * through[(i, k)]);
                }
            }
        }
        if self.unknowns.volume_ratio(a).is_some() {
            let unit = mass * self.volume_unit(a);
            for (&e, block) in ring.iter().zip(blocks) {
                let e = e as usize;
                let free = |k: &usize| self.unknowns.velocity(e, *k).is_some();
                for k in (0..D).filter(free) {
                    let eliminated = if full { 0.0 } else { s * block.rate_by_displacement[k] };
                    put(-unit * s * (block.rate_by_velocity[k] + eliminated));
                }
                let own = if e == a { 1.0 } else { 0.0 };
                put(unit * (own - s * block.rate_by_volume) / self.volume_unit(e));
                for k in (0..D).filter(|k| full && free(k)) {
                    put(-unit * s * s * block.rate_by_displacement[k]);
                }
            }
        }
        if full {
            for _ in (0..D).filter(|&i| self.unknowns.velocity(a, i).is_some()) {
                put(-mass);
                put(mass);
            }
        }
    }
}
