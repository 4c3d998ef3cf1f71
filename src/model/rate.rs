//! Explicit rates: two sweeps over blocks of particles that leave nothing behind but the rates.
//!
//! First sweep: F and L of a block, the law, and the columns of volume times stress; `J̇` goes straight out. Second
//! sweep: forces by the transposed weights, over masses, straight out. Between them only the stress is stored. Where no rows
//! repeat, `one_sweep` reads the table of weights once instead. A scene with pair terms (upwinding, hourglass control) needs more of every particle, and takes the sweeps of `evaluation`.
//!
//! Blocks are fixed and every particle gathers in the order of its row: the same bits for any number of threads and
//! any instruction set. The vector instructions of the machine are chosen at run time (`pulp`), without fused
//! multiply-add, which would round differently.

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

use nicolson_solvers::time::RatePart;
use nicolson_solvers::{EvaluationError, vector};
use rayon::prelude::*;

use super::law::{Point, VolumeRatios};
use super::one_sweep::OneSweep;
use super::{Model, Terms};
use crate::discretisation::{BLOCK, Columns};
use crate::setup::{Constraint, Setup};
use crate::tensor::Tensor;

/// Blocks handled as one piece of work.
const BLOCKS: usize = 4;

/// What explicit rates need beside the tables.
#[derive(Debug, Clone)]
pub struct RateSpace<const D: usize> {
    pub(super) arch: pulp::Arch,
    /// Columns of volume times stress, N m; empty before the first rate, and where one sweep does.
    columns: [Vec<f64>; D],
    /// Where no rows repeat; `None` before the first rate.
    one_sweep: Option<OneSweep<D>>,
    /// Velocities that are prescribed, ascending.
    prescribed: Vec<u32>,
    /// All rates where only a part is wanted but all must be found; empty until then.
    all: Vec<f64>,
}

impl<const D: usize> RateSpace<D> {
    /// Space for the rates of a set-up.
    pub fn new(setup: &Setup<D>) -> Self {
        let components = setup.constraints.iter().flatten().enumerate();
        let prescribed = components.filter(|(_, kind)| **kind != Constraint::Free).map(|(i, _)| i as u32).collect();
        let columns = std::array::from_fn(|_| Vec::new());
        Self { arch: pulp::Arch::new(), columns, one_sweep: None, prescribed, all: Vec::new() }
    }
}

impl<const D: usize> RateSpace<D> {
    /// Components whose motion is prescribed, ascending.
    pub fn prescribed(&self) -> &[u32] {
        &self.prescribed
    }
}

/// Which parts of a rate are wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Wanted {
    /// Rates of the velocities.
    pub velocities: bool,
    /// Rates of displacements and volume ratios.
    pub others: bool,
}

/// A failed law: the first particle of its block, or none.
pub(super) struct Flag(AtomicUsize);

impl Flag {
    pub(super) fn raise(&self, block: usize) {
        self.0.fetch_min(block, Ordering::Relaxed);
    }

    fn is_down(&self) -> bool {
        self.0.load(Ordering::Relaxed) == usize::MAX
    }
}

impl<const D: usize> Model<D> {
    /// All rates, by the shortest way that the scene allows.
    pub(super) fn all_rates(&mut self, t: f64, state: &[f64], out: &mut [f64]) -> Result<(), EvaluationError> {
        if self.has_plain_rates() && self.plain_rates(Wanted { velocities: true, others: true }, t, state, out)? {
            return Ok(());
        }
        self.stage.evaluated.clear();
        let n = self.particles();
        let (displacement, rest) = state.split_at(n * D);
        let (velocity, ratios) = rest.split_at(n * D);
        self.evaluate(t, displacement, velocity, VolumeRatios::Given(ratios))?;
        self.write_rate(velocity, out);
        match vector::first_not_finite(out) {
            None => Ok(()),
            Some(i) => Err(self.located(EvaluationError::not_finite("rate", self.particle_of_entry(i), out[i]))),
        }
    }

