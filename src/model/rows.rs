//! One row of blocks of the tangent: the derivatives of a particle's force and rate of J with respect to the unknowns
//! of its ring.
//!
//! a's force reads the stress of every neighbour c, which reads the displacement of every neighbour e of c. Every
//! derivative of a force or a rate with respect to displacements through F has the form `Σ_c B_ac : δF_c`, whatever
//! the term: the double loop over c and e runs once for the sum of all terms. Where velocities are the only unknowns,
//! `B_ac` holds viscosity as well, and there is one block per member, scaled as the matrix wants it. The hourglass control is
//! quadratic in the displacements: its part never changes, and is found once per run.
//!
//! Where in the ring of a the neighbours of c stand is a table, [`Slots`](super::slots::Slots), which particles of a
//! lattice share. Tried and lost, per update of a 2 × 2 block: looking the place up in an array over all particles,
//! 3.5 ns against 2.0; the upper half alone, of symmetric tangents, 2.6, because loops of changing length are mispredicted:
//! half the updates took about as long as all of them, and the other half was still to be written.

use super::{Model, Unknowns};
use crate::tensor::{Tensor, Tensor4, Vector, contract};

/// Derivatives of a force with respect to J, and of the rate j of J.
#[derive(Debug, Clone, Copy)]
pub(super) struct VolumeBlock<const D: usize> {
    pub(super) force: Vector<D>,
    pub(super) rate_by_displacement: Vector<D>,
    pub(super) rate_by_velocity: Vector<D>,
    pub(super) rate_by_volume: f64,
}

impl<const D: usize> VolumeBlock<D> {
    const ZERO: fn() -> Self = || Self {
        force: Vector::zeros(),
        rate_by_displacement: Vector::zeros(),
        rate_by_velocity: Vector::zeros(),
        rate_by_volume: 0.0,
    };
}

/// What the pair terms of one particle add through F, per neighbour: coefficients of `δc` and `δH`.
#[derive(Debug, Clone, Copy)]
struct PairSum<const D: usize> {
    force_by_speed: Vector<D>,
    rate_by_speed: f64,
    rate_by_cofactor: Tensor<D>,
}

/// The blocks of one row. Slot 0 takes what belongs to particles that are not among the members, and is not read.
#[derive(Debug)]
pub struct Row<const D: usize> {
    /// Slot of every particle.
    place: Vec<u32>,
    /// Slots of the neighbours of all neighbours, where no table has them.
    unlisted: Vec<u32>,
    /// Derivatives of the force by displacements; those by velocities are added to it, and both are scaled as in the
    /// matrix, where velocities are the only unknowns.
    pub(super) through: Vec<Tensor<D>>,
    /// Derivatives of the force by velocities, where J is an unknown.
    pub(super) direct: Vec<Tensor<D>>,
    /// Derivatives by and of J, where it is an unknown.
    pub(super) volume: Vec<VolumeBlock<D>>,
    /// Whether J is an unknown.
    pub(super) mixed: bool,
    /// Factors of derivatives by displacements and velocities.
    scale: [f64; 2],
    pairs: Vec<PairSum<D>>,
}

impl<const D: usize> Row<D> {
    pub(super) fn new(particles: usize) -> Self {
        Self {
            place: vec![0; particles],
            unlisted: Vec::new(),
            through: Vec::new(),
            direct: Vec::new(),
            volume: Vec::new(),
            mixed: false,
            scale: [1.0; 2],
            pairs: Vec::new(),
        }
    }

    /// Blocks of the members, where velocities are the only unknowns.
    pub(super) fn blocks(&self) -> &[Tensor<D>] {
        self.through.get(1..).unwrap_or_default()
    }

    fn begin(&mut self, members: &[u32], mixed: bool, scale: [f64; 2]) {
        (self.mixed, self.scale) = (mixed, scale);
        let slots = members.len() + 1;
        self.through.clear();
        self.through.resize(slots, Tensor::zeros());
        if mixed {
            self.direct.clear();
            self.direct.resize(slots, Tensor::zeros());
            self.volume.clear();
            self.volume.resize(slots, VolumeBlock::ZERO());
        }
        for (slot, &e) in (1..).zip(members) {
            self.place[e as usize] = slot;
        }
    }

    fn end(&mut self, members: &[u32]) {
        members.iter().for_each(|&e| self.place[e as usize] = 0);
    }

    #[inline]
    fn slot(&self, particle: usize) -> usize {
        self.place[particle] as usize
    }

    fn add_displacement(&mut self, slot: usize, derivative: &Tensor<D>) {
        self.through[slot] += derivative * self.scale[0];
    }

