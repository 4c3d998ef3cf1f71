//! The sections of the report, each from what was found of the run.

use std::fmt::Write as _;
use std::path::Path;

use serde_json::Value;

use super::super::text::readable;
use super::super::{HistoryColumns, LinePlot, LineSeries, OutputError, ProbeColumns, StoredTable, Style};
use super::Found;
use super::text::{escaped, figure, rows, section, shown, table, words};

/// Most probes that are drawn.
const MOST_PROBES: usize = 12;
/// Most steps that get a marker each.
const MOST_MARKERS: usize = 200;

/// Parts of the wall-clock time, as keys of the report and in words.
const CLOCKS: [(&str, &str); 9] = [
    ("setup", "set-up"),
    ("rate", "rates and residuals"),
    ("assembly", "assembly"),
    ("factorisation", "factorisation, preconditioners"),
    ("solve", "linear solves"),
    ("integration", "time integration"),
    ("ledger", "energies"),
    ("output", "output"),
    ("other", "anything else"),
];

/// Title, outcome, warnings.
pub(super) fn summary(found: &Found, title: &str) -> String {
    let status = found.entry(&["status"]).as_str().unwrap_or("no report");
    let mut html = format!(
        "<header>\n<h1>{}</h1>\n<p><span class=\"badge {}\">{}</span> <span class=\"path\">{}</span></p>\n</header>\n<main>\n",
        escaped(title),
        status.split(' ').next().unwrap_or_default(),
        escaped(status),
        escaped(&found.directory.display().to_string())
    );
    if let Some(message) = found.entry(&["message"]).as_str() {
        let _ = writeln!(html, "<p class=\"message\">{}</p>", escaped(message));
    }
    let warnings = found.entry(&["warnings"]).as_array().into_iter().flatten().filter_map(Value::as_str);
    for note in warnings.chain(found.notes.iter().map(String::as_str)) {
        let _ = writeln!(html, "<p class=\"warning\">{}</p>", escaped(note));
    }
    let unit = |value: Option<String>, unit: &str| value.map(|value| format!("{value}{unit}"));
    let steps = shown(found.entry(&["steps", "accepted"])).map(|accepted| {
        let rejected = found.entry(&["steps", "rejected"]).as_u64().unwrap_or(0);
        if rejected > 0 { format!("{accepted}, and {rejected} rejected") } else { accepted }
    });
    let version = shown(found.entry(&["provenance", "version"])).map(|version| {
        let commit = found.entry(&["provenance", "commit"]).as_str().unwrap_or_default();
        format!("{version} {}", commit.get(..12).unwrap_or(commit)).trim_end().to_owned()
    });
    let facts = [
        ("time reached", unit(shown(found.entry(&["time_reached"])), " s")),
        ("particles", shown(found.entry(&["particles"]))),
        ("unknowns", shown(found.entry(&["unknowns"])).filter(|count| count != "0")),
        ("steps", steps),
        ("explicit step limit", unit(shown(found.entry(&["explicit_step_limit"])), " s")),
        ("wall-clock time", unit(found.entry(&["wall_seconds", "total"]).as_f64().map(|s| readable(s, 4)), " s")),
        ("threads", shown(found.entry(&["provenance", "threads"]))),
        ("version", version),
    ];
    let facts: Vec<_> = facts.into_iter().filter_map(|(name, value)| Some((name.to_owned(), value?))).collect();
    html + &section("Summary", &table(&facts))
}

/// The energy ledger, and the energies against time.
pub(super) fn energy(found: &Found) -> Result<String, OutputError> {
    let mut rows: Vec<(String, String)> = Vec::new();
    let entry = |key: &str| found.entry(&["energy", key]).as_f64();
    for (key, name) in [("initial", "total at the start"), ("final", "total at the end"), ("dissipated", "dissipated")]
    {
        rows.extend(entry(key).map(|value| (name.to_owned(), format!("{} J", readable(value, 8)))));
    }
    for (key, name) in [
        ("max_relative_drift", "largest drift, relative"),
        ("ledger_error", "what energy, dissipation and work fail to explain, relative"),
        ("hourglass_max_fraction", "hourglass over internal energy, largest"),
    ] {
        rows.extend(entry(key).map(|value| (name.to_owned(), readable(value, 4))));
    }
    for (key, name) in [
        ("linear_momentum_drift", "drift of linear momentum, relative"),
        ("angular_momentum_drift", "drift of angular momentum, relative"),
    ] {
        rows.extend(found.entry(&[key]).as_f64().map(|value| (name.to_owned(), readable(value, 4))));
    }
    let mut html = table(&rows);
    if let Some(history) = &found.history {
        let column = |name: &str| history.get(name).unwrap_or_default().to_vec();
        let columns = HistoryColumns {
            t: column("t"),
            kinetic: column("kinetic"),
            internal: column("internal"),
            external: column("external"),
            dissipated: column("dissipated"),
            hourglass: column("hourglass"),
            total: column("total"),
        };
        html += &drawn(&columns.plot(), &found.directory)?;
    }
    Ok(section("Energy", &html))
}

