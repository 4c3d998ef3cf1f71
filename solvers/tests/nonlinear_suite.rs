#[path = "nonlinear/support.rs"]
mod support;
#[path = "nonlinear/test_functions.rs"]
mod test_functions;
use nicolson_solvers::nonlinear::*;
use support::*;

#[test]
fn table() {
    for case in test_functions::all() {
        print!("{:40}", case.name);
        for globalisation in [
            Globalisation::None,
            Globalisation::Backtracking,
            Globalisation::MoreThuente,
            Globalisation::HagerZhang,
            Globalisation::TrustRegion { initial_radius: None },
        ] {
            let mut problem = case.problem();
            let mut y = case.start.clone();
            let options = NewtonOptions { globalisation, max_iterations: 100, ..Default::default() };
            let mut solver = NewtonSolver::new(options, Box::new(DenseLu::default()));
            match solver.solve(&mut problem, &mut y) {
                Ok(report) => {
                    print!(" | {:3} {:4} {:?}", report.iterations, report.work.residual_evaluations, report.convergence)
                }
                Err(failure) => print!(
                    " | F {} {}",
                    failure.work.iterations,
                    &format!("{:?}", failure.cause).chars().take(24).collect::<String>()
                ),
            }
        }
        println!();
    }
}
