//! `render`, `report` and `plot` on the directory of a real run, whole, interrupted and damaged.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use super::{Answer, example, nicolson, run, table};

/// A short run of the scene in a directory whose name has a space and an accent.
fn short_run(inside: &Path, name: &str, overrides: &[&str]) -> PathBuf {
    let out = inside.join(name);
    let mut all = vec!["time.end=0.2"];
    all.extend(overrides);
    assert_eq!(run(&example("impact-hyperelastic"), &out, &all, &["--quiet", "--threads", "1"]).code, 0);
    out
}

fn on(verb: &str, run: &Path, arguments: &[&str]) -> Answer {
    let mut all = vec![verb.as_ref(), run.as_os_str()];
    all.extend(arguments.iter().map(AsRef::<std::ffi::OsStr>::as_ref));
    nicolson(&all)
}

/// The answer must be a refusal with exit code 2 that says all of this.
fn refused(answer: &Answer, parts: &[&str]) {
    assert_eq!((answer.code, answer.said.as_str()), (2, ""), "{}", answer.complained);
    for part in parts {
        assert!(answer.complained.contains(part), "{part}: {}", answer.complained);
    }
}

fn png_size(path: &Path) -> (u32, u32) {
    let file = std::io::BufReader::new(fs::File::open(path).expect("a picture"));
    let reader = png::Decoder::new(file).read_info().expect("a PNG picture");
    reader.info().size()
}

#[test]
fn pictures_and_animations_of_a_run_even_of_one_that_was_killed() {
    let directory = tempfile::tempdir().expect("a directory");
    let run = short_run(directory.path(), "späce and accent", &[]);
    let answer = on("render", &run, &[]);
    assert_eq!((answer.code, answer.complained.as_str()), (0, ""));
    let usual = PathBuf::from(answer.said.trim());
    assert_eq!(usual, run.join("pressure-00002.png"));
    let out = directory.path().join("é a.png");
    let text = |path: &Path| path.to_str().expect("text").to_owned();
    let answer = on("render", &run, &["--out", &text(&out), "--width", "801", "--height", "600", "--reference"]);
    assert_eq!((answer.code, answer.complained.as_str()), (0, ""));
    assert_eq!(png_size(&out), (801, 600));
    for arguments in [&["--field", "velocity"][..], &["--field", "deformation_gradient", "--component", "yx"]] {
        assert_eq!(on("render", &run, &[arguments, &["--out", &text(&out)]].concat()).code, 0);
    }
    // A kill leaves neither report nor, at worst, an index.
    fs::remove_file(run.join("report.json")).expect("a report");
    fs::remove_file(run.join("fields.pvd")).expect("an index");
    let gif = directory.path().join("all.gif");
    assert_eq!(on("render", &run, &["--out", &text(&gif), "--width", "400"]).code, 0);
    let mut decoder = gif::DecodeOptions::new().read_info(fs::File::open(&gif).expect("a file")).expect("a GIF");
    assert_eq!(decoder.width(), 400);
    let mut frames = 0;
    while decoder.read_next_frame().expect("a frame").is_some() {
        frames += 1;
    }
    assert_eq!(frames, 3);
    let answer = on("render", &run, &["--frame", "all", "--out", &text(&out)]);
    assert_eq!(answer.said.lines().count(), 3, "{}", answer.said);
    assert!(answer.said.contains("é a-00002.png"));
    assert_eq!(on("report", &run, &[]).code, 0);
    let html = fs::read_to_string(run.join("report.html")).expect("a report");
    assert!(html.contains("There is no report.json: the run goes on, or it was killed."));
}

