//! The matrix-free path: cost of a tangent action, iterations of the preconditioners, memory, and whole steps.
//!
//! `cargo bench --bench matrix_free -- costs|iterations|steps|growth [2|3] [PARTICLES…] [LAW] [SOLVER…]`, for example
//! `… -- iterations 3 10000 100000 "mg 4,0"`; `SMOOTHING` (1.2) and `THREADS` (1) in the environment.
//!
//! Solvers: `jacobi` is CG with block Jacobi, `near` GMRES with ILU(0) of the one-ring part, `mg H,k` CG with multigrid on
//! a finest lattice of H particle spacings with k terms of the smoother (2k + 1 products an iteration), 0: additive.
//!
//! Iterations to 1e-3 / 1e-8 with r times the critical step `2/ω_max`, clamped block of 4096 particles in 3D, St
//! Venant–Kirchhoff, ν = 0.3, h = 1.2 Δx, body force with 10 % noise (and the cost of both solves in rates at r = 1000):
//!
//! | | r = 1 | 5 | 20 | 100 | 1000 | rates |
//! |---|---|---|---|---|---|---|
//! | jacobi | 4/10 | 16/41 | 44/109 | 58/137 | 59/140 | 28, 66 |
//! | **mg 4,0** | 3/11 | 8/27 | 15/38 | 17/40 | 17/41 | 8, 18 |
//! | mg 4,1 | 3/11 | 4/12 | 7/17 | 8/18 | 8/18 | 13, 24 |
//! | mg 4,2 | 3/8 | 3/9 | 4/10 | 5/11 | 5/11 | 12, 28 |
//! | mg 3,1 | 2/6 | 4/12 | 5/15 | 6/17 | 6/17 | 9, 27 |
//!
//! The same with 10 648 and 97 336 particles, `mg 4,0`, on a quiet machine; in brackets the cost of the two solves in rates,
//! set-up beside it:
//!
//! | | r = 1 | 5 | 20 | 100 | 1000 | set-up |
//! |---|---|---|---|---|---|---|
//! | 10 648 | 3/11 (4, 10) | 9/29 (8, 25) | 14/40 (13, 34) | 17/44 (15, 40) | 18/45 (15, 41) | 25 to 35 |
//! | 97 336 | 3/11 (6, 17) | 8/29 (13, 44) | 13/41 (20, 62) | 16/45 (24, 72) | 18/46 (29, 73) | 40 to 50 |
//!
//! `growth` prints how iterations and costs grow from the first size to the others (default 10⁴, 10⁵, 10⁶). Measured with
//! `mg 4,0` to 1e-8, processor time of a busy machine:
//!
//! | particles | rate, ns a particle | action, rates | set-up | 20 critical steps: iterations, rates | 1000 | peak, B a particle |
//! |---|---|---|---|---|---|---|
//! | 10 648 | 1270 | 0.8 | 29 | 40, 24 | 45, 27 | 5900 |
//! | 97 336 | 730 | 0.9 | 54 | 41, 49 | 46, 56 | 3330 |
//! | 1 000 000 | 970 | 0.8 | 48 | 39, 44 | 46, 52 | 3010 |
//!
//! From the first to the last: iterations × 0.97 and × 1.02, time of a solve n^1.07 and n^1.09, action n^0.94. An iteration
//! costs 1.2 actions, the set-up some 35 to 50: `linear.solver = "auto"` counts with these.
//!
//! Memory, largest resident (`costs`, one size a process), bytes a particle with multigrid, set-up included: 97 336 particles,
//! h = 1.2 Δx: 3303, of which explicit steps need 1680; h = Δx: 2707, and 1198. Rows of weights that repeat are stored once;
//! perturbed lattices repeat nothing, and take some 1400 more.
//!
//! An iteration of CG costs half a rate, so the additive form, which needs no product of its own, wins although it takes
//! twice the iterations; it is the default. (Rates measured on a machine at ten times its load: ± 30 %.)
#![allow(clippy::print_stdout, reason = "a bench reports on the terminal")]

