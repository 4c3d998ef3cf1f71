//! A run that goes on from a checkpoint is the run that never ended, to the last bit: every file, every count, for every
//! scheme, tangent policy and linear solver, whatever the number of threads of either part.
//!
//! Each case runs once without checkpoints and once with one after every step, which must change nothing; then from
//! several of these checkpoints into other directories, which must end as the first.
#![allow(clippy::print_stdout, reason = "the tables are for people")]

#[path = "restart/files.rs"]
mod files;
#[path = "restart/kill.rs"]
mod kill;
#[path = "restart/readers.rs"]
mod readers;
#[path = "restart/refusals.rs"]
mod refusals;
#[path = "restart/support.rs"]
mod support;

use support::{Case, check};

const IMPLICIT: [&str; 8] = [
    "crank_nicolson",
    "theta",
    "backward_euler",
    "midpoint",
    "tr_bdf2",
    "sdirk3",
    "generalised_alpha",
    "energy_momentum",
];
const POLICIES: [&str; 5] = ["full", "modified", "lagged", "lbfgs", "broyden"];

/// Linear solvers and their preconditioners.
const SOLVERS: [(&str, &str); 9] = [
    ("auto", "block_jacobi"),
    ("lu", ""),
    ("ldlt", ""),
    ("cholesky", ""),
    ("gmres", "ilut"),
    ("bicgstab", "symmetric_part"),
    ("cg", "jacobi"),
    ("cg", "multigrid"),
    ("minres", "block_jacobi"),
];

#[test]
fn implicit_schemes_with_every_tangent_policy() {
    for scheme in IMPLICIT {
        for policy in POLICIES {
            check(&Case::solid(scheme).newton("tangent", policy));
        }
    }
}

#[test]
fn linear_solvers_with_fresh_and_old_tangents() {
    for scheme in ["crank_nicolson", "sdirk3"] {
        for policy in ["full", "lagged"] {
            for solver in SOLVERS {
                check(&Case::solid(scheme).newton("tangent", policy).solver(solver));
            }
        }
    }
}

/// Every scheme with every policy and every solver; half a minute.
#[test]
fn the_whole_matrix() {
    for scheme in IMPLICIT.into_iter().chain(["static"]) {
        for policy in POLICIES {
            for solver in SOLVERS {
                // Its tangent is not symmetric, which these refuse.
                if scheme == "energy_momentum" && matches!(solver.0, "ldlt" | "cholesky" | "cg" | "minres") {
                    continue;
                }
                check(&Case::solid(scheme).newton("tangent", policy).solver(solver));
            }
        }
    }
}

#[test]
fn preconditioners_and_operators() {
    for preconditioner in ["none", "jacobi", "block_jacobi", "multigrid", "ilu0", "ilut", "one_ring", "symmetric_part"]
    {
        check(&Case::solid("crank_nicolson").newton("tangent", "modified").solver(("gmres", preconditioner)));
    }
    for operator in ["assembled", "matrix_free"] {
        let case = Case::solid("midpoint").newton("tangent", "lagged").solver(("gmres", "block_jacobi"));
        check(&case.set("linear.operator", &format!("\"{operator}\"")));
    }
    let case = Case::solid("crank_nicolson").newton("tangent", "lagged").newton("forcing", "eisenstat_walker_1");
    check(&case.solver(("cg", "multigrid")));
}

#[test]
fn line_searches() {
    for search in ["none", "more_thuente", "hager_zhang", "trust_region"] {
        check(&Case::solid("backward_euler").newton("line_search", search).newton("tangent", "modified"));
    }
}

#[test]
fn explicit_schemes_and_their_step_control() {
    for scheme in ["forward_euler", "tvd_rk2", "tvd_rk3", "rk4", "rkc", "velocity_verlet"] {
        check(&Case::fluid(scheme).set("time.step", "1e-3"));
        check(&Case::fluid(scheme).without("time.step").set("time.cfl", "0.2"));
        check(&Case::fluid(scheme).set("time.step", "1e-3").set("time.adaptive", "{ tolerance = 1e-3 }"));
    }
    check(&Case::fluid("rkc").set("time.step", "4e-3").set("time.rkc_stages", "\"courant\""));
}

