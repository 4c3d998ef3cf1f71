//! A run that is killed at any moment can be restarted, leaves no half-written file, and ends with the same bytes.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use nicolson::output::StoredRun;
use nicolson::simulation::Checkpoint;

use super::files::{BAR, command};
use super::support::{checkpoints, results};

/// Kills of the usual test; `NICOLSON_KILLS` asks for another number.
const KILLS: usize = 20;

/// A number between 0 and 1 (SplitMix64).
fn random(state: &mut u64) -> f64 {
    *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let mut bits = (*state ^ (*state >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    (bits >> 11) as f64 / (1_u64 << 53) as f64
}

fn begin(scene: &Path, out: &Path, restarts: bool) -> Command {
    let mut started = if restarts {
        command(&["restart".as_ref(), out.as_os_str()])
    } else {
        command(&["run".as_ref(), scene.as_os_str(), "--out".as_ref(), out.as_os_str()])
    };
    started.args(["--quiet", "--threads", "1"]).stdout(Stdio::null()).stderr(Stdio::piped());
    started
}

/// Everything with a final name is whole.
fn inspect(out: &Path) {
    for path in checkpoints(out) {
        Checkpoint::read(&path).unwrap_or_else(|error| panic!("{error}"));
    }
    if let Ok(index) = fs::read_to_string(out.join("fields.pvd")) {
        assert!(index.ends_with("</VTKFile>\n"), "{index}");
        let run = StoredRun::open(out).unwrap_or_else(|error| panic!("{error}"));
        for frame in 0..run.frames() {
            run.frame(frame).and_then(|frame| frame.positions()).unwrap_or_else(|error| panic!("{error}"));
        }
    }
    if let Ok(report) = fs::read_to_string(out.join("report.json")) {
        serde_json::from_str::<serde_json::Value>(&report).expect("a whole report");
    }
}

#[test]
fn a_run_that_is_killed_at_any_moment_ends_with_the_same_bytes() {
    let kills = std::env::var("NICOLSON_KILLS").ok().and_then(|text| text.parse().ok()).unwrap_or(KILLS);
    let place = tempfile::tempdir().expect("a directory");
    let scene = place.path().join("bar.toml");
    // Mostly output: a checkpoint every other step, a frame every fourth.
    let text = BAR
        .replace("every_steps = 10", "every_steps = 2")
        .replace("interval = 0.05", "interval = 0.02\nplots = false")
        .replace("end = 0.5", "end = 0.1")
        .replace("[21, 4]", "[11, 3]");
    fs::write(&scene, text).expect("a scene");
    let whole = place.path().join("whole");
    let clock = Instant::now();
    assert!(begin(&scene, &whole, false).status().expect("a run").success());
    let length = clock.elapsed();
    let expected = results(&whole);

    let mut seed = u64::from(std::process::id());
    println!("seed {seed}");
    let out = place.path().join("out");
    let (mut killed, mut finished, mut fresh, mut partial) = (0, 0, 0, 0);
    while killed < kills {
        let restarts = !checkpoints(&out).is_empty();
        fresh += usize::from(!restarts);
        let mut running = begin(&scene, &out, restarts).spawn().expect("the program");
        // A good part of a run, so that it gets on, and some ends are reached.
        sleep(length.mul_f64(0.6 * random(&mut seed)).max(Duration::from_millis(3)));
        let ended = running.try_wait().expect("a process");
        running.kill().expect("kill -9");
        let output = running.wait_with_output().expect("an end");
        let complained = String::from_utf8_lossy(&output.stderr);
        assert!(complained.is_empty(), "{complained}");
        inspect(&out);
        let folders = [out.clone(), out.join("checkpoints")];
        let names = folders.iter().flat_map(fs::read_dir).flatten().flatten().map(|entry| entry.file_name());
        partial += names.filter(|name| name.to_string_lossy().ends_with(".partial")).count();
        if ended.is_none() {
            killed += 1;
            continue;
        }
        assert!(output.status.success(), "{:?}", output.status);
        assert!(results(&out) == expected, "after {killed} kills the results differ");
        finished += 1;
        fs::remove_dir_all(&out).expect("removal");
    }
    // To its end once more.
    let restarts = !checkpoints(&out).is_empty();
    let output = begin(&scene, &out, restarts).output().expect("the program");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let found = results(&out);
    for (name, bytes) in &expected {
        assert!(found.get(name) == Some(bytes), "{name} differs");
    }
    assert_eq!(found.len(), expected.len(), "{:?}", found.keys().collect::<Vec<_>>());
    println!(
        "{killed} kills, {} runs brought to their end with the same bytes; {fresh} begun afresh; {partial} temporary files \
         were left and swept away",
        finished + 1
    );
}