#[path = "shared/clock.rs"]
mod clock;

use std::path::Path;
use std::time::Instant;

use clock::{smallest, spent};
use nicolson::model::Model;
use nicolson::scene::Scene;
use nicolson_solvers::linear::{
    KrylovOptions, LinearSolverChoice, MultigridOptions, Operator, Preconditioner, PreconditionerMatrix, Tangent,
};
use nicolson_solvers::nonlinear::{Forcing, NewtonOptions, NewtonSolver, NonlinearProblem};
use nicolson_solvers::time::{Scheme, StageSystem, StepControl, Stepper, System, TimeState};
use stats_alloc::{INSTRUMENTED_SYSTEM, StatsAlloc};

#[global_allocator]
static ALLOCATOR: &StatsAlloc<std::alloc::System> = &INSTRUMENTED_SYSTEM;

type Failure = Box<dyn std::error::Error>;

/// Bytes that are in use.
fn in_use() -> f64 {
    let stats = ALLOCATOR.stats();
    stats.bytes_allocated as f64 - stats.bytes_deallocated as f64
}

/// Largest resident memory of this process so far, bytes.
fn peak() -> f64 {
    let text = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = text.lines().find(|line| line.starts_with("VmHWM"));
    line.and_then(|l| l.split_whitespace().nth(1)?.parse::<f64>().ok()).unwrap_or(f64::NAN) * 1024.0
}

/// A cantilever (2D, 8 : 1) or a block clamped at its base (3D), of about as many particles as asked.
fn scene(dimension: usize, particles: f64, law: &str, smoothing: f64) -> Result<Scene, Failure> {
    let (counts, box_, fix) = if dimension == 2 {
        let across = (particles / 8.0).sqrt().round() as usize;
        (format!("[{}, {}]", 8 * across, across), "lower = [0.0, 0.0], upper = [8.0, 1.0]", "\"x\", \"y\"")
    } else {
        let across = particles.cbrt().round() as usize;
        let box_ = "lower = [0.0, 0.0, 0.0], upper = [1.0, 1.0, 1.0]";
        (format!("[{across}, {across}, {across}]"), box_, "\"x\", \"y\", \"z\"")
    };
    let gravity = if dimension == 2 { "[0.0, -0.1]" } else { "[0.0, -10.0, 0.0]" };
    let face = if dimension == 2 { "lower_x" } else { "lower_z" };
    let text = format!(
        "title = \"bench\"\ndimension = {dimension}\ngravity = {gravity}\n[[body]]\nname = \"body\"\ncounts = {counts}\n\
         layout = \"vertex\"\nsmoothing = {smoothing}\nweights = \"separate\"\nshape.box = {{ {box_} }}\n\
         material.{law} = {{ density = 1000.0, youngs_modulus = 1e6, poissons_ratio = 0.3 }}\n[[boundary]]\n\
         select.face = \"{face}\"\nfix = [{fix}]\n[time]\nend = 1.0\nstep = 0.1\n"
    );
    Ok(Scene::parse(&text, "bench", Path::new("."), &[]).map_err(|e| e.to_string())?)
}

fn model<const D: usize>(particles: f64, law: &str, smoothing: f64) -> Result<Model<D>, Failure> {
    let (setup, _) = scene(D, particles, law, smoothing)?.setup::<D>().map_err(|e| e.to_string())?;
    Ok(Model::new(setup, None, None)?)
}

/// Poses the stage of a Crank–Nicolson step at the state and linearises at zero velocities.
fn linearise<const D: usize>(model: &mut Model<D>, state: &[f64], step: f64) -> Result<(), Failure> {
    model.begin_stage(0.0, 0.5 * step, state);
    let y = vec![0.0; model.unknown_count()];
    Ok(model.linearise(&y)?)
}

