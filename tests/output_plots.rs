//! Every plot is drawn from data that a run may really produce, good and bad, and looked at as far as a
//! program can: the PNG decodes and is not blank, the SVG is well-formed and has no NaN in it.
//!
//! With `NICOLSON_PLOT_SAMPLES=DIRECTORY` the pictures are kept there to be looked at by a person.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};

use nicolson::output::{
    Cell, ColourMap, HistoryColumns, LinePlot, LineSeries, Panel, Panels, ParticlePlot, PlotGrid, ProbeColumns, Style,
    Tone, prepare_directory,
};

/// Where the pictures of a test go; the guard removes them unless they are wanted.
fn samples() -> (PathBuf, Option<tempfile::TempDir>) {
    if let Some(kept) = env::var_os("NICOLSON_PLOT_SAMPLES") {
        let kept = PathBuf::from(kept);
        prepare_directory(&kept).unwrap();
        return (kept, None);
    }
    let directory = tempfile::tempdir().unwrap();
    (directory.path().to_path_buf(), Some(directory))
}

/// Checks both files as far as a program can.
fn check([svg, png]: [PathBuf; 2]) {
    let document = fs::read_to_string(&svg).unwrap();
    assert!(document.starts_with("<svg ") && document.trim_end().ends_with("</svg>"), "{}", svg.display());
    for wrong in ["NaN", "inf\""] {
        let numbers = document.lines().filter(|line| line.starts_with("<poly") || line.starts_with("<circle"));
        assert!(numbers.clone().all(|line| !line.contains(wrong)), "{} has {wrong}", svg.display());
    }
    let mut reader = png::Decoder::new(std::io::BufReader::new(fs::File::open(&png).unwrap())).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut pixels).unwrap();
    assert!(info.width >= 300 && info.height >= 200, "{}: {} x {}", png.display(), info.width, info.height);
    let inked = pixels.iter().filter(|&&value| value < 0x80).count();
    assert!(inked > 500 && inked < pixels.len() / 2, "{}: {inked} dark values", png.display());
}

fn series(name: &str, style: Style, points: impl IntoIterator<Item = (f64, f64)>) -> LineSeries {
    LineSeries { name: name.to_owned(), points: points.into_iter().collect(), style }
}

fn plot(title: &str, series: Vec<LineSeries>) -> LinePlot {
    LinePlot {
        title: title.to_owned(),
        x_label: "t [s]".into(),
        y_label: "value [m]".into(),
        series,
        ..LinePlot::default()
    }
}

fn write(plot: &LinePlot, directory: &Path, name: &str) {
    check(plot.write(&directory.join(name)).unwrap());
}

#[test]
fn ordinary_histories() {
    let (directory, _guard) = samples();
    let wave = |frequency: f64, size: f64| {
        (0..400).map(move |i| (f64::from(i) * 1e-3, size * (frequency * f64::from(i) * 0.02).sin()))
    };
    let free = plot(
        "Tip displacement",
        vec![series("tip.ux", Style::Solid, wave(1.0, 0.01)), series("tip.uy", Style::Dashed, wave(1.3, 0.05))],
    );
    write(&free, &directory, "two waves");
    let crowded =
        (0..9).map(|k| series(&format!("probe {k}.ux"), Style::Solid, wave(1.0 + f64::from(k), 1e-6))).collect();
    write(&plot("Nine curves that leave no free corner", crowded), &directory, "crowded");
    let many = (0..60)
        .map(|k| series(&format!("a rather long name of a series, number {k}"), Style::Solid, wave(1.0, f64::from(k))))
        .collect();
    write(&plot("More entries than fit", many), &directory, "many entries");
    let long = plot(
        "A million steps",
        vec![series(
            "noise",
            Style::Solid,
            (0..1_000_000).map(|i| (f64::from(i), (f64::from(i) * 0.7).sin() * (f64::from(i) * 1e-5).cos())),
        )],
    );
    write(&long, &directory, "million");
    assert!(fs::metadata(directory.join("million.svg")).unwrap().len() < 300_000);
}

#[test]
fn convergence_with_reference_slopes() {
    let (directory, _guard) = samples();
    let steps: Vec<f64> = (0..7).map(|k| 0.1 / f64::from(1 << k)).collect();
    let order = |factor: f64, p: i32| steps.iter().map(move |&h| (h, factor * h.powi(p))).collect::<Vec<_>>();
    let mut convergence = plot(
        "Convergence of the time integration",
        vec![
            series("Crank–Nicolson", Style::SolidWithPoints, order(0.3, 2)),
            series("backward Euler", Style::SolidWithPoints, order(0.8, 1)),
            series("second order", Style::Dashed, order(0.1, 2)),
            series("first order", Style::Dotted, order(2.0, 1)),
        ],
    );
    (convergence.log_x, convergence.log_y) = (true, true);
    (convergence.x_label, convergence.y_label) = ("Δt [s]".into(), "relative error in ‖u‖".replace('‖', "|"));
    write(&convergence, &directory, "convergence");
    convergence.series.truncate(1);
    convergence.series[0].points.truncate(2);
    write(&convergence, &directory, "two points, less than a decade");
}