    /// One part of the rates; what the other part alone needs is not done.
    pub(super) fn some_rates(
        &mut self,
        part: RatePart,
        t: f64,
        state: &[f64],
        out: &mut [f64],
    ) -> Result<(), EvaluationError> {
        let wanted = Wanted { velocities: part != RatePart::Others, others: part != RatePart::Velocities };
        if self.has_plain_rates() && self.plain_rates(wanted, t, state, out)? {
            return Ok(());
        }
        let mut all = std::mem::take(&mut self.rates.all);
        all.resize(out.len(), 0.0);
        let outcome = self.all_rates(t, state, &mut all);
        if outcome.is_ok() {
            let n = self.particles() * D;
            if wanted.velocities {
                out[n..2 * n].copy_from_slice(&all[n..2 * n]);
            }
            if wanted.others {
                out[..n].copy_from_slice(&all[..n]);
                out[2 * n..].copy_from_slice(&all[2 * n..]);
            }
        }
        self.rates.all = all;
        outcome
    }

    /// Writes `[v | f/m | J̇]` of the workspace.
    pub(super) fn write_rate(&self, velocity: &[f64], out: &mut [f64]) {
        let n = self.particles();
        out[..n * D].copy_from_slice(velocity);
        for (a, point) in self.workspace.points.iter().enumerate() {
            for i in 0..D {
                let free = self.setup.constraints[a][i] == Constraint::Free;
                out[(n + a) * D + i] = if free { point.force[i] / self.masses[a] } else { 0.0 };
            }
            out[2 * n * D + a] = point.rate;
        }
    }

    /// Whether rates need no pair terms.
    pub(super) fn has_plain_rates(&self) -> bool {
        self.upwind.is_none() && self.hourglass.is_none() && self.terms == Terms::ALL
    }

    /// Writes the wanted parts of `[v | f/m | J̇]`. `Ok(false)`: something is not finite or outside the domain of the
    /// law; the sweeps of `evaluation` tell what.
    ///
    /// # Errors
    /// If a load is not finite.
    pub(super) fn plain_rates(
        &mut self,
        wanted: Wanted,
        t: f64,
        state: &[f64],
        out: &mut [f64],
    ) -> Result<bool, EvaluationError> {
        let n = self.particles();
        let (displacement, rest) = state.split_at(n * D);
        let (velocity, ratios) = rest.split_at(n * D);
        let (displacement_rate, rest) = out.split_at_mut(n * D);
        let (velocity_rate, ratio_rate) = rest.split_at_mut(n * D);
        if wanted.velocities {
            self.loads
                .update(&self.setup, &self.masses, t)
                .map_err(|error| error.clone().at(self.describe_particle(error.site)))?;
        }
        let mut columns = std::mem::replace(&mut self.rates.columns, std::array::from_fn(|_| Vec::new()));
        let mut one_sweep = self.rates.one_sweep.take();
        let once = wanted.velocities && self.gradient.in_runs() == [0, 0];
        if once && one_sweep.is_none() {
            one_sweep = Some(OneSweep::new(&self.gradient.neighbourhood));
        } else if wanted.velocities && !once {
            columns.iter_mut().for_each(|column| column.resize(n * D, 0.0));
        }
        let (model, flag) = (&*self, Flag(AtomicUsize::new(usize::MAX)));
        let first = First { model, displacement, velocity, ratios, wanted, flag: &flag };
        let ratio_rate = if wanted.others { ratio_rate } else { &mut [] };
        match &mut one_sweep {
            Some(space) if once => space.rates(&first, velocity_rate, ratio_rate),
            _ => {
                let stress = columns.each_mut().map(|column| &mut column[..]);
                first.sweep(0, stress, ratio_rate, n);
                if flag.is_down() && wanted.velocities {
                    let chunk = BLOCKS * BLOCK;
                    velocity_rate.par_chunks_mut(chunk * D).enumerate().for_each(|(i, rates)| {
                        model.second_sweep_of(i * chunk, &columns, rates, &flag);
                    });
                }
            }
        }
        let sound = flag.is_down();
        if wanted.others {
            let chunk = 64 * BLOCKS * BLOCK;
            displacement_rate.par_chunks_mut(chunk).zip(velocity.par_chunks(chunk)).for_each(|(out, v)| {
                out.copy_from_slice(v);
            });
        }
        (self.rates.columns, self.rates.one_sweep) = (columns, one_sweep);
        Ok(sound)
    }