#[test]
fn what_cannot_be_drawn_is_refused_with_a_remedy() {
    let directory = tempfile::tempdir().expect("a directory");
    let run = short_run(directory.path(), "run", &[]);
    let absent = directory.path().join("äbsent");
    let empty = directory.path().join("empty");
    fs::create_dir(&empty).expect("a directory");
    for verb in ["render", "report"] {
        refused(&on(verb, &absent, &[]), &["cannot read the run in", "äbsent", "correct the path"]);
        refused(&on(verb, &empty, &[]), &["there ", "empty", "give the directory of a run"]);
        refused(&on(verb, &run.join("history.csv"), &[]), &["not a file in it"]);
        let missing = absent.join("x.gif");
        refused(&on(verb, &run, &["--out", missing.to_str().expect("text")]), &["there is no directory", "create it"]);
    }
    let cases: [(&[&str], &[&str]); 11] = [
        (&["--field", "presure"], &["no field `presure`", "did you mean `pressure`?"]),
        (&["--field", "qq"], &["choose one of: pressure, jacobian, volume, velocity"]),
        (&["--field", "velocity", "--component", "xx"], &["no component `xx`"]),
        (&["--component", "x"], &["is a scalar", "leave the component out"]),
        (&["--frame", "7"], &["no frame 7", "frames 0 to 2"]),
        (&["--frame", "-1"], &["--frame"]),
        (&["--view", "top"], &["has 2 dimensions", "leave the view out"]),
        (&["--view", "tpo"], &["did you mean `top`?"]),
        (&["--out", "x.webm"], &["x.webm", ".png, .svg or .gif"]),
        (&["--width", "3"], &["width of 3 pixels"]),
        (&["--range", "2,1"], &["the range from 2 to 1"]),
    ];
    for (arguments, parts) in cases {
        refused(&on("render", &run, arguments), parts);
    }
    let frame = run.join("fields-00002.vtu");
    let whole = fs::read(&frame).expect("a frame");
    for length in [0, 100, whole.len() / 2, whole.len() - 2000] {
        fs::write(&frame, &whole[..length]).expect("a file");
        refused(&on("render", &run, &[]), &["cannot read", "fields-00002.vtu", "run the case again"]);
        refused(&on("report", &run, &[]), &["fields-00002.vtu"]);
        let gif = run.join("x.gif");
        refused(&on("render", &run, &["--out", gif.to_str().expect("text")]), &["fields-00002.vtu"]);
        assert!(!gif.exists());
    }
    fs::remove_file(&frame).expect("a frame");
    refused(&on("render", &run, &[]), &["cannot read the frame"]);
    fs::write(run.join("report.json"), "{").expect("a file");
    refused(&on("report", &run, &[]), &["report.json"]);
}

#[test]
fn two_runs_are_two_curves_with_their_names() {
    let directory = tempfile::tempdir().expect("a directory");
    let coarse = short_run(directory.path(), "cöarse steps", &[]);
    let fine = short_run(directory.path(), "fine steps", &["time.step=0.01"]);
    let out = directory.path().join("top.svg");
    let plot = |arguments: &[&str]| {
        let runs = [coarse.as_os_str(), fine.as_os_str()];
        nicolson(&[&["plot".as_ref()], &runs[..], &arguments.iter().map(AsRef::as_ref).collect::<Vec<_>>()].concat())
    };
    let path = out.to_str().expect("text");
    let answer = plot(&["--probe", "top.uy", "--out", path]);
    assert_eq!((answer.code, answer.complained.as_str(), answer.said.trim()), (0, "", path));
    let svg = fs::read_to_string(&out).expect("a plot");
    // The blue of the first and the vermilion of the second; the curve and its sample in the legend.
    let lines =
        |colour: &str| svg.lines().filter(|line| line.starts_with("<polyline") && line.contains(colour)).count();
    assert_eq!(lines("#0072B2"), 2, "{svg}");
    assert!(lines("#D55E00") > 5, "dashes");
    for name in ["cöarse steps", "fine steps", "top.uy [m]", "t [s]"] {
        assert!(svg.contains(name), "{name}");
    }
    let picture = directory.path().join("total.png");
    assert_eq!(plot(&["--quantity", "total", "--out", picture.to_str().expect("text")]).code, 0);
    assert_eq!(png_size(&picture), (1520, 920));
    refused(&plot(&["--probe", "top.uz"]), &["top.uz", "did you mean `top.u"]);
    refused(&plot(&["--quantity", "totl"]), &["did you mean `total`?"]);
    refused(&plot(&[]), &["--probe (there are: top.ux", "--quantity (there are: dt, kinetic"]);
    refused(&plot(&["--probe", "top.uy", "--out", "x.pdf"]), &[".svg or .png"]);
}

/// The JSON of the particles inside a report.
fn particles(html: &str) -> Value {
    let begin = "<script type=\"application/json\" id=\"particles\">";
    let rest = html.split(begin).nth(1).expect("particles");
    serde_json::from_str(rest.split("</script>").next().expect("an end")).expect("JSON")
}

fn numbers(base64: &str) -> Vec<f32> {
    let digit = |byte: u8| match byte {
        b'A'..=b'Z' => u32::from(byte - b'A'),
        b'a'..=b'z' => u32::from(byte - b'a') + 26,
        b'0'..=b'9' => u32::from(byte - b'0') + 52,
        b'+' => 62,
        b'/' => 63,
        _ => 0,
    };
    let group = |four: &[u8]| {
        let bits = four.iter().fold(0, |bits, &byte| bits << 6 | digit(byte));
        [(bits >> 16) as u8, (bits >> 8) as u8, bits as u8]
    };
    let bytes: Vec<u8> = base64.as_bytes().chunks_exact(4).flat_map(group).collect();
    bytes.chunks_exact(4).map(|word| f32::from_le_bytes(word.try_into().expect("four bytes"))).collect()
}

