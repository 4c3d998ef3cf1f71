//! Explicit rates in one sweep, for clouds of particles whose rows do not repeat.
//!
//! The force on a particle is `Σ_b T_b g_ba`. Gathered, every `g_ba` lies in the row of another particle, and large tables
//! come from memory piece by piece, several times over. So every particle b gathers its gradient from its own row, applies
//! the law, and adds `T_b g_ba` to its neighbours while that row is still in the cache: the table is read once a rate, in
//! its order, and no stress is stored.
//!
//! Several threads must not add to one place. Particles are cut into blocks, whatever the number of threads, each of which
//! adds to forces of its own, on the pages of particles that it reaches. A particle then takes the sums of all blocks that
//! reach its page, in their order: the same bits for any number of threads.

use std::ops::Range;

use rayon::prelude::*;

use super::rate::First;
use crate::discretisation::{BLOCK, Neighbourhood};

/// Particles of a page: what is turned into accelerations at a time.
const PAGE: usize = BLOCK;
/// Most blocks; each of them is one thread's.
const MOST: usize = 64;
/// Pages of all blocks together, over those of the particles: more blocks would add up more than they save.
const REPEATED: usize = 3;

/// Where the forces of blocks are added up.
#[derive(Debug, Clone)]
pub(super) struct OneSweep<const D: usize> {
    /// Particles of a block, a whole number of pages.
    size: usize,
    blocks: Vec<Block<D>>,
    /// Blocks that reach a page and its place there, ascending: compressed rows.
    offsets: Vec<u32>,
    reached: Vec<(u32, u32)>,
}

#[derive(Debug, Clone)]
struct Block<const D: usize> {
    particles: Range<usize>,
    /// First page that is reached.
    first: usize,
    /// Places of the pages from there on, in `forces`.
    places: Vec<u32>,
    forces: Vec<[[f64; D]; PAGE]>,
}

impl<const D: usize> Block<D> {
    fn new(particles: Range<usize>, rows: &Neighbourhood) -> Self {
        let neighbours = || particles.clone().flat_map(|a| rows.of(a)).map(|&b| b as usize / PAGE);
        let first = neighbours().min().unwrap_or(0);
        let mut places = vec![u32::MAX; neighbours().max().map_or(0, |last| last + 1 - first)];
        neighbours().for_each(|page| places[page - first] = 0);
        let mut count = 0;
        for place in places.iter_mut().filter(|place| **place == 0) {
            *place = count;
            count += 1;
        }
        Self { particles, first, places, forces: vec![[[0.0; D]; PAGE]; count as usize] }
    }

    /// Pages that are reached and their places.
    fn pages(&self) -> impl Iterator<Item = (usize, u32)> {
        self.places
            .iter()
            .enumerate()
            .filter(|(_, place)| **place != u32::MAX)
            .map(|(i, place)| (self.first + i, *place))
    }
}

impl<const D: usize> OneSweep<D> {
    pub(super) fn new(rows: &Neighbourhood) -> Self {
        let n = rows.len();
        let pages = n.div_ceil(PAGE);
        let cut = |count: usize| {
            let size = pages.div_ceil(count).max(1) * PAGE;
            let starts: Vec<usize> = (0..n).step_by(size).collect();
            let blocks = starts.into_par_iter().map(|start| Block::new(start..(start + size).min(n), rows)).collect();
            (size, blocks)
        };
        let mut count = MOST;
        let (mut size, mut blocks): (usize, Vec<Block<D>>) = cut(count);
        while count > 1 && blocks.iter().map(|block| block.forces.len()).sum::<usize>() > REPEATED * pages {
            count /= 2;
            (size, blocks) = cut(count);
        }
        let mut offsets = vec![0; pages + 1];
        blocks.iter().flat_map(Block::pages).for_each(|(page, _)| offsets[page + 1] += 1);
        for page in 0..pages {
            offsets[page + 1] += offsets[page];
        }
        let (mut next, mut reached) = (offsets.clone(), vec![(0, 0); offsets[pages] as usize]);
        for (block, number) in blocks.iter().zip(0..) {
            for (page, place) in block.pages() {
                reached[next[page] as usize] = (number, place);
                next[page] += 1;
            }
        }
        Self { size, blocks, offsets, reached }
    }

    /// Accelerations, and `J̇` unless that is empty.
    pub(super) fn rates(&mut self, first: &First<'_, D>, velocity_rate: &mut [f64], ratio_rate: &mut [f64]) {
        let arch = first.model.rates.arch;
        if ratio_rate.is_empty() {
            self.blocks.par_iter_mut().for_each(|block| arch.dispatch(Sweep { first, block, rates: &mut [] }));
        } else {
            let blocks = self.blocks.par_iter_mut().zip(ratio_rate.par_chunks_mut(self.size));
            blocks.for_each(|(block, rates)| arch.dispatch(Sweep { first, block, rates }));
        }
        let (space, model) = (&*self, first.model);
        velocity_rate.par_chunks_mut(PAGE * D).enumerate().for_each(|(page, rates)| {
            let start = page * PAGE;
            let mut forces = space.sum(page);
            if !model.accelerations(start..start + rates.len() / D, &mut forces, rates) {
                first.flag.raise(start);
            }
            model.still(start * D, rates);
        });
    }

    /// Forces on the particles of a page.
    fn sum(&self, page: usize) -> [[f64; D]; PAGE] {
        let mut sums = [[0.0; D]; PAGE];
        for &(block, place) in &self.reached[self.offsets[page] as usize..self.offsets[page + 1] as usize] {
            let forces = &self.blocks[block as usize].forces[place as usize];
            for (sum, force) in sums.as_flattened_mut().iter_mut().zip(forces.as_flattened()) {
                *sum += force;
            }
        }
        sums
    }
}

/// The sweep over a block, compiled once for every set of vector instructions.
struct Sweep<'a, 'b, const D: usize> {
    first: &'b First<'a, D>,
    block: &'b mut Block<D>,
    /// `J̇` of the block, or empty.
    rates: &'b mut [f64],
}

impl<const D: usize> pulp::WithSimd for Sweep<'_, '_, D> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let Self { first, block, rates } = self;
        let Block { particles, first: first_page, places, forces } = block;
        let gradient = &first.model.gradient;
        let with_velocity = first.needs_velocity_gradient();
        forces.fill([[0.0; D]; PAGE]);
        for (at, b) in particles.clone().enumerate() {
            let by_displacement = gradient.columns_of(b, first.displacement);
            let by_velocity = if with_velocity { gradient.columns_of(b, first.velocity) } else { [[0.0; D]; D] };
            let Some((stress, rate)) = first.law(b, by_displacement, by_velocity) else {
                first.flag.raise(b);
                return;
            };
            if let Some(out) = rates.get_mut(at) {
                *out = rate;
            }
            for (&a, weight) in gradient.neighbourhood.of(b).iter().zip(gradient.weights_of(b)) {
                let a = a as usize;
                let place = places[a / PAGE - *first_page] as usize;
                let force = &mut forces[place][a % PAGE];
                for d in 0..D {
                    for i in 0..D {
                        force[i] += weight[d] * stress[(i, d)];
                    }
                }
            }
        }
    }
}
