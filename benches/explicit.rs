//! The explicit path against the memory: rate, step and set-up, from a thousand to a million particles.
//!
//! `cargo bench --bench explicit [-- LARGEST]`. The yardstick is the bandwidth of a triad `a = b + s c` in the same
//! process with the same number of threads, 24 bytes an entry. Bytes of a rate are those that no order of loops can
//! avoid: every table read once, every field read or written once, what is gathered from neighbours counted once per
//! particle. Rows that a lattice repeats are no bytes: only the others are counted. All figures are the smallest of
//! several; shares of bandwidth mean something only while nothing else uses the memory.
//!
//! Measured (AVX2, one thread on one of two cores, the other busy; triad 29 to 36 GB/s; ns per particle and rate):
//!
//! | | neighbours | 10³ | 10⁴ | 10⁵ | 10⁶ | share of the triad at 10⁶ | set-up in steps at 10⁶ |
//! |---|---|---|---|---|---|---|---|
//! | 2D lattice, linear law | 21 | 35 | 26 | 26 | 28 | 16 to 20 % of 162 B | 18 |
//! | 2D lattice, hyperelastic | 21 | 38 | 28 | 27 | 28 | 16 to 20 % of 162 B | 12 |
//! | 3D lattice, linear law | 57 | 183 | 175 | 177 | 136 | 7 to 9 % of 335 B | 22 |
//! | 2D perturbed | 21 | 63 | 61 | 64 | 63 | 26 to 32 % of 580 B | 11 |
//! | 3D perturbed | 57 | 199 | 251 | 271 | 300 | 18 to 23 % of 1990 B | 23 |
//!
//! Growth from 10³ to 10⁶: n^0.97 and n^0.96 on lattices, n^1.00 and n^1.06 on perturbed ones. Two threads at 10⁶ (both cores
//! quiet): 1.9 times in 2D, 1.8 in 3D. Sharing rows took away most of the bytes (from 580 and 1990), so that a rate is bound by
//! arithmetic: 57 neighbours cost 2050 multiplications and additions, 15 a nanosecond, half of what the vector units can do
//! without fused multiply-add, which would round differently from machine to machine. Half of the triad would be 20 ns.
//! The sweeps of `model::evaluation`, which store all of a `Point`, took 590 (2D) and 1540 ns (3D) at 10³ without LTO.
//!
//! Perturbed lattices took 250 and 1400 ns at 10⁶, n^1.17 and n^1.27, while forces were gathered: `g_ba` lies in the row of
//! another particle, so that the table came from memory many times over, a piece at a time. Adding `T_b g_ba` to the neighbours
//! of b instead, while its row is in the cache (`model::one_sweep`), is worth 4.0 and 4.7 times.
//!
//! Tried and lost: numbering perturbed lattices along a Z curve instead of line by line (processor time on a busy machine, quick
//! build: 2D, 10⁵: 240 ns before, 275 after; 3D, 10⁴ and 10⁵: 870 and 1046 before, 663 and 1027 after): lines are near enough
//! to each other, and are what the processor reads ahead. Only lists without any order are renumbered. Closures given to `pulp::Arch::dispatch` (what calls them is not inlined, and the loops were scalar:
//! five times slower); iterators instead of indices in the innermost loops. Quick builds (`lto = "off"`, many units) do
//! not inline across units, and measure nothing: use the release profile as it is, or one codegen unit.
#![allow(clippy::print_stdout, reason = "a bench reports on the terminal")]

#[path = "shared/clock.rs"]
mod clock;

use std::error::Error;
use std::path::Path;

use clock::smallest;
use nicolson::model::Model;
use nicolson::scene::Scene;
use nicolson::simulation::prepare;
use nicolson_solvers::time::System;
use rayon::prelude::*;

/// Bytes per second of a triad far beyond the caches, on the present pool.
fn triad() -> f64 {
    let n = 1 << 24;
    let (mut a, b, c) = (vec![0.0_f64; n], vec![1.0_f64; n], vec![2.0_f64; n]);
    let time = smallest(5, || {
        a.par_chunks_mut(1 << 16).zip(b.par_chunks(1 << 16)).zip(c.par_chunks(1 << 16)).for_each(|((a, b), c)| {
            for ((a, b), c) in a.iter_mut().zip(b).zip(c) {
                *a = b + 3.0 * c;
            }
        });
    });
    assert!(a[n / 2] == 7.0);
    24.0 * n as f64 / time
}