    fn add_velocity(&mut self, slot: usize, derivative: &Tensor<D>) {
        if self.mixed {
            self.direct[slot] += derivative;
        } else {
            self.through[slot] += derivative * self.scale[1];
        }
    }
}

/// Derivatives of a force by `F_c`: `[l][k][i]` is that of component i by `F_kl`.
type Through<const D: usize> = [[[f64; D]; D]; D];

/// `T : (· ⊗ g)` on the first index pair: from `∂P_ij/∂F_kl` and the transposed weight g of the force.
#[inline]
fn contracted<const D: usize>(tangent: &Tensor4<D>, weight: &Vector<D>) -> Through<D> {
    let mut out = [[[0.0; D]; D]; D];
    for (i, row) in tangent.iter().enumerate() {
        for (j, entry) in row.iter().enumerate() {
            for (l, column) in entry.data.0.iter().enumerate() {
                for (k, value) in column.iter().enumerate() {
                    out[l][k][i] += value * weight[j];
                }
            }
        }
    }
    out
}

/// Adds `B_ac g_ce` for all neighbours e of c.
#[inline]
fn spread<const D: usize>(blocks: &mut [Tensor<D>], slots: &[u32], b: &Through<D>, weights: &[Vector<D>]) {
    for (&slot, weight) in slots.iter().zip(weights) {
        let block = &mut blocks[slot as usize].data.0;
        let [weight] = &weight.data.0;
        for k in 0..D {
            for i in 0..D {
                let mut sum = block[k][i];
                for l in 0..D {
                    sum += b[l][k][i] * weight[l];
                }
                block[k][i] = sum;
            }
        }
    }
}

impl<const D: usize> Model<D> {
    /// Derivatives of force and rate of particle `a` with respect to the members of its ring.
    ///
    /// `slots`: those of the neighbours of all its neighbours, if a table has them.
    pub(super) fn derive_row(&self, a: usize, members: &[u32], slots: Option<&[u32]>, row: &mut Row<D>) {
        let frozen = &self.linearisation;
        let s = frozen.shift;
        // An equilibrium knows neither inertia nor velocities.
        let (mass, moving) = if frozen.at_rest { (0.0, 0.0) } else { (self.masses[a], 1.0) };
        let mixed = self.unknowns.kind() != Unknowns::Velocity;
        row.begin(members, mixed, if mixed { [1.0; 2] } else { [-s * s, -s * moving] });
        self.add_hourglass(a, members, &mut row.through, row.scale[0]);
        let with_pairs = self.upwind.is_some();
        if with_pairs {
            self.add_pairs(a, row);
        }
        let near = &self.gradient.neighbourhood;
        let own = near.own_entry(a);
        let mut unlisted = std::mem::take(&mut row.unlisted);
        unlisted.clear();
        let mut rest = slots.unwrap_or_else(|| {
            let all = near.of(a).iter().flat_map(|&c| near.of(c as usize));
            unlisted.extend(all.map(|&e| row.place[e as usize]));
            &unlisted
        });
        for (local, entry) in near.row(a).enumerate() {
            let c = near.neighbour(entry);
            let point = frozen.particles.get(c);
            let transposed = *self.gradient.transposed_weight(entry);
            let weights = self.gradient.weights_of(c);
            let (inner, others) = rest.split_at(weights.len());
            rest = others;
            let mut b = contracted(&frozen.stress.at(c), &(transposed * -row.scale[0]));
            if let Some(viscous) = frozen.viscous.get(c) {
                if mixed {
                    spread(&mut row.direct, inner, &contracted(viscous, &-transposed), weights);
                } else {
                    let more = contracted(viscous, &(transposed * -row.scale[1]));
                    for (b, more) in b.iter_mut().flatten().flatten().zip(more.iter().flatten().flatten()) {
                        *b += more;
                    }
                }
            }
            let pair = row.pairs.get(local).copied().filter(|_| with_pairs);
            if let (Some(pair), Some(point)) = (&pair, point) {
                for (b, column) in b.iter_mut().zip(&point.speed_by_gradient.data.0) {
                    for (b, speed) in b.iter_mut().zip(column) {
                        (0..D).for_each(|i| b[i] += pair.force_by_speed[i] * speed * row.scale[0]);
                    }
                }
            }
            spread(&mut row.through, inner, &b, weights);
            let Some(point) = point.filter(|_| mixed) else { continue };
            let slot = row.slot(c);
            let mut rate = Tensor::zeros();
            row.volume[slot].force -= point.stress_by_volume * transposed;
            if let Some(pair) = &pair {
                rate += point.speed_by_gradient * pair.rate_by_speed;
                rate += self.cofactor_along(c, &point.point, &pair.rate_by_cofactor);
                row.volume[slot].rate_by_volume += contract(&pair.rate_by_cofactor, &point.cofactor_by_volume);
            }
            if entry == own {
                rate += point.rate_by_gradient;
                row.volume[slot].rate_by_volume += point.rate_by_volume;
            }
            for (&slot, weight) in inner.iter().zip(weights) {
                row.volume[slot as usize].rate_by_displacement += rate * weight;
            }
        }
        row.unlisted = unlisted;
        if mixed && self.terms.volume_rate {
            let cofactor = &frozen.particles[a].point.cofactor;
            for (&e, weight) in near.of(a).iter().zip(self.gradient.weights_of(a)) {
                row.volume[row.place[e as usize] as usize].rate_by_velocity += cofactor * weight;
            }
        }
        if !mixed {
            let own = row.slot(a);
            (0..D).for_each(|i| row.through[own][(i, i)] += mass);
        }
        row.end(members);
    }