#[test]
fn diagrams_with_the_same_series_share_one_legend() {
    let (directory, _guard) = samples();
    let diagram = |title: &str, names: &[&str]| {
        let line = |name: &&str| series(name, Style::DashedWithPoints, [(1.0, 1.0), (2.0, 4.0 + name.len() as f64)]);
        plot(title, names.iter().map(line).collect())
    };
    // More than there are colours: the markers tell the last from the first.
    let names: Vec<String> = (0..9).map(|index| format!("method {index}")).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let mentions = |grid: &PlotGrid, file: &str| {
        let files = grid.write(&directory.join(file)).unwrap();
        let document = fs::read_to_string(&files[0]).unwrap();
        check(files);
        document.matches("method 8").count()
    };
    let same = PlotGrid { columns: 2, plots: vec![diagram("one", &names), diagram("two", &names)] };
    assert_eq!(mentions(&same, "shared-legend"), 1);
    let different = PlotGrid { columns: 2, plots: vec![diagram("one", &names), diagram("two", &names[5..])] };
    assert_eq!(mentions(&different, "own-legends"), 2);
}

#[test]
fn data_that_nobody_wished_for() {
    let (directory, _guard) = samples();
    let nothing: [(f64, f64); 0] = [];
    let cases: Vec<(&str, Vec<LineSeries>)> = vec![
        ("no series", vec![]),
        ("empty series", vec![series("empty", Style::Solid, nothing), series("also", Style::Dashed, nothing)]),
        ("single point", vec![series("one", Style::Solid, [(0.5, 2.0)])]),
        (
            "constant",
            vec![
                series("constant", Style::Solid, [(0.0, 3.0), (1.0, 3.0)]),
                series("zero", Style::Dotted, [(0.0, 0.0), (1.0, 0.0)]),
            ],
        ),
        ("zero", vec![series("zero", Style::Solid, [(0.0, 0.0), (1.0, 0.0)])]),
        (
            "rounding noise",
            vec![series("total", Style::Solid, (0..50).map(|i| (f64::from(i), 1e4 + f64::from(i % 3) * 1e-12)))],
        ),
        (
            "narrow range",
            vec![series(
                "total",
                Style::Solid,
                (0..50).map(|i| (1e-5 * f64::from(i), -1234.5 + 1e-6 * f64::from(i * i))),
            )],
        ),
        (
            "not finite",
            vec![series(
                "gaps",
                Style::Solid,
                (0..60).map(|i| {
                    (
                        f64::from(i),
                        if i % 20 == 7 {
                            f64::NAN
                        } else if i == 40 {
                            f64::INFINITY
                        } else {
                            f64::from(i).sqrt()
                        },
                    )
                }),
            )],
        ),
        ("only NaN", vec![series("nothing", Style::Solid, [(0.0, f64::NAN), (f64::NAN, 1.0)])]),
        (
            "huge range",
            vec![series("huge", Style::Solid, [(0.0, -1e300), (1e-300, 1e-300), (1e300, 1e300), (2.0, f64::MAX)])],
        ),
        ("odd <names> & \"quotes\"\n", vec![series("a < b & \"c\"\u{7}", Style::Solid, [(0.0, 1.0), (1.0, 2.0)])]),
    ];
    for (name, data) in cases {
        let file = name.replace(['<', '>', '&', '"', '\n'], "");
        let mut plot = plot(name, data);
        write(&plot, &directory, &file);
        (plot.log_x, plot.log_y) = (true, true);
        write(&plot, &directory, &format!("{file}, logarithmic"));
    }
    assert!(plot("", vec![]).write(&directory.join("absent/plot")).is_err());
}

#[test]
fn the_same_data_give_the_same_bytes_and_dots_in_names_survive() {
    let (directory, _guard) = samples();
    let plot = plot("Same", vec![series("x", Style::Dotted, (0..30).map(|i| (f64::from(i), f64::from(i).cos())))]);
    let [svg, png] = plot.write(&directory.join("probe.tip")).unwrap();
    assert!(svg.ends_with("probe.tip.svg") && png.ends_with("probe.tip.png"));
    let first = (fs::read(&svg).unwrap(), fs::read(&png).unwrap());
    plot.write(&directory.join("probe.tip")).unwrap();
    assert!(first == (fs::read(svg).unwrap(), fs::read(png).unwrap()));
}