    /// Accelerations of consecutive particles.
    fn second_sweep_of(&self, start: usize, columns: &[Vec<f64>; D], rates: &mut [f64], flag: &Flag) {
        for (index, rates) in rates.chunks_mut(BLOCK * D).enumerate() {
            let first = start + index * BLOCK;
            let block = first..first + rates.len() / D;
            self.rates.arch.dispatch(SecondBlock { model: self, block, columns, rates, flag });
        }
        self.still(start * D, rates);
    }

    /// Accelerations of at most [`BLOCK`] particles from their inner forces, which loads are taken from; whether they are
    /// finite.
    #[inline(always)]
    pub(super) fn accelerations(&self, block: Range<usize>, forces: &mut [[f64; D]; BLOCK], rates: &mut [f64]) -> bool {
        if self.loads.any() {
            for (force, a) in forces.iter_mut().zip(block.clone()) {
                let load = self.loads.on(a);
                for i in 0..D {
                    force[i] -= load[i];
                }
            }
        }
        let mut check = 0.0;
        for ((rate, force), mass) in rates.chunks_exact_mut(D).zip(forces).zip(&self.masses[block]) {
            for i in 0..D {
                rate[i] = -force[i] / mass;
                // Zero, unless it is not finite.
                check += rate[i] * 0.0;
            }
        }
        check == 0.0
    }

    /// Zeroes the rates of prescribed components.
    pub(super) fn still(&self, first: usize, rates: &mut [f64]) {
        let prescribed = &self.rates.prescribed;
        let place = |entry: usize| prescribed.partition_point(|&i| (i as usize) < entry);
        for &i in &prescribed[place(first)..place(first + rates.len())] {
            rates[i as usize - first] = 0.0;
        }
    }
}

/// A block of the second sweep, compiled once for every set of vector instructions. (A closure would not do: what calls
/// it is not inlined, and then knows no vector instructions.)
struct SecondBlock<'a, const D: usize> {
    model: &'a Model<D>,
    block: Range<usize>,
    columns: &'a [Vec<f64>; D],
    rates: &'a mut [f64],
    flag: &'a Flag,
}

impl<const D: usize> pulp::WithSimd for SecondBlock<'_, D> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let Self { model, block, columns, rates, flag } = self;
        let mut forces = [[0.0; D]; BLOCK];
        model.gradient.transposed_of_block(block.clone(), columns, &mut forces);
        if !model.accelerations(block.clone(), &mut forces, rates) {
            flag.raise(block.start);
        }
    }
}

/// A block of the first sweep.
struct FirstBlock<'a, 'b, const D: usize> {
    sweep: &'b First<'a, D>,
    block: Range<usize>,
    columns: [&'b mut [f64]; D],
    rates: &'b mut [f64],
}

impl<const D: usize> pulp::WithSimd for FirstBlock<'_, '_, D> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        self.sweep.block(self.block, self.columns, self.rates);
    }
}

/// What gradients and laws are taken of.
pub(super) struct First<'a, const D: usize> {
    pub(super) model: &'a Model<D>,
    pub(super) displacement: &'a [f64],
    pub(super) velocity: &'a [f64],
    ratios: &'a [f64],
    wanted: Wanted,
    pub(super) flag: &'a Flag,
}