/// Particle of every unknown.
fn owners<const D: usize>(model: &Model<D>) -> Vec<usize> {
    model.blocks().windows(2).enumerate().flat_map(|(a, b)| vec![a; b[1] - b[0]]).collect()
}

/// Critical step `2/ω` by the power method, s.
fn critical_step<const D: usize>(model: &mut Model<D>, state: &[f64]) -> Result<f64, Failure> {
    let s = 1e-3;
    linearise(model, state, 2.0 * s)?;
    let owner = owners(model);
    let mut v: Vec<f64> = (0..owner.len()).map(|i| (i as f64 * 1.3).sin()).collect();
    let mut product = vec![0.0; v.len()];
    let mut largest = 1.0;
    for _ in 0..30 {
        let length = v.iter().map(|v| v * v).sum::<f64>().sqrt();
        v.iter_mut().for_each(|v| *v /= length);
        model.tangent().apply(&v, &mut product);
        v.iter_mut().zip(&product).zip(&owner).for_each(|((v, p), &a)| *v = p / model.masses()[a]);
        largest = v.iter().map(|v| v * v).sum::<f64>().sqrt();
    }
    Ok(2.0 * s / (largest - 1.0_f64).sqrt())
}

/// A body at rest, and what its costs are measured in.
struct Case<const D: usize> {
    model: Model<D>,
    state: Vec<f64>,
    /// Time of a rate, s.
    unit: f64,
    /// Critical step, s.
    critical: f64,
}

impl<const D: usize> Case<D> {
    fn new(particles: f64, law: &str, smoothing: f64) -> Result<Self, Failure> {
        let mut model = model::<D>(particles, law, smoothing)?;
        let state = model.initial_state()?;
        let mut rate = vec![0.0; state.len()];
        let unit = smallest(5, || model.rate(0.0, &state, &mut rate).unwrap_or_default());
        let critical = critical_step(&mut model, &state)?;
        Ok(Self { model, state, unit, critical })
    }
}

fn costs<const D: usize>(particles: f64, law: &str, smoothing: f64) -> Result<(), Failure> {
    let before = in_use();
    let mut model = model::<D>(particles, law, smoothing)?;
    let n = model.particles() as f64;
    let state = model.initial_state()?;
    let mut rate = vec![0.0; state.len()];
    model.rate(0.0, &state, &mut rate)?;
    let explicit = (in_use() - before) / n;
    let unit = smallest(10, || model.rate(0.0, &state, &mut rate).unwrap_or_default());
    let critical = critical_step(&mut model, &state)?;
    linearise(&mut model, &state, 20.0 * critical)?;
    let frozen = smallest(3, || {
        model.begin_stage(0.0, 10.0 * critical * 1.000_1, &state);
        let _ = model.linearise(&vec![0.0; model.unknown_count()]);
    });
    let v: Vec<f64> = (0..model.size()).map(|i| (i as f64).sin()).collect();
    let mut out = vec![0.0; v.len()];
    let action = smallest(10, || model.tangent().apply(&v, &mut out));
    let mut blocks = vec![0.0; model.blocks().windows(2).map(|b| (b[1] - b[0]).pow(2)).sum()];
    let diagonal = smallest(3, || model.diagonal_blocks(&mut blocks));
    drop(blocks);
    let mut found = Vec::new();
    for preconditioner in [Preconditioner::BlockJacobi, Preconditioner::Multigrid(MultigridOptions::default())] {
        let krylov = KrylovOptions { preconditioner, operator: Operator::MatrixFree, ..Default::default() };
        let mut solver = LinearSolverChoice::Cg { krylov }.build();
        let mut prepared = Ok(());
        let ready = spent(|| prepared = solver.prepare(model.tangent()));
        prepared?;
        solver.solve(model.tangent(), &v, &mut out, 1e-3)?;
        found.push((ready / unit, (in_use() - before) / n));
    }
    println!(
        "{:>3} {:>8} {:>18} {:>4} {:>6.1} {:>9.2} {:>9.2} {:>9.2} {:>9.2} {:>8.0} {:>8.0} {:>8.0} {:>8.0} {:>8.1} {:>8.1}",
        D,
        n,
        law,
        smoothing,
        model.gradient().neighbourhood.pairs() as f64 / n,
        unit / n * 1e6,
        frozen / unit,
        action / unit,
        diagonal / unit,
        explicit,
        found[0].1,
        found[1].1,
        peak() / n,
        found[0].0,
        found[1].0
    );
    Ok(())
}

