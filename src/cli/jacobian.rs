//! `nicolson jacobian`: the table of Taylor remainders of a scene, and its comparison with differences.
#![allow(clippy::print_stdout, reason = "this is the command line's output")]

use std::path::Path;

use nicolson_solvers::linear::SparseMatrix;
use serde_json::{Value, json};

use super::console::complain;
use super::{DONE, FAILED, report_error};
use crate::model::{DifferenceReport, TaylorReport};
use crate::scene::Scene;
use crate::simulation::{RunError, first_tangent, prepare};

/// Perturbations of Table 6.1.
const EPSILONS: [f64; 5] = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6];

/// Differences cost evaluations of the whole residual; above this size only the Taylor test runs.
const MOST_PARTICLES_FOR_DIFFERENCES: usize = 20_000;

/// Prints the tables; exit code 3 if a derivative is wrong, or if the disk refuses the exported tangent.
pub fn jacobian(scene: &Scene, as_json: bool, export: Option<&Path>) -> u8 {
    if let Some(path) = export {
        let matrix = match scene.dimension() {
            1 => tangent::<1>(scene),
            2 => tangent::<2>(scene),
            _ => tangent::<3>(scene),
        };
        match matrix.map(|matrix| matrix.write_matrix_market(path)) {
            Ok(Ok(())) => {}
            Ok(Err(error)) => {
                complain(&format!("--export-tangent {}: {error}", path.display()));
                return FAILED;
            }
            Err(error) => return report_error(&error),
        }
    }
    let result = match scene.dimension() {
        1 => tables::<1>(scene),
        2 => tables::<2>(scene),
        _ => tables::<3>(scene),
    };
    let (taylor, differences) = match result {
        Ok(tables) => tables,
        Err(error) => return report_error(&error),
    };
    let good = taylor.iter().flat_map(|report| &report.blocks).all(|block| block.deviation(200.0) < 0.01)
        && differences.as_ref().is_none_or(|d| d.largest_error < 1e-5 && d.outside_pattern < 1e-8);
    if as_json {
        println!("{:#}", to_json(&taylor, differences.as_ref(), good));
    } else {
        print(&taylor, differences.as_ref());
    }
    if good {
        DONE
    } else {
        complain("the analytic Jacobian does not agree with the residual");
        FAILED
    }
}

type Tables = (Vec<TaylorReport>, Option<DifferenceReport>);

fn tangent<const D: usize>(scene: &Scene) -> Result<SparseMatrix, RunError> {
    first_tangent(&mut prepare::<D>(scene)?)
}

fn tables<const D: usize>(scene: &Scene) -> Result<Tables, RunError> {
    let mut prepared = prepare::<D>(scene)?;
    let model = &mut prepared.model;
    // A shift of the size that an implicit step of this scene would have, but no more than a few
    // explicit steps: the check is about derivatives, not about large steps.
    let shift = match scene.time.step {
        crate::scene::settings::StepChoice::Fixed(step) => (0.5 * step).min(5.0 * prepared.explicit_step_limit),
        crate::scene::settings::StepChoice::Cfl(_) => 0.5 * prepared.explicit_step_limit,
    };
    let outside = |error: nicolson_solvers::EvaluationError| RunError::Choice(error.to_string());
    let at = model.check_point(0.0, shift, &prepared.state.values, 0.04, 1).map_err(outside)?;
    let mut reports = Vec::new();
    for selection in model.term_selections() {
        let epsilons = EPSILONS.map(|epsilon| epsilon * model.taylor_scale());
        reports.push(model.taylor(&at, selection, &epsilons, 2).map_err(outside)?);
    }
    let differences = if model.particles() <= MOST_PARTICLES_FOR_DIFFERENCES {
        Some(model.compare_with_differences(&at).map_err(outside)?)
    } else {
        None
    };
    Ok((reports, differences))
}

fn print(taylor: &[TaylorReport], differences: Option<&DifferenceReport>) {
    for report in taylor {
        for block in &report.blocks {
            let linear = if block.is_linear() { "  (linear: the remainder is rounding)" } else { "" };
            println!("term {}, residual block {}{linear}", report.term, block.block);
            println!("  {:>8}  {:>12}  {:>12}", "ε", "‖ε‖", "‖ε‖/ε²");
            for row in &block.rows {
                println!("  {:8.0e}  {:12.4e}  {:12.4e}", row.epsilon, row.remainder, row.ratio);
            }
        }
    }
    match differences {
        Some(d) => {
            println!("{} entries against central differences ({} evaluations):", d.entries, d.evaluations);
            println!(
                "  largest error relative to its row {:.2e}, outside the pattern {:.2e}",
                d.largest_error, d.outside_pattern
            );
            if let Some(worst) = &d.worst {
                println!("  worst entry: equation of {}, with respect to {}", worst.names.0, worst.names.1);
                println!("  analytic {:.10e}, difference {:.10e}", worst.analytic, worst.difference);
            }
        }
        None => println!("too many particles for differences: Taylor remainders only"),
    }
}

fn to_json(taylor: &[TaylorReport], differences: Option<&DifferenceReport>, good: bool) -> Value {
    let blocks: Vec<Value> = taylor
        .iter()
        .flat_map(|report| report.blocks.iter().map(move |block| (report.term, block)))
        .map(|(term, block)| {
            json!({
                "term": term,
                "block": block.block,
                "linear": block.is_linear(),
                "first_order": block.first_order,
                "noise": block.noise,
                "rows": block.rows.iter().map(|row| json!({
                    "epsilon": row.epsilon, "remainder": row.remainder, "ratio": row.ratio,
                })).collect::<Vec<_>>(),
            })
        })
        .collect();
    json!({
        "agrees": good,
        "taylor": blocks,
        "differences": differences.map(|d| json!({
            "largest_error": d.largest_error,
            "outside_pattern": d.outside_pattern,
            "entries": d.entries,
            "evaluations": d.evaluations,
            "worst": d.worst.as_ref().map(|w| json!({
                "row": w.position.0, "column": w.position.1,
                "equation": w.names.0, "unknown": w.names.1,
                "analytic": w.analytic, "difference": w.difference,
            })),
        })),
    })
}