/// The displacements of the probes against time.
pub(super) fn probes(found: &Found) -> Result<String, OutputError> {
    let Some(table) = &found.probes else { return Ok(String::new()) };
    let displacement = |name: &&String| name.rsplit_once('.').is_some_and(|(_, component)| component.starts_with('u'));
    let names: Vec<String> = table.names().iter().filter(displacement).cloned().collect();
    let values = names.iter().map(|name| table.get(name).unwrap_or_default().to_vec()).collect();
    let columns = ProbeColumns { t: table.get("t").unwrap_or_default().to_vec(), names, values };
    let plots = columns.plots();
    let mut html = String::new();
    for (_, plot) in plots.iter().take(MOST_PROBES) {
        html += &drawn(plot, &found.directory)?;
    }
    if plots.len() > MOST_PROBES {
        let _ = writeln!(html, "<p>{} further probes are in probes.csv.</p>", plots.len() - MOST_PROBES);
    }
    Ok(section("Probes", &html))
}

/// What the solvers did, as totals and step by step.
pub(super) fn convergence(found: &Found) -> Result<String, OutputError> {
    let mut html = String::new();
    for group in ["steps", "newton", "linear"] {
        let rows = rows(found.entry(&[group]));
        if !rows.is_empty() {
            let _ = writeln!(html, "<div class=\"group\"><h3>{}</h3>{}</div>", words(group), table(&rows));
        }
    }
    if !html.is_empty() {
        html = format!("<div class=\"groups\">\n{html}</div>\n");
    }
    if let Some(history) = &found.history {
        html += &per_step(history, "newton_iterations", "Newton iterations per step", "iterations", &found.directory)?;
        html += &per_step(history, "rejected", "Rejected steps", "rejected before the step", &found.directory)?;
        html += &per_step(history, "dt", "Step", "Δt [s]", &found.directory)?;
    }
    for balance in found.entry(&["balance"]).as_array().into_iter().flatten() {
        let _ = write!(html, "<h3>balance of the gradient weights</h3>{}", table(&rows(balance)));
    }
    Ok(section("Convergence", &html))
}

/// A column of the history against time, from the first step on; nothing if all of it is zero.
fn per_step(
    history: &StoredTable,
    name: &str,
    title: &str,
    y_label: &str,
    directory: &Path,
) -> Result<String, OutputError> {
    let (Some(t), Some(values)) = (history.get("t"), history.get(name)) else { return Ok(String::new()) };
    let points: Vec<(f64, f64)> = t.iter().copied().zip(values.iter().copied()).skip(1).collect();
    if points.iter().all(|&(_, value)| value == 0.0) {
        return Ok(String::new());
    }
    let style = if points.len() <= MOST_MARKERS { Style::Points } else { Style::Solid };
    let highest = points.iter().map(|point| point.1).filter(|value| value.is_finite()).fold(0.0, f64::max);
    let plot = LinePlot {
        title: title.to_owned(),
        x_label: "t [s]".to_owned(),
        y_label: y_label.to_owned(),
        series: vec![LineSeries { name: String::new(), points, style }],
        y_range: Some((0.0, highest)),
        ..LinePlot::default()
    };
    drawn(&plot, directory)
}