fn solvers() -> Vec<(&'static str, LinearSolverChoice)> {
    let cg = |preconditioner| LinearSolverChoice::Cg {
        krylov: KrylovOptions {
            preconditioner,
            operator: Operator::MatrixFree,
            max_iterations: 3000,
            ..Default::default()
        },
    };
    let grid = |spacing, smoothing| {
        cg(Preconditioner::Multigrid(MultigridOptions { spacing, smoothing, ..Default::default() }))
    };
    let near = LinearSolverChoice::Gmres {
        restart: 50,
        krylov: KrylovOptions {
            preconditioner: Preconditioner::Ilu0,
            preconditioner_matrix: PreconditionerMatrix::Sparser,
            operator: Operator::MatrixFree,
            ..Default::default()
        },
    };
    vec![
        ("jacobi", cg(Preconditioner::BlockJacobi)),
        ("near", near),
        ("mg 4,0", grid(4.0, 0)),
        ("mg 4,1", grid(4.0, 1)),
        ("mg 4,2", grid(4.0, 2)),
        ("mg 4,3", grid(4.0, 3)),
        ("mg 3,0", grid(3.0, 0)),
        ("mg 6,0", grid(6.0, 0)),
        ("mg 3,1", grid(3.0, 1)),
        ("mg 3,2", grid(3.0, 2)),
        ("mg 6,2", grid(6.0, 2)),
        ("mg 6,3", grid(6.0, 3)),
    ]
}

fn iterations<const D: usize>(particles: f64, law: &str, smoothing: f64, only: &[String]) -> Result<(), Failure> {
    let Case { mut model, state, unit, critical } = Case::<D>::new(particles, law, smoothing)?;
    println!(
        "{D}D {} particles, {law}, h = {smoothing}; per cell: iterations to 1e-3 / 1e-8, set-up | both solves in rates",
        model.particles()
    );
    for (name, choice) in solvers().into_iter().filter(|(name, _)| only.is_empty() || only.iter().any(|o| o == name)) {
        print!("{name:>8}");
        for r in [1.0, 5.0, 20.0, 100.0, 1000.0] {
            linearise(&mut model, &state, r * critical)?;
            let b = load(&model);
            let mut x = vec![0.0; b.len()];
            let mut solver = choice.build();
            let mut prepared = Ok(());
            let ready = spent(|| prepared = solver.prepare(model.tangent())) / unit;
            prepared?;
            let mut cell = String::new();
            let mut cost = Vec::new();
            for tolerance in [1e-3, 1e-8] {
                let mut outcome = None;
                let solved = spent(|| outcome = solver.solve(model.tangent(), &b, &mut x, tolerance).ok());
                match outcome {
                    Some(report) => cell += &format!("{:>5}", report.iterations),
                    None => cell += "    -",
                }
                cost.push(solved / unit);
            }
            print!(" {cell} {ready:>5.0} |{:>5.0}{:>6.0}", cost[0], cost[1]);
        }
        println!();
    }
    Ok(())
}

/// A right-hand side: a body force, with a tenth of noise.
fn load<const D: usize>(model: &Model<D>) -> Vec<f64> {
    let noise = |i: usize| ((i as f64 * 12.9898).sin() * 43758.5453).fract();
    let force = |(i, a): (usize, usize)| model.masses()[a] * (if i % D == 1 { 1.0 } else { 0.0 } + 0.1 * noise(i));
    owners(model).into_iter().enumerate().map(force).collect()
}

