//! The number of threads changes nothing (issue, point 10): with 1, 2 and 3 threads `history.csv`,
//! `probes.csv` and the last VTU file are the same bytes.
//!
//! Bytes and not digits: one sum that was added up in another order would show. The clouds are large
//! enough that every sweep is really split (pieces hold 128 particles): 1089 or 1681 in two dimensions, 1701
//! in three.
#![allow(clippy::print_stdout, reason = "the table is for people")]

#[path = "support/trajectory.rs"]
#[allow(dead_code, reason = "every test file uses its own part of this module")]
mod trajectory;

use std::fs;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use nicolson::output::Status;
use nicolson::simulation::{RunOptions, Silent, run};
use trajectory::example;

/// Files that must not depend on the threads.
fn results(directory: &Path) -> Vec<(String, Vec<u8>)> {
    let mut names: Vec<String> = fs::read_dir(directory)
        .expect("a directory")
        .map(|entry| entry.expect("an entry").file_name().into_string().expect("a name"))
        .filter(|name| name.ends_with(".csv") || name.ends_with(".vtu") || name.ends_with(".pvd"))
        .collect();
    names.sort();
    names.into_iter().map(|name| (name.clone(), fs::read(directory.join(&name)).expect("a file"))).collect()
}

fn check(case: &str, scene: &str, overrides: &[(&str, &str)]) {
    let without_plots = [overrides, &[("output.plots", "false")]].concat();
    let scene = example(scene, &without_plots);
    let mut first: Option<Vec<(String, Vec<u8>)>> = None;
    for threads in [1, 2, 3] {
        let directory = tempfile::tempdir().expect("a directory");
        let options = RunOptions { directory: Some(directory.path().to_owned()), ..RunOptions::default() };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        let outcome = pool
            .install(|| run(&scene, &options, &mut Silent, &AtomicBool::new(false)))
            .unwrap_or_else(|e| panic!("{case}: {e}"));
        let report = &outcome.report;
        assert_eq!(report.status, Status::Completed, "{case}: {:?}", report.message);
        assert_eq!(report.provenance.threads, threads);
        assert!(report.particles > 1000, "{case}: {} particles are too few to be shared out", report.particles);
        let found = results(directory.path());
        let names: Vec<&str> = found.iter().map(|(name, _)| name.as_str()).collect();
        assert!(names.contains(&"history.csv") && names.contains(&"fields-00001.vtu"), "{case}: {names:?}");
        match &first {
            None => {
                println!(
                    "{case}: {} particles, {} unknowns, {} steps, {} Newton and {} linear iterations, {} files",
                    report.particles,
                    report.unknowns,
                    report.steps.accepted,
                    report.newton.iterations,
                    report.linear.iterations,
                    found.len()
                );
                first = Some(found);
            }
            Some(first) => {
                for ((name, bytes), (_, expected)) in found.iter().zip(first) {
                    assert!(bytes == expected, "{case}: {name} with {threads} threads differs from that with one");
                }
                assert_eq!(found.len(), first.len());
            }
        }
    }
}

/// 41 × 41 particles for three steps of the scene's Courant number.
const DAM: [(&str, &str); 3] = [("body.0.spacing", "0.0625"), ("time.step", "0.0025"), ("time.end", "0.0075")];

#[test]
fn implicit_with_velocity_upwinding() {
    check("implicit, D_v", "dam-break", &DAM);
}

#[test]
fn implicit_with_pressure_upwinding() {
    // {v, J} is half as large again, and its factor several times: a coarser cloud and two steps.
    let more = [
        ("body.0.spacing", "0.078125"),
        ("time.step", "0.003"),
        ("time.end", "0.006"),
        ("stabilisation.tau_p", "0.2"),
        ("newton.unknowns", "velocity_jacobian"),
    ];
    check("implicit, D_v and D_p", "dam-break", &more);
}

#[test]
fn implicit_with_gmres() {
    for preconditioner in ["block_jacobi", "ilu0"] {
        let more = [("linear.solver", "gmres"), ("linear.preconditioner", preconditioner)];
        check(&format!("implicit, GMRES, {preconditioner}"), "dam-break", &[&DAM[..], &more].concat());
    }
}

#[test]
fn explicit() {
    let explicit = [
        ("body.0.spacing", "0.0625"),
        ("time", "{ scheme = \"tvd_rk2\", cfl = 0.3, end = 0.02 }"),
        ("output.interval", "0.01"),
    ];
    check("explicit", "dam-break", &explicit);
}

#[test]
fn explicit_in_three_dimensions_with_pressure_upwinding() {
    let explicit = [
        ("body.0.spacing", "0.125"),
        ("time", "{ scheme = \"tvd_rk2\", cfl = 0.3, end = 0.005 }"),
        ("output.interval", "0.005"),
        ("stabilisation", "{ tau_v = 0.5, tau_p = 0.2, wave_speed = \"deformed\" }"),
    ];
    check("explicit, 3D", "block-piston", &explicit);
}

#[test]
fn implicit_in_three_dimensions() {
    check(
        "implicit, 3D",
        "block-piston",
        &[("body.0.spacing", "0.125"), ("time.end", "0.01"), ("output.interval", "0.01")],
    );
}