impl<const D: usize> First<'_, D> {
    pub(super) fn needs_velocity_gradient(&self) -> bool {
        self.model.viscous || self.wanted.others && self.model.evolved.contains(&true)
    }

    /// Volume times stress, N m, and `J̇`, from the columns of the gradients; `None` outside the domain of the law.
    #[inline(always)]
    pub(super) fn law(
        &self,
        a: usize,
        by_displacement: [[f64; D]; D],
        by_velocity: [[f64; D]; D],
    ) -> Option<(Tensor<D>, f64)> {
        let mut point = Point::rest();
        for d in 0..D {
            for i in 0..D {
                point.deformation[(i, d)] += by_displacement[d][i];
                point.velocity_gradient[(i, d)] = by_velocity[d][i];
            }
        }
        let solid = self.model.constitutive(a, VolumeRatios::Given(self.ratios), &mut point).ok()?;
        Some(((solid - point.cofactor * point.pressure) * self.model.setup.particles.volumes[a], point.rate))
    }

    /// Particles from `start` on, in halves of whole blocks.
    fn sweep(&self, start: usize, columns: [&mut [f64]; D], rates: &mut [f64], count: usize) {
        let blocks = count.div_ceil(BLOCK);
        if blocks <= BLOCKS {
            self.blocks(start, columns, rates, count);
            return;
        }
        let half = blocks / 2 * BLOCK;
        let (left, right) = split(columns, half * D);
        let (left_rates, right_rates) = rates.split_at_mut(half.min(rates.len()));
        rayon::join(
            || self.sweep(start, left, left_rates, half),
            || self.sweep(start + half, right, right_rates, count - half),
        );
    }

    fn blocks(&self, start: usize, mut columns: [&mut [f64]; D], mut rates: &mut [f64], count: usize) {
        let mut done = 0;
        while done < count {
            let size = BLOCK.min(count - done);
            let block = start + done..start + done + size;
            let (head, tail) = split(columns, size * D);
            let wanted = size.min(rates.len());
            let (own, others) = std::mem::take(&mut rates).split_at_mut(wanted);
            self.model.rates.arch.dispatch(FirstBlock { sweep: self, block, columns: head, rates: own });
            (columns, rates) = (tail, others);
            done += size;
        }
    }

    /// One block; `rates` is empty if they are not wanted, and so are `columns`.
    #[inline(always)]
    fn block(&self, block: Range<usize>, mut columns: [&mut [f64]; D], rates: &mut [f64]) {
        let model = self.model;
        let mut by_displacement: Columns<D> = [[[0.0; D]; BLOCK]; D];
        let mut by_velocity: Columns<D> = [[[0.0; D]; BLOCK]; D];
        model.gradient.of_block(block.clone(), self.displacement, &mut by_displacement);
        if self.needs_velocity_gradient() {
            model.gradient.of_block(block.clone(), self.velocity, &mut by_velocity);
        }
        let mut sound = true;
        for (at, a) in block.clone().enumerate() {
            // Not `map`, which would move the whole block.
            let own = |columns: &Columns<D>| std::array::from_fn(|d| columns[d][at]);
            let Some((stress, rate)) = self.law(a, own(&by_displacement), own(&by_velocity)) else {
                sound = false;
                break;
            };
            if self.wanted.velocities {
                for (d, column) in columns.iter_mut().enumerate() {
                    for i in 0..D {
                        column[at * D + i] = stress[(i, d)];
                    }
                }
            }
            if let Some(out) = rates.get_mut(at) {
                *out = rate;
            }
        }
        if !sound {
            self.flag.raise(block.start);
        }
    }
}

/// Splits every column, or none if they are empty.
#[inline(always)]
fn split<const D: usize>(columns: [&mut [f64]; D], at: usize) -> ([&mut [f64]; D], [&mut [f64]; D]) {
    let mut tails = std::array::from_fn(|_| Default::default());
    let mut number = 0;
    let heads = columns.map(|column| {
        let (head, tail) = column.split_at_mut(at.min(column.len()));
        tails[number] = tail;
        number += 1;
        head
    });
    (heads, tails)
}