#[test]
fn histories_of_a_run() {
    let (directory, _guard) = samples();
    let t: Vec<f64> = (0..500).map(|i| 2e-3 * f64::from(i)).collect();
    let map = |of: fn(f64) -> f64| t.iter().map(|&t| of(t)).collect::<Vec<_>>();
    let energies = HistoryColumns {
        kinetic: map(|t| 12.0 * (9.0 * t).sin().powi(2) * (-t).exp()),
        internal: map(|t| 12.0 * (9.0 * t).cos().powi(2) * (-t).exp()),
        external: map(|_| 0.0),
        dissipated: map(|t| 12.0 * (1.0 - (-t).exp())),
        total: map(|t| 12.0 * (-t).exp()),
        hourglass: Vec::new(),
        t: t.clone(),
    };
    check(energies.write(&directory).unwrap());
    let probes = ProbeColumns {
        values: vec![map(|t| -1e-4 * (9.0 * t).sin().powi(2)), map(|t| 3e-3 * (9.0 * t).sin()), map(|_| 0.0)],
        names: ["tip.ux", "tip.uy", "centre.ux"].map(str::to_owned).to_vec(),
        t,
    };
    let paths = probes.write(&directory).unwrap();
    assert_eq!(paths.len(), 4);
    for pair in paths.chunks(2) {
        check([pair[0].clone(), pair[1].clone()]);
    }
    write(&HistoryColumns::default().plot(), &directory, "energy of nothing");
    assert!(ProbeColumns::default().write(&directory).unwrap().is_empty());
}

/// Points of a lattice with `counts` points along each direction.
fn lattice(counts: &[usize], spacing: f64) -> Vec<f64> {
    let total: usize = counts.iter().product();
    let place = |mut index: usize| {
        let component = |&count: &usize| {
            let here = index % count;
            index /= count;
            (here as f64 + 0.5) * spacing
        };
        counts.iter().map(component).collect::<Vec<_>>()
    };
    (0..total).flat_map(place).collect()
}

/// Bends a beam along x about its root.
fn bent(positions: &mut [f64], dim: usize, curvature: f64) {
    for point in positions.chunks_exact_mut(dim) {
        let (angle, offset) = (point[0] * curvature, point[dim - 1]);
        point[0] = angle.sin() / curvature - offset * angle.sin();
        point[dim - 1] = (1.0 - angle.cos()) / curvature + offset * angle.cos();
    }
}

fn particles<'a>(dim: usize, positions: &'a [f64], values: &'a [f64], spacing: f64) -> ParticlePlot<'a> {
    let (title, label) = ("Bent beam", "pressure [Pa]");
    ParticlePlot { title, time: 0.012_345, dim, positions, values, label, spacing, ..ParticlePlot::default() }
}

#[test]
fn particles_in_the_plane() {
    let (directory, _guard) = samples();
    let mut beam = lattice(&[120, 20], 0.01);
    let values: Vec<f64> = beam.chunks(2).map(|p| 1e7 * (1.2 - p[0]) * (p[1] - 0.1)).collect();
    bent(&mut beam, 2, 0.9);
    check(particles(2, &beam, &values, 0.01).write(&directory.join("beam")).unwrap());
    let slender = lattice(&[200, 4], 1e-5);
    let values: Vec<f64> = slender.chunks(2).map(|p| 1e6 + p[0]).collect();
    check(
        ParticlePlot {
            title: "A slender one with nearly one value and a title that is rather long for its page",
            ..particles(2, &slender, &values, 1e-5)
        }
        .write(&directory.join("slender"))
        .unwrap(),
    );
    let tall = lattice(&[8, 100], 0.05);
    let values: Vec<f64> = tall.chunks(2).map(|p| (3.0 * p[1]).sin().abs()).collect();
    check(
        ParticlePlot {
            title: "",
            label: "a label that is too long to be written along the colour bar of this small picture [kg m/s²]",
            ..particles(2, &tall, &values, 0.05)
        }
        .write(&directory.join("tall"))
        .unwrap(),
    );
    let fine = lattice(&[300, 200], 1.0);
    let values: Vec<f64> = fine.chunks(2).map(|p| (0.05 * p[0]).sin() * (0.03 * p[1]).cos() - 0.2).collect();
    let [svg, png] = particles(2, &fine, &values, 1.0).write(&directory.join("fine")).unwrap();
    assert!(fs::metadata(&svg).unwrap().len() < 1_000_000, "many particles must become a picture");
    assert!(fs::read_to_string(&svg).unwrap().contains("data:image/png;base64,"));
    check([svg, png]);
}