/// Where the time went.
pub(super) fn wall_time(found: &Found) -> String {
    let clock = |key: &str| found.entry(&["wall_seconds", key]).as_f64().filter(|seconds| *seconds >= 0.0);
    let Some(total) = clock("total").filter(|total| *total > 0.0) else { return String::new() };
    let mut parts: Vec<(String, f64)> =
        CLOCKS.iter().filter_map(|(key, name)| Some(((*name).to_owned(), clock(key)?))).collect();
    // Clocks that this list does not know.
    let known = |key: &str| key == "total" || CLOCKS.iter().any(|(name, _)| *name == key);
    for (key, value) in found.entry(&["wall_seconds"]).as_object().into_iter().flatten() {
        parts.extend(value.as_f64().filter(|_| !known(key)).map(|seconds| (words(key), seconds)));
    }
    let rest = total - parts.iter().map(|part| part.1).sum::<f64>();
    if rest > 1e-3 * total {
        parts.push(("on no clock".to_owned(), rest));
    }
    let mut html = String::from("<table class=\"bars\">\n");
    for (name, seconds) in parts {
        let percent = (100.0 * seconds / total).clamp(0.0, 100.0);
        let _ = writeln!(
            html,
            "<tr><th>{}</th><td>{} s</td><td>{percent:.1} %</td><td class=\"bar\"><div style=\"width:{percent:.2}%\"></div></td></tr>",
            escaped(&name),
            readable(seconds, 3)
        );
    }
    let _ = writeln!(html, "<tr><th>total</th><td>{} s</td><td></td><td></td></tr>\n</table>", readable(total, 4));
    if let Some(hint) = found.entry(&["bottleneck", "hint"]).as_str().filter(|hint| !hint.is_empty()) {
        let part = found.entry(&["bottleneck", "part"]).as_str().unwrap_or("one part");
        let _ = writeln!(html, "<p class=\"note\">Most goes into {}: {}.</p>", escaped(part), escaped(hint));
    }
    section("Wall-clock time", &html)
}

/// Errors against the exact solution, and where the probes ended.
pub(super) fn outcomes(found: &Found) -> String {
    let mut html = String::new();
    let errors: Vec<_> = found.entry(&["errors"]).as_object().into_iter().flatten().collect();
    if !errors.is_empty() {
        html += "<h3>errors against the exact solution</h3>\n<table>\n<tr><th></th><th>L1</th><th>L2</th><th>L∞</th></tr>\n";
        for (field, norms) in errors {
            let norm =
                |key: &str| norms[key].as_f64().map_or_else(|| "not finite".to_owned(), |norm| readable(norm, 4));
            let cells = ["l1", "l2", "linf"].map(|key| format!("<td>{}</td>", norm(key))).concat();
            let _ = writeln!(html, "<tr><th>{}</th>{cells}</tr>", escaped(&words(field)));
        }
        html += "</table>\n";
    }
    let probes: Vec<_> = found.entry(&["probes"]).as_object().into_iter().flatten().collect();
    if !probes.is_empty() {
        html +=
            "<h3>probes at the end</h3>\n<table>\n<tr><th></th><th>displacement [m]</th><th>velocity [m/s]</th></tr>\n";
        for (name, state) in probes {
            let list = |key: &str| {
                let numbers = state[key].as_array().into_iter().flatten();
                let text = numbers.map(|number| number.as_f64().map_or_else(|| "?".to_owned(), |x| readable(x, 6)));
                format!("<td>{}</td>", escaped(&text.collect::<Vec<_>>().join(", ")))
            };
            let _ = writeln!(html, "<tr><th>{}</th>{}{}</tr>", escaped(name), list("displacement"), list("velocity"));
        }
        html += "</table>\n";
    }
    section("Outcome", &html)
}

/// The scene, the command, and everything else that the report tells.
pub(super) fn scene(found: &Found) -> String {
    let mut html = String::new();
    if let Some(command) = found.entry(&["provenance", "command"]).as_str().filter(|command| !command.is_empty()) {
        let _ = writeln!(html, "<pre>{}</pre>", escaped(command));
    }
    if !found.scene().is_empty() {
        let _ = writeln!(html, "<details open><summary>Scene</summary><pre>{}</pre></details>", escaped(found.scene()));
    }
    if let Some(mut report) = found.report.clone() {
        if let Some(provenance) = report["provenance"].as_object_mut() {
            provenance.remove("scene");
        }
        let text = serde_json::to_string_pretty(&report).unwrap_or_default();
        let _ = writeln!(html, "<details><summary>report.json</summary><pre>{}</pre></details>", escaped(&text));
    }
    section("Scene and provenance", &html)
}

fn drawn(plot: &LinePlot, directory: &Path) -> Result<String, OutputError> {
    Ok(figure(&plot.document(directory)?, &plot.title))
}
