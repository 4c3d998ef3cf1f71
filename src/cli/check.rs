//! `nicolson check`: validate and predict, run nothing.
#![allow(clippy::print_stdout, reason = "this is the command line's output")]

use super::{DONE, report_error};
use crate::scene::Scene;
use crate::simulation::{Forecast, RunError, prepare};

/// Prints the forecast of a scene.
pub fn check(scene: &Scene) -> u8 {
    let forecast = match scene.dimension() {
        1 => forecast::<1>(scene),
        2 => forecast::<2>(scene),
        _ => forecast::<3>(scene),
    };
    match forecast {
        Ok((forecast, warnings)) => {
            print(scene, &forecast, &warnings);
            DONE
        }
        Err(error) => report_error(&error),
    }
}

fn forecast<const D: usize>(scene: &Scene) -> Result<(Forecast, Vec<String>), RunError> {
    let prepared = prepare::<D>(scene)?;
    Ok((prepared.forecast(scene), prepared.warnings))
}

fn print(scene: &Scene, forecast: &Forecast, warnings: &[String]) {
    println!("scene                {}", scene.title);
    println!("particles            {}", forecast.particles);
    println!("neighbours (mean)    {:.1}", forecast.mean_neighbours);
    if forecast.unknowns > 0 {
        println!("unknowns             {}", forecast.unknowns);
        println!("tangent entries      {}", forecast.entries);
        println!("equations            {}", if forecast.linear { "linear: one factorisation" } else { "nonlinear" });
    }
    println!("memory (estimate)    {:.1} MB", forecast.memory / 1e6);
    println!("explicit step limit  {:.4e} s", forecast.explicit_step_limit);
    println!(
        "step                 {:.4e} s ({:.1} × explicit)",
        forecast.step,
        forecast.step / forecast.explicit_step_limit
    );
    println!("steps                {:.0}", forecast.steps);
    println!("explicit steps       {:.0}", (scene.time.end / forecast.explicit_step_limit).ceil());
    for warning in warnings {
        println!("warning: {warning}");
    }
}
