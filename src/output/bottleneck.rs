//! What would make a run faster, as far as its report tells.

use super::report::Report;
use super::report_parts::Bottleneck;

/// Length of an implicit step over an explicit one, of which a hint speaks.
const LONGER: f64 = 20.0;

impl Bottleneck {
    /// The costliest part of a run, and what would help with it.
    pub fn of(report: &Report) -> Self {
        let seconds = &report.wall_seconds;
        let total = seconds.total;
        let Some((part, most)) = seconds.parts().into_iter().max_by(|a, b| a.1.total_cmp(&b.1)) else {
            return Self::default();
        };
        if !(total > 0.0 && most > 0.0) {
            return Self::default();
        }
        Self { part: part.into(), share: most / total, hint: hint(part, report) }
    }
}

/// What would help with a part.
fn hint(part: &str, report: &Report) -> String {
    let implicit = report.unknowns > 0;
    let steps = report.steps.accepted.max(1) as f64;
    let per_iteration = report.linear.factorisations as f64 / report.newton.iterations.max(1) as f64;
    let direct = ["LU", "LDL", "Cholesky"].iter().any(|name| report.linear.solver.contains(name))
        && !["GMRES", "BiCGStab", "CG"].iter().any(|name| report.linear.solver.contains(name));
    match part {
        "set-up" if balancing(report) > 0.5 * report.wall_seconds.setup => {
            "balancing the gradient weights takes most of it; weights = \"separate\" needs none, but is of lower order"
                .into()
        }
        "set-up" => "it is paid once; a smaller `smoothing` makes the tables shorter".into(),
        "rates" if !implicit => {
            // What a long step replaces, in evaluations of the rate.
            let replaced = LONGER * report.rate_evaluations as f64 / steps;
            format!(
                "{:.1} evaluations per step, {:.1e} s each; an implicit scheme with {LONGER} times the step wins where its step \
                 costs less than {replaced:.0} evaluations: try scheme = \"crank_nicolson\" with step = {:.1e}, or more threads",
                report.rate_evaluations as f64 / steps,
                report.wall_seconds.rate / report.rate_evaluations.max(1) as f64,
                LONGER * report.time_reached / steps,
            )
        }
        "rates" => format!(
            "{:.1} residuals per iteration; a looser newton.relative_tolerance or longer steps take fewer, more threads share them",
            report.newton.residual_evaluations as f64 / report.newton.iterations.max(1) as f64
        ),
        "assembly" | "factorisation" if per_iteration > 0.5 => format!(
            "{} factorisations in {} iterations; newton.tangent = \"lagged\" keeps a factor while it serves{}",
            report.linear.factorisations,
            report.newton.iterations,
            if direct && part == "factorisation" { ", an iterative linear.solver needs smaller ones" } else { "" }
        ),
        "factorisation" if !direct => {
            "the preconditioner costs more than the iterations it saves: try a simpler linear.preconditioner".into()
        }
        "assembly" | "factorisation" => {
            "the tangent is kept already; a constant step keeps it longest, a smaller `smoothing` makes it sparser"
                .into()
        }
        "linear solves" if direct => {
            "as it should be where the factor is kept; fewer and longer steps take fewer solves".into()
        }
        "linear solves" => format!(
            "{:.0} iterations per solve; a stronger linear.preconditioner takes fewer, a direct linear.solver none",
            report.linear.iterations as f64 / report.linear.solves.max(1) as f64
        ),
        "integration" => "vectors, not forces: the scene is small; longer steps are all that helps".into(),
        "ledger" => "output.history = false leaves energies and momenta out".into(),
        "output" => "a longer output.interval writes fewer frames, output.plots = false draws nothing".into(),
        _ => String::new(),
    }
}

/// Seconds spent on balancing weights.
fn balancing(report: &Report) -> f64 {
    report.balance.iter().map(|work| work.seconds).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::{LinearWork, NewtonWork, Steps, WallSeconds};

    #[test]
    fn the_costliest_part_is_named_with_what_helps() {
        let explicit = Report {
            steps: Steps { accepted: 100, rejected: 0 },
            rate_evaluations: 200,
            time_reached: 1.0,
            wall_seconds: WallSeconds { rate: 3.0, output: 1.0, total: 4.0, ..WallSeconds::default() },
            ..Report::default()
        };
        let found = Bottleneck::of(&explicit);
        assert_eq!((found.part.as_str(), found.share), ("rates", 0.75));
        for part in ["2.0 evaluations per step, 1.5e-2 s each", "less than 40 evaluations", "step = 2.0e-1"] {
            assert!(found.hint.contains(part), "{}", found.hint);
        }
        let wall_seconds = WallSeconds { factorisation: 3.0, total: 4.0, ..WallSeconds::default() };
        let implicit = |factorisations, solver: &str| Report {
            unknowns: 10,
            newton: NewtonWork { iterations: 300, ..NewtonWork::default() },
            linear: LinearWork { factorisations, solver: solver.into(), ..LinearWork::default() },
            wall_seconds: wall_seconds.clone(),
            ..Report::default()
        };
        assert!(Bottleneck::of(&implicit(300, "sparse LU (faer)")).hint.contains("\"lagged\""));
        assert!(!Bottleneck::of(&implicit(1, "sparse LU (faer)")).hint.contains("\"lagged\""));
        assert!(Bottleneck::of(&implicit(1, "GMRES(30) + ILU(0)")).hint.contains("simpler"));
        assert_eq!(Bottleneck::of(&Report::default()), Bottleneck::default());
    }
}