/// A box of about `count` particles that is let go from a smooth motion.
fn scene(dimension: usize, count: usize, kind: Kind) -> Result<Scene, Box<dyn Error>> {
    let across = (count as f64).powf(1.0 / dimension as f64).round();
    let list = |item: &str| vec![item; dimension].join(", ");
    let perturb = if kind == Kind::Perturbed { "perturb = { amount = 0.1 }" } else { "" };
    let law = match kind {
        Kind::Hyperelastic => "hyperelastic_volumetric = { density = 1000.0, gamma = 7.0, wave_speed = 10.0 }",
        _ => "linear_volumetric = { density = 1000.0, bulk_modulus = 1e5 }",
    };
    let velocity = ["\"0.1*sin(3*X)\"", "\"0.1*cos(2*X)*Y\"", "\"0.05*Z*Y\""][..dimension].join(", ");
    let text = format!(
        "title = \"bench\"\ndimension = {dimension}\n[[body]]\nname = \"block\"\n\
         shape.box = {{ lower = [{}], upper = [{}] }}\ncounts = [{}]\nlayout = \"vertex\"\nsmoothing = 1.2\n{perturb}\n\
         weights = \"separate\"\nmaterial.{law}\n[initial]\nvelocity = [{velocity}]\n\
         [time]\nscheme = \"tvd_rk2\"\nstep = {}\nend = 1.0\n[output]\nhistory = false\nplots = false\n",
        list("0.0"),
        list("1.0"),
        list(&format!("{across}")),
        0.2 / across / 10.0,
    );
    Ok(Scene::parse(&text, "bench", Path::new("."), &[])?)
}

#[derive(Clone, Copy, PartialEq, Debug)]
enum Kind {
    Lattice,
    Hyperelastic,
    Perturbed,
}

/// Bytes that a rate cannot avoid.
///
/// The rows of particles outside runs are taken as of mean length.
fn compulsory<const D: usize>(model: &Model<D>) -> f64 {
    let rows = model.gradient().neighbourhood.len() as f64;
    let [own, _] = model.gradient().in_runs();
    // u, v, J in; stress out and in, where there are two sweeps; volume and mass; rates of all three out.
    let stress = if own > 0 { 2 * D * D } else { 0 };
    let fields = 8 * ((2 * D + 1) + stress + 2 + (2 * D + 1));
    let listed = 1.0 - own as f64 / rows;
    rows * fields as f64 + listed * (model.gradient().neighbourhood.pairs() * (4 + 8 * D)) as f64 + listed * 4.0 * rows
}

/// What one size of one kind costs, per particle.
struct Cost {
    particles: usize,
    rate: f64,
    step: f64,
    setup: f64,
    bytes: f64,
}

fn cost<const D: usize>(count: usize, kind: Kind) -> Result<Cost, Box<dyn Error>> {
    let scene = scene(D, count, kind)?;
    let mut prepared = prepare::<D>(&scene)?;
    let mut failed = false;
    let setup = smallest((200_000 / count).clamp(1, 10), || failed |= prepare::<D>(&scene).is_err());
    let (model, state) = (&mut prepared.model, &mut prepared.state);
    let mut rate = vec![0.0; state.values.len()];
    let repetitions = (4_000_000 / model.particles()).clamp(8, 200);
    model.rate(0.0, &state.values, &mut rate)?;
    let rate = smallest(repetitions, || model.rate(0.0, &state.values, &mut rate).unwrap_or_default());
    failed |= prepared.stepper.advance(model, state, prepared.end).is_err();
    let step = smallest(repetitions, || failed |= prepared.stepper.advance(model, state, prepared.end).is_err());
    assert!(!failed);
    let bytes = compulsory(model);
    Ok(Cost { particles: model.particles(), rate, step, setup, bytes })
}

fn report<const D: usize>(largest: usize, kind: Kind, bandwidth: f64) -> Result<Cost, Box<dyn Error>> {
    let mut costs = Vec::new();
    let mut count = 1000;
    while count <= largest {
        let cost = cost::<D>(count, kind)?;
        let n = cost.particles as f64;
        println!(
            "{D}D {kind:?} {n:>8}: rate {:7.2} ns/particle, step {:5.2} rates, set-up {:6.1} steps, {:5.0} B/particle, {:4.1} % of the triad",
            1e9 * cost.rate / n,
            cost.step / cost.rate,
            cost.setup / cost.step,
            cost.bytes / n,
            100.0 * cost.bytes / cost.rate / bandwidth,
        );
        costs.push(cost);
        count *= 10;
    }
    let (first, last) = (&costs[0], &costs[costs.len() - 1]);
    if costs.len() > 1 {
        let exponent = (last.rate / first.rate).ln() / (last.particles as f64 / first.particles as f64).ln();
        println!("{D}D {kind:?}: cost grows as n^{exponent:.3}");
    }
    costs.pop().ok_or_else(|| "no size".into())
}

fn main() -> Result<(), Box<dyn Error>> {
    let largest = std::env::args().skip(1).find_map(|a| a.parse::<f64>().ok()).unwrap_or(1e6) as usize;
    let mut one: Vec<Cost> = Vec::new();
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
        let outcome = pool.install(|| -> Result<Vec<Cost>, String> {
            let bandwidth = triad();
            println!("{threads} thread(s): triad {:.1} GB/s", 1e-9 * bandwidth);
            let mut costs = Vec::new();
            for kind in [Kind::Lattice, Kind::Hyperelastic, Kind::Perturbed] {
                costs.push(report::<2>(largest, kind, bandwidth).map_err(|e| e.to_string())?);
                costs.push(report::<3>(largest, kind, bandwidth).map_err(|e| e.to_string())?);
            }
            Ok(costs)
        })?;
        for (before, now) in one.iter().zip(&outcome) {
            println!(
                "{threads} threads over 1, {} particles: rate {:.2}, step {:.2}",
                now.particles,
                before.rate / now.rate,
                before.step / now.step
            );
        }
        one = outcome;
    }
    Ok(())
}