#[test]
fn particles_in_space_and_on_the_line() {
    let (directory, _guard) = samples();
    let mut beam = lattice(&[60, 10, 10], 0.02);
    let values: Vec<f64> = beam.chunks(3).map(|p| 2e9 * (p[2] - 0.1).abs() * (1.2 - p[0])).collect();
    bent(&mut beam, 3, 0.9);
    check(particles(3, &beam, &values, 0.02).write(&directory.join("space")).unwrap());
    let cube = lattice(&[30, 30, 30], 1e-3);
    let values: Vec<f64> = cube.chunks(3).map(|p| p[0] + p[1] * p[2] * 1e2).collect();
    check(ParticlePlot { title: "Cube", ..particles(3, &cube, &values, 1e-3) }.write(&directory.join("cube")).unwrap());
    let line = lattice(&[100], 0.01);
    let values: Vec<f64> = line.iter().map(|x| (5.0 * x).sin() * 1e-4).collect();
    check(
        ParticlePlot { title: "Bar", label: "displacement [m]", ..particles(1, &line, &values, 0.01) }
            .write(&directory.join("bar"))
            .unwrap(),
    );
}

#[test]
fn particles_that_nobody_wished_for() {
    let (directory, _guard) = samples();
    let square = lattice(&[10, 10], 0.1);
    let mut broken = square.clone();
    broken[7] = f64::NAN;
    let mut values: Vec<f64> = (0..100).map(f64::from).collect();
    values[50] = f64::INFINITY;
    values[51] = f64::NAN;
    check(particles(2, &broken, &values, 0.1).write(&directory.join("particles not finite")).unwrap());
    check(particles(2, &square, &[3.0; 100], f64::NAN).write(&directory.join("particles constant")).unwrap());
    check(
        ParticlePlot { colours: ColourMap::Diverging, ..particles(2, &square, &[0.0; 100], 0.1) }
            .write(&directory.join("particles zero"))
            .unwrap(),
    );
    for dim in 1..=3 {
        check(particles(dim, &[], &[], 0.1).write(&directory.join(format!("particles none {dim}"))).unwrap());
        check(
            particles(dim, &[1e5, 1e5, 1e5][..dim], &[-1e-9], 0.0)
                .write(&directory.join(format!("particles one {dim}")))
                .unwrap(),
        );
        let lost = [0.0, 0.0, 0.0, 1e200, 1.0, 1.0, 1e100, 1.0, 1.0];
        check(
            particles(dim, &lost[..3 * dim], &[1.0, 2.0, f64::MAX], 0.1)
                .write(&directory.join(format!("particles lost {dim}")))
                .unwrap(),
        );
    }
    assert!(particles(4, &[], &[], 0.1).write(&directory.join("no")).unwrap_err().to_string().contains("4 dimensions"));
    assert!(
        particles(2, &square, &[1.0], 0.1).write(&directory.join("no")).unwrap_err().to_string().contains("positions")
    );
}

/// Tables of outcomes: odd numbers of panels, cells that are missing or too many, tones that are no numbers.
#[test]
fn panels_of_outcomes() {
    let (directory, _guard) = samples();
    let cell = |text: &str, tone| Some(Cell { text: text.to_owned(), tone });
    let panel = |title: &str| Panel {
        title: title.to_owned(),
        cells: vec![
            vec![cell("2e−15", Tone::Good(1.0)), None, cell("far too long for a cell", Tone::Bad(0.2))],
            vec![cell("?", Tone::Good(f64::NAN)), cell("0.0 s", Tone::Bad(7.0)), None, cell("outside", Tone::Bad(1.0))],
            vec![],
            vec![cell("outside", Tone::Good(0.0))],
        ],
    };
    let panels = |count: usize| Panels {
        title: "Outcomes".into(),
        rows: vec!["first <scheme> & more".into(), "second".into(), "third".into()],
        columns: vec!["1".into(), "20".into(), "500".into()],
        columns_label: "Δt over the explicit limit".into(),
        good: "good".into(),
        bad: "bad".into(),
        panels: (0..count).map(|i| panel(&format!("panel {i}"))).collect(),
    };
    for count in 1..4 {
        check(panels(count).write(&directory.join(format!("panels-{count}"))).unwrap());
    }
    assert!(Panels::default().write(&directory.join("panels-empty")).is_ok());
}
