//! What the parts of a run cost: set-up, rate, action of the tangent, assembly, factorisation, solve, a whole step; in two
//! and three dimensions, on one and two threads.
//!
//! `cargo bench --bench parts [-- FILTER]`. Criterion keeps the times of the last run and says what has changed since.
//! `layers` has ratios over a range of sizes instead, which other work on the machine disturbs less.

use std::hint::black_box;
use std::path::Path;
use std::time::Duration;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use nicolson::model::CheckPoint;
use nicolson::scene::Scene;
use nicolson::simulation::{Prepared, prepare};
use nicolson_solvers::linear::{LinearSolver, SparseLu, StoredTangent, Tangent};
use nicolson_solvers::nonlinear::NonlinearProblem;
use nicolson_solvers::time::{StageSystem, System};

/// Threads of the pools.
const THREADS: [usize; 2] = [1, 2];

fn scene(name: &str, overrides: &[(&str, &str)]) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples").join(name);
    let overrides: Vec<_> = overrides.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
    Scene::read(&path, &overrides).unwrap_or_else(|errors| panic!("{errors}"))
}

fn prepared<const D: usize>(scene: &Scene) -> Prepared<D> {
    prepare(scene).unwrap_or_else(|error| panic!("{error}"))
}

/// All parts of a scene.
fn parts<const D: usize>(criterion: &mut Criterion, name: &str, scene: &Scene) {
    let mut group = criterion.benchmark_group(name);
    group.sample_size(10).warm_up_time(Duration::from_millis(300)).measurement_time(Duration::from_secs(2));
    for threads in THREADS {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap_or_else(|e| panic!("{e}"));
        let id = |part: &str| BenchmarkId::new(part, format!("{threads} threads"));
        group.bench_function(id("set-up"), |b| pool.install(|| b.iter(|| prepared::<D>(scene))));

        let Prepared { mut model, state, .. } = prepared::<D>(scene);
        let mut rate = vec![0.0; state.values.len()];
        group.bench_function(id("rate"), |b| {
            pool.install(|| b.iter(|| model.rate(0.0, black_box(&state.values), &mut rate)));
        });

        let at = model.check_point(0.0, 0.01, &state.values, 0.02, 1).unwrap_or_else(|e| panic!("{e}"));
        let CheckPoint { time, shift, base, unknowns, .. } = at;
        model.begin_stage(time, shift, &base);
        let mut residual = vec![0.0; unknowns.len()];
        let _ = model.residual(&unknowns, &mut residual);
        let mut values = vec![0.0; model.pattern_entries()];
        group.bench_function(id("assembly"), |b| {
            pool.install(|| {
                b.iter(|| {
                    let done = model.linearise(black_box(&unknowns));
                    model.fill(&mut values);
                    done
                });
            });
        });
        let mut image = vec![0.0; unknowns.len()];
        group.bench_function(id("action"), |b| {
            pool.install(|| b.iter(|| model.tangent().apply(black_box(&residual), &mut image)));
        });
        let symmetry = Tangent::symmetry(&model);
        let Some(stored) = model.pattern().map(|pattern| StoredTangent::new(pattern, values.clone(), symmetry)) else {
            panic!("the tangent has entries")
        };
        let mut solver = SparseLu::new();
        group.bench_function(id("factorisation"), |b| pool.install(|| b.iter(|| solver.prepare(black_box(&stored)))));
        group.bench_function(id("solve"), |b| {
            pool.install(|| b.iter(|| solver.solve(&stored, black_box(&residual), &mut image, 1e-10)));
        });

        // Steps from the same state again and again: the first one has analysed the pattern.
        let Prepared { mut model, mut stepper, state, end, .. } = prepared::<D>(scene);
        group.bench_function(id("step"), |b| {
            pool.install(|| b.iter(|| stepper.advance(&mut model, &mut state.clone(), end).map(|step| step.step)));
        });
    }
    group.finish();
}

fn all(criterion: &mut Criterion) {
    parts::<2>(criterion, "impact-hyperelastic 2D", &scene("impact-hyperelastic.toml", &[("body.0.spacing", "0.125")]));
    parts::<2>(criterion, "csm3 2D", &scene("csm3.toml", &[]));
    parts::<3>(criterion, "bending-column 3D", &scene("bending-column.toml", &[]));
}

criterion_group!(benches, all);
criterion_main!(benches);