    /// Pair terms of particle `a`: what acts directly on displacements, velocities and volume ratios
    /// goes into the blocks; what acts through F is summed per neighbour.
    fn add_pairs(&self, a: usize, row: &mut Row<D>) {
        let near = &self.gradient.neighbourhood;
        let nothing =
            PairSum { force_by_speed: Vector::zeros(), rate_by_speed: 0.0, rate_by_cofactor: Tensor::zeros() };
        row.pairs.clear();
        row.pairs.resize(near.row(a).len(), nothing);
        let Some(upwind) = self.upwind.as_ref() else { return };
        let own = near.own_entry(a) - near.row(a).start;
        let own_slot = row.slot(a);
        for (local, entry) in near.row(a).enumerate() {
            let b = near.neighbour(entry);
            let slot = row.slot(b);
            let half = upwind.reference_separation(a, b) * 0.5;
            if let Some(pair) = self.frozen_velocity_pair(entry, a, b) {
                row.pairs[local].force_by_speed += pair.by_speed * 0.5;
                row.pairs[own].force_by_speed += pair.by_speed * 0.5;
                row.add_velocity(slot, &pair.by_difference);
                row.add_velocity(own_slot, &-pair.by_difference);
                row.add_displacement(slot, &pair.by_separation);
                row.add_displacement(own_slot, &-pair.by_separation);
                self.visit_slopes([a, b], |_, coefficient, member, centre| {
                    let change = pair.by_increment * coefficient.dot(&half);
                    row.add_velocity(row.slot(member), &-change);
                    row.add_velocity(row.slot(centre), &change);
                });
            }
            if !row.mixed {
                continue;
            }
            if let Some(pair) = self.frozen_pressure_pair(entry, a, b) {
                let slope = |particle: usize| self.linearisation.particles[particle].pressure_slope;
                row.pairs[local].rate_by_speed += 0.5 * pair.by_speed;
                row.pairs[own].rate_by_speed += 0.5 * pair.by_speed;
                row.pairs[own].rate_by_cofactor += pair.by_cofactor[0];
                row.pairs[local].rate_by_cofactor += pair.by_cofactor[1];
                row.volume[own_slot].rate_by_volume += pair.by_pressure[0] * slope(a);
                row.volume[slot].rate_by_volume += pair.by_pressure[1] * slope(b);
                row.volume[slot].rate_by_displacement += pair.by_separation;
                row.volume[own_slot].rate_by_displacement -= pair.by_separation;
                // p⁻ gains +½ 𝒢_a·d, p⁺ loses ½ 𝒢_b·d.
                let sign = [pair.by_increment[0], -pair.by_increment[1]];
                self.visit_slopes([a, b], |side, coefficient, member, centre| {
                    let factor = sign[side] * coefficient.dot(&half);
                    let (into, from) = (row.slot(member), row.slot(centre));
                    row.volume[into].rate_by_volume += factor * slope(member);
                    row.volume[from].rate_by_volume -= factor * slope(centre);
                });
            }
        }
    }

    /// Visits the members of the reconstruction stencils of both sides of a pair: side, least-squares weight, the
    /// member and the stencil's centre.
    fn visit_slopes(&self, sides: [usize; 2], mut visit: impl FnMut(usize, &Vector<D>, usize, usize)) {
        let Some(upwind) = self.upwind.as_ref().filter(|u| u.options.interface.reconstructs()) else { return };
        let near = &self.gradient.neighbourhood;
        for (side, centre) in sides.into_iter().enumerate() {
            for (&member, coefficient) in near.of(centre).iter().zip(&upwind.reconstruction[near.row(centre)]) {
                visit(side, coefficient, member as usize, centre);
            }
        }
    }
}