/// The report of the whole scene of the issue: under 5 MB, nothing from outside, the frames as they were computed.
#[test]
fn the_report_is_one_file_that_needs_nothing_else() {
    let directory = tempfile::tempdir().expect("a directory");
    let out = directory.path().join("ïmpact <b>");
    assert_eq!(run(&example("impact-hyperelastic"), &out, &["title=a </script> & b"], &["--quiet"]).code, 0);
    let answer = on("report", &out, &[]);
    assert_eq!((answer.code, answer.complained.as_str()), (0, ""));
    let file = out.join("report.html");
    let html = fs::read_to_string(&file).expect("a report");
    assert!(html.len() > 100_000 && html.len() < 5_000_000, "{} bytes", html.len());
    for outside in ["http:", "https:", "@import", "src=\"/", "href=\"", "url("] {
        let inside_svg = "href=\"data:image/png;base64,";
        assert!(!html.replace(inside_svg, "").contains(outside), "{outside}");
    }
    for part in [
        "a &lt;/script&gt; &amp; b",
        "completed",
        "hyperelastic_volumetric",
        "Newton iterations per step",
        "factorisation",
    ] {
        assert!(html.contains(part), "{part}");
    }
    assert_eq!(html.matches("<svg").count(), 6, "energy, two probes, iterations, steps, and the axes of the view");
    let data = particles(&html);
    assert_eq!((data["dim"].as_u64(), data["count"].as_u64()), (Some(2), Some(273)));
    assert_eq!(data["times"].as_array().map(Vec::len), Some(11));
    let labels: Vec<&str> =
        data["fields"].as_array().expect("fields").iter().filter_map(|f| f["label"].as_str()).collect();
    assert_eq!(labels, ["pressure [Pa]", "jacobian", "velocity, magnitude [m/s]", "displacement, magnitude [m]"]);
    // A corner of the block relative to its middle, at the start, and where the probe saw it at the end.
    let (first, last) =
        (numbers(data["frames"][0].as_str().expect("text")), numbers(data["frames"][10].as_str().expect("text")));
    assert_eq!((first.len(), last.len()), (273 * 6, 273 * 6));
    assert_eq!(first[..2], [-1.5, -2.5]);
    let (titles, rows) = table(&out.join("probes.csv"));
    let column = titles.iter().position(|title| title == "corner.ux").expect("a probe");
    let corner = (0..273).find(|&a| first[2 * a..2 * a + 2] == [1.5, -2.5]).expect("the corner");
    let moved = f64::from(last[2 * corner] - first[2 * corner]);
    assert!((moved - rows.last().expect("rows")[column]).abs() < 1e-6, "{moved}");
    in_a_browser(&file, directory.path());
}

/// A browser opens the file without a network and draws the last frame (skipped where there is none, unless
/// `NICOLSON_REQUIRE_BROWSER` is set).
#[expect(clippy::print_stderr, reason = "a skipped check must be visible in the log of the tests")]
fn in_a_browser(file: &Path, directory: &Path) {
    let named = std::env::var("NICOLSON_BROWSER").ok();
    let usual = ["chromium-headless-shell", "chromium", "google-chrome"].map(str::to_owned);
    let works =
        |name: &String| Command::new(name).arg("--version").output().is_ok_and(|answer| answer.status.success());
    let Some(browser) = named.into_iter().chain(usual).find(works) else {
        assert!(std::env::var_os("NICOLSON_REQUIRE_BROWSER").is_none(), "no browser");
        eprintln!("no browser: the report was not opened");
        return;
    };
    let shot = directory.join("shot.png");
    let mut command = Command::new(browser);
    command.args(["--headless", "--no-sandbox", "--window-size=1100,900", "--virtual-time-budget=5000"]);
    command.args(["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--dump-dom"]);
    command.arg(format!("--user-data-dir={}", directory.join("profile").display()));
    command.arg(format!("--screenshot={}", shot.display())).arg(file);
    let answer = command.output().expect("the browser starts");
    let page = String::from_utf8_lossy(&answer.stdout);
    let opening = page.split("<div id=\"view\"").nth(1).and_then(|rest| rest.split('>').next()).unwrap_or_default();
    assert!(opening.contains("data-state=\"ready\"") && opening.contains("data-frame=\"10\""), "{opening}");
    assert!(page.contains("t = 1 s (11/11)"), "the script ran");
    let mut reader = png::Decoder::new(std::io::BufReader::new(fs::File::open(shot).expect("a screenshot")))
        .read_info()
        .expect("a PNG picture");
    let mut pixels = vec![0; reader.output_buffer_size().expect("a size")];
    let info = reader.next_frame(&mut pixels).expect("pixels");
    let samples = info.color_type.samples();
    // Pale blue of particles under tension, which nothing else of the page has.
    let blue =
        pixels.chunks_exact(samples).filter(|c| c[2] > 225 && c[0] > 120 && c[0] < 215 && c[2] > c[0] + 25).count();
    assert!(blue > 2000, "{blue} pixels of particles");
}
