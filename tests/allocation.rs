//! No allocation in the step loop after the first steps of an explicit run: counted by the allocator itself, in a
//! binary of its own, because it counts for the whole process.

mod support;

use std::alloc::System;

use stats_alloc::{INSTRUMENTED_SYSTEM, Region, StatsAlloc};
use support::scenes::prepared;

#[global_allocator]
static ALLOCATOR: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

/// Allocations in ten steps, after three.
fn allocations<const D: usize>(name: &str, overrides: &[(&str, &str)]) -> usize {
    let mut prepared = prepared::<D>(name, overrides);
    let mut advance = |steps: usize| {
        for _ in 0..steps {
            prepared
                .stepper
                .advance(&mut prepared.model, &mut prepared.state, prepared.end)
                .expect("a step within the stable limit");
        }
    };
    advance(3);
    let region = Region::new(ALLOCATOR);
    advance(10);
    let change = region.change();
    change.allocations + change.reallocations
}

#[test]
fn an_explicit_step_allocates_nothing() {
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| {
            for scheme in ["forward_euler", "tvd_rk2", "tvd_rk3", "rk4", "velocity_verlet"] {
                let common = [("time.scheme", scheme), ("time.step", "0.001"), ("time.end", "1.0")];
                let with = |more: &[(&'static str, &'static str)]| [&common[..], more].concat();
                let found = allocations::<1>("bar-smooth", &with(&[]));
                assert_eq!(found, 0, "bar-smooth, {scheme}, {threads} thread(s)");
                let found = allocations::<2>("piston-hyperelastic", &with(&[("body.0.spacing", "0.05")]));
                assert_eq!(found, 0, "piston-hyperelastic, {scheme}, {threads} thread(s)");
                // Pair terms go the longer way.
                let found = allocations::<2>("impact-hyperelastic", &with(&[]));
                assert_eq!(found, 0, "impact-hyperelastic, {scheme}, {threads} thread(s)");
                let found = allocations::<3>("block-piston", &with(&[]));
                assert_eq!(found, 0, "block-piston, {scheme}, {threads} thread(s)");
            }
        });
    }
}