#[test]
fn implicit_step_control_and_rejected_steps() {
    for scheme in IMPLICIT {
        check(&Case::solid(scheme).set("time.adaptive", "{ tolerance = 1e-3 }").newton("tangent", "lagged"));
        check(&Case::solid(scheme).set("time.effort", "{ few = 2, many = 3, growth = 1.2, cut = 0.5 }"));
    }
    // So few iterations are allowed that steps fail and are cut.
    let case = Case::solid("crank_nicolson").set("newton.max_iterations", "2").set("time.step", "0.04");
    let rejected = check(&case);
    assert!(rejected > 0, "no step was rejected");
}

#[test]
fn statics() {
    for policy in POLICIES {
        for ramp in ["true", "false"] {
            check(&Case::solid("static").set("time.ramp", ramp).newton("tangent", policy));
        }
    }
    check(&Case::solid("static").set("time.effort", "{ few = 3 }"));
}

#[test]
fn equations_that_are_linear_keep_their_one_factor() {
    for scheme in ["crank_nicolson", "midpoint", "tr_bdf2", "generalised_alpha", "energy_momentum", "static"] {
        for solver in [("auto", "block_jacobi"), ("ldlt", ""), ("lu", ""), ("cg", "block_jacobi")] {
            check(&Case::linear(scheme).solver(solver));
        }
    }
}

#[test]
fn fluids_with_upwinding_and_all_unknowns() {
    for scheme in ["crank_nicolson", "sdirk3", "energy_momentum"] {
        check(&Case::fluid(scheme).set("time.step", "0.01").set("stabilisation", "{ tau_v = 0.5 }"));
    }
    for unknowns in ["velocity_jacobian", "full"] {
        for solver in [("auto", "block_jacobi"), ("lu", ""), ("gmres", "ilut")] {
            let case = Case::fluid("crank_nicolson").set("time.step", "0.01");
            let case = case.set("stabilisation", "{ tau_v = 0.5, tau_p = 0.1 }").newton("unknowns", unknowns);
            check(&case.newton("tangent", "lagged").solver(solver));
        }
    }
}

#[test]
fn moving_constraints_loads_in_time_and_a_start_from_equilibrium() {
    for scheme in ["crank_nicolson", "energy_momentum", "rk4"] {
        let case = Case::solid(scheme).without("boundary.0.fix");
        let case = case.set("boundary.0.displacement", "{ x = \"0.01*sin(20*t)\", y = 0 }");
        check(&if scheme == "rk4" { case.set("time.step", "2e-4").set("time.end", "0.004") } else { case });
    }
    check(&Case::solid("backward_euler").set("traction.0.value", "[0, \"-4e3*cos(30*t)\"]"));
    check(&Case::solid("crank_nicolson").set("initial.equilibrium", "true").newton("tangent", "lagged"));
}

#[test]
fn large_enough_for_several_threads() {
    for (scheme, policy) in [("crank_nicolson", "full"), ("energy_momentum", "lagged"), ("rk4", "full")] {
        let case = if scheme == "rk4" {
            Case::fluid(scheme).set("time.step", "1e-3").set("time.end", "0.02")
        } else {
            Case::solid(scheme)
        };
        check(&case.set("body.0.counts", "[33, 17]").newton("tangent", policy));
    }
    // Costly factors in three dimensions: the automatic solver iterates first, and turns when that has cost enough.
    check(&Case::cube("crank_nicolson", 9));
    check(
        &Case::cube("backward_euler", 9).set("time.step", "0.1").set("time.end", "0.5").newton("tangent", "modified"),
    );
}
