//! Fronts of the dam break for four wave speeds, with limited and with constant interface states, beside the measured one.
//!
//! `cargo bench --bench dam_break_fronts [-- SPACING]` prints the table of the README and draws
//! `examples/pictures/dam-break-fronts.png` (and `.svg`). Half a minute; the spacing is that of the scene unless given.
#![allow(clippy::print_stdout, reason = "a bench reports on the terminal")]

use std::error::Error;
use std::path::Path;

use nicolson::output::{LinePlot, LineSeries, Style};
use nicolson::scene::Scene;
use nicolson::simulation::{Gauge, Ledger, prepare};

/// Wave speeds, m/s.
const SPEEDS: [f64; 4] = [10.0, 35.0, 70.0, 140.0];
/// Side of the column, m.
const SIDE: f64 = 2.5;
/// Acceleration of gravity, m/s².
const GRAVITY: f64 = 9.81;

/// Martin and Moyce (1952), square column: `(t √(g/a), x/a)`; see `examples/dam-break-c70.toml` for the source.
const MEASURED: [(f64, f64); 9] = [
    (0.62, 1.22),
    (0.80, 1.44),
    (1.02, 1.67),
    (1.19, 1.89),
    (1.34, 2.11),
    (1.50, 2.33),
    (1.66, 2.56),
    (1.81, 2.78),
    (1.97, 3.00),
];

/// Front against time, both dimensionless, and the dissipated part of the energy that gravity has given.
struct Run {
    front: Vec<(f64, f64)>,
    dissipated: f64,
    rise: f64,
    ledger_error: f64,
}

impl Run {
    /// Front at a dimensionless time.
    fn at(&self, time: f64) -> f64 {
        let after = self.front.partition_point(|point| point.0 < time).clamp(1, self.front.len() - 1);
        let [(t0, x0), (t1, x1)] = [self.front[after - 1], self.front[after]];
        if time > t1 + 1e-9 { f64::NAN } else { x0 + (x1 - x0) * (time - t0) / (t1 - t0) }
    }

    /// How much later the experiment passes `x/a = 1.44`: the lifting of its gate.
    fn delay(&self) -> f64 {
        let (time, place) = MEASURED[1];
        let after = self.front.partition_point(|point| point.1 < place).clamp(1, self.front.len() - 1);
        let [(t0, x0), (t1, x1)] = [self.front[after - 1], self.front[after]];
        time - (t0 + (t1 - t0) * (place - x0) / (x1 - x0))
    }
}

fn run(interface: &str, speed: f64, spacing: Option<&str>) -> Result<Run, Box<dyn Error>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/dam-break-c70.toml");
    let law = format!("{{ hyperelastic_volumetric = {{ density = 1000.0, gamma = 7.0, wave_speed = {speed:?} }} }}");
    let mut overrides = vec![("body.0.material", law.as_str()), ("stabilisation.interface", interface)];
    overrides.extend(spacing.map(|spacing| ("body.0.spacing", spacing)));
    let overrides: Vec<_> = overrides.into_iter().map(|(key, value)| (key.to_owned(), value.to_owned())).collect();
    let scene = Scene::read(&path, &overrides)?;
    let mut prepared = prepare::<2>(&scene)?;
    let probe = prepared.model.setup().probes.first().cloned().ok_or("the scene has no probe")?;
    let gauge = Gauge::new(&probe, &prepared.model);
    let mut ledger = Ledger::open(&mut prepared.model, 0.0, &prepared.state.values)?;
    let (mut front, mut rise, mut total) = (vec![(0.0, 1.0)], f64::NEG_INFINITY, ledger.entry().total);
    while prepared.state.time < prepared.end {
        prepared.stepper.advance(&mut prepared.model, &mut prepared.state, prepared.end)?;
        let entry = ledger.follow(&mut prepared.model, prepared.state.time, &prepared.state.values)?;
        rise = rise.max(entry.total - total);
        total = entry.total;
        let moved = gauge.read(&prepared.model, &prepared.state.values).0[0];
        front.push((prepared.state.time * (GRAVITY / SIDE).sqrt(), 1.0 + moved / SIDE));
    }
    let entry = ledger.entry();
    let ledger_error = ledger.summary().ledger_error;
    Ok(Run { front, dissipated: entry.dissipated / (entry.kinetic + entry.dissipated), rise, ledger_error })
}

fn main() -> Result<(), Box<dyn Error>> {
    let spacing = std::env::args().skip(1).find(|argument| !argument.starts_with("--"));
    let (mut series, mut late) = (Vec::new(), LineSeries::default());
    let times: Vec<f64> = MEASURED.iter().map(|point| point.0).filter(|&time| time <= 1.5).collect();
    println!("front x/a at t √(g/a) =                     {times:.2?}");
    println!(
        "Martin and Moyce 1952                       {:.2?}",
        MEASURED.map(|point| point.1).split_at(times.len()).0
    );
    for (interface, style) in [("limited", Style::Solid), ("constant", Style::Dashed)] {
        // The plot has seven colours, then begins again: the same one for the same speed.
        series.resize_with(if series.is_empty() { 0 } else { 7 }, LineSeries::default);
        for speed in SPEEDS {
            let run = run(interface, speed, spacing.as_deref())?;
            let fronts: Vec<f64> = times.iter().map(|&time| run.at(time)).collect();
            println!(
                "{interface:8} c = {speed:3.0} m/s                        {fronts:.3?}   dissipated {:4.1} %, largest rise of \
                 the energy in a step {:.1e} J, ledger {:.1e}",
                100.0 * run.dissipated,
                run.rise,
                run.ledger_error
            );
            if interface == "limited" {
                let delay = run.delay();
                let fronts: Vec<f64> = MEASURED.iter().map(|point| run.at(point.0 - delay)).collect();
                println!("    {delay:.3} later, at every measured point      {fronts:.3?}");
                if speed == 70.0 {
                    let name = format!("limited, c = 70 m/s, clock {delay:.2} late");
                    let points = run.front.iter().map(|point| (point.0 + delay, point.1)).collect();
                    late = LineSeries { name, points, style: Style::Dotted };
                }
            }
            series.push(LineSeries { name: format!("{interface}, c = {speed} m/s"), points: run.front, style });
        }
    }
    series.push(LineSeries {
        name: "Martin and Moyce 1952".into(),
        points: MEASURED.iter().copied().filter(|point| point.0 < 1.8).collect(),
        style: Style::Points,
    });
    series.push(late);
    let plot = LinePlot {
        title: "Dam break: front for four wave speeds, limited and constant interface states".into(),
        x_label: "t √(g/a)".into(),
        y_label: "x/a".into(),
        series,
        ..LinePlot::default()
    };
    let target = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/pictures/dam-break-fronts");
    for path in plot.write(&target)? {
        println!("wrote {}", path.display());
    }
    Ok(())
}