/// Particles, iterations to 1e-8 with multigrid, and times of rate, action and that solve per critical step, s.
struct Grown {
    particles: f64,
    rate: f64,
    action: f64,
    solves: Vec<(usize, f64)>,
}

/// Solves of [`growth`], critical steps.
const GROWTH_STEPS: [f64; 2] = [20.0, 1000.0];

fn grown<const D: usize>(particles: f64, law: &str, smoothing: f64) -> Result<Grown, Failure> {
    let Case { mut model, state, unit, critical } = Case::<D>::new(particles, law, smoothing)?;
    let n = model.particles() as f64;
    let (mut action, mut solves) = (0.0, Vec::new());
    for r in GROWTH_STEPS {
        linearise(&mut model, &state, r * critical)?;
        let b = load(&model);
        let mut x = vec![0.0; b.len()];
        action = smallest(3, || model.tangent().apply(&b, &mut x));
        let preconditioner = Preconditioner::Multigrid(MultigridOptions::default());
        let krylov = KrylovOptions { preconditioner, operator: Operator::MatrixFree, ..Default::default() };
        let mut solver = LinearSolverChoice::Cg { krylov }.build();
        let mut prepared = Ok(());
        let ready = spent(|| prepared = solver.prepare(model.tangent()));
        prepared?;
        let mut report = None;
        let solved = spent(|| report = solver.solve(model.tangent(), &b, &mut x, 1e-8).ok());
        let iterations = report.ok_or("no convergence")?.iterations;
        solves.push((iterations, solved));
        println!(
            "{D}D {n:>8} particles, {r:>5} critical steps: rate {:.0} ns/particle, action {:.2} rates, set-up {:.0}, \
             {iterations} iterations to 1e-8 in {:.0} rates, {:.0} B/particle at most",
            1e9 * unit / n,
            action / unit,
            ready / unit,
            solved / unit,
            peak() / n,
        );
    }
    Ok(Grown { particles: n, rate: unit, action, solves })
}

/// How iterations and costs grow from the first size to each of the others.
fn growth<const D: usize>(sizes: &[f64], law: &str, smoothing: f64) -> Result<(), Failure> {
    let mut first: Option<Grown> = None;
    for &size in sizes {
        let now = grown::<D>(size, law, smoothing)?;
        let Some(first) = &first else {
            first = Some(now);
            continue;
        };
        let exponent = |from: f64, to: f64| (to / from).ln() / (now.particles / first.particles).ln();
        println!(
            "from {} to {}: rate n^{:.2}, action n^{:.2}",
            first.particles,
            now.particles,
            exponent(first.rate, now.rate),
            exponent(first.action, now.action)
        );
        for ((r, before), after) in GROWTH_STEPS.iter().zip(&first.solves).zip(&now.solves) {
            let ratio = after.0 as f64 / before.0 as f64;
            println!("  {r} critical steps: iterations x {ratio:.2}, solve n^{:.2}", exponent(before.1, after.1));
        }
    }
    Ok(())
}

fn steps<const D: usize>(particles: f64, law: &str, smoothing: f64, only: &[String]) -> Result<(), Failure> {
    let Case { mut model, state, unit, critical } = Case::<D>::new(particles, law, smoothing)?;
    println!(
        "{D}D {} particles, {law}: five Crank-Nicolson steps of 20 critical ones; rates per step, Newton and linear iterations",
        model.particles()
    );
    for (name, choice) in solvers().into_iter().filter(|(name, _)| only.is_empty() || only.iter().any(|o| o == name)) {
        for (label, forcing, tolerance) in [
            ("EW2, 1e-4", Forcing::eisenstat_walker_2(), 1e-4),
            ("EW2, 1e-6", Forcing::eisenstat_walker_2(), 1e-6),
            ("EW2, 1e-8", Forcing::eisenstat_walker_2(), 1e-8),
            ("1e-2, 1e-4", Forcing::Constant(1e-2), 1e-4),
            ("1e-3, 1e-6", Forcing::Constant(1e-3), 1e-6),
        ] {
            let options = NewtonOptions { forcing, relative_tolerance: tolerance, ..NewtonOptions::default() };
            let newton = NewtonSolver::new(options, choice.build());
            let mut stepper =
                Stepper::new(Scheme::CrankNicolson, StepControl::Fixed { step: 20.0 * critical }, Some(newton))?;
            let mut now = TimeState::new(0.0, state.clone());
            print!("{name:>8} {label:>12}:");
            for _ in 0..5 {
                let start = Instant::now();
                let counts = |stepper: &Stepper| {
                    let linear = stepper.newton().map(|newton| newton.linear().counts());
                    linear.map_or((0, 0), |counts| (counts.solves, counts.iterations))
                };
                let before = counts(&stepper);
                stepper.advance(&mut model, &mut now, f64::INFINITY).map_err(|e| e.to_string())?;
                let cost = start.elapsed().as_secs_f64() / unit;
                let after = counts(&stepper);
                print!("  {cost:>6.0} {:>2} {:>3}", after.0 - before.0, after.1 - before.1);
            }
            println!();
        }
    }
    Ok(())
}

fn main() -> Result<(), Failure> {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let what = arguments.first().map_or("costs", String::as_str);
    let numbers: Vec<f64> = arguments.iter().filter_map(|a| a.parse().ok()).collect();
    let dimension = numbers.first().copied().unwrap_or(3.0);
    let sizes = if numbers.len() > 1 { numbers[1..].to_vec() } else { vec![1e4] };
    let text = |a: &&String| a.parse::<f64>().is_err() && a.as_str() != what;
    let laws: Vec<String> = arguments.iter().filter(text).filter(|a| a.contains('_')).cloned().collect();
    let law = laws.first().map_or("st_venant_kirchhoff", String::as_str).to_owned();
    let only: Vec<String> = arguments.iter().filter(text).filter(|a| !a.contains('_')).cloned().collect();
    let smoothing = std::env::var("SMOOTHING").ok().and_then(|s| s.parse().ok()).unwrap_or(1.2);
    let threads = std::env::var("THREADS").ok().and_then(|s| s.parse().ok()).unwrap_or(1);
    if what == "costs" {
        println!(
            "{:>3} {:>8} {:>18} {:>4} {:>6} {:>9} {:>9} {:>9} {:>9} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8}",
            "D",
            "n",
            "law",
            "h",
            "pairs",
            "rate us/n",
            "linear.",
            "action",
            "diagonal",
            "B expl.",
            "B Jacobi",
            "B grid",
            "B peak",
            "Jacobi",
            "grid"
        );
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
    pool.install(|| {
        if what == "growth" {
            let sizes = if numbers.len() > 1 { &sizes[..] } else { &[1e4, 1e5, 1e6] };
            let outcome = match dimension as usize {
                2 => growth::<2>(sizes, &law, smoothing),
                _ => growth::<3>(sizes, &law, smoothing),
            };
            return outcome.map_err(|e| e.to_string());
        }
        sizes.iter().try_for_each(|&size| {
            let outcome = match (what, dimension as usize) {
                ("costs", 2) => costs::<2>(size, &law, smoothing),
                ("costs", _) => costs::<3>(size, &law, smoothing),
                ("iterations", 2) => iterations::<2>(size, &law, smoothing, &only),
                ("iterations", _) => iterations::<3>(size, &law, smoothing, &only),
                (_, 2) => steps::<2>(size, &law, smoothing, &only),
                (_, _) => steps::<3>(size, &law, smoothing, &only),
            };
            outcome.map_err(|e| e.to_string())
        })
    })?;
    Ok(())
}
