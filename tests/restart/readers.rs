//! Checkpoints in the hands of others: NumPy, and this program at a later age.

use std::path::Path;
use std::process::Command;

use nicolson::simulation::Checkpoint;

use super::support::{Case, checkpoints, go_on, start};

/// Reads a checkpoint with NumPy and nothing else, and prints what the test knows as well.
const READER: &str = r#"
import json, sys
import numpy as np

with open(sys.argv[1], "rb") as file:
    length = int(np.frombuffer(file.read(8), "<u8")[0])
    header = json.loads(file.read(length))
    data = file.read()
meta = header.pop("__metadata__")
kinds = {"F64": "<f8", "U64": "<u8", "U8": "u1"}
arrays = {}
for name, entry in header.items():
    start, end = entry["data_offsets"]
    arrays[name] = np.frombuffer(data[start:end], kinds[entry["dtype"]]).reshape(entry["shape"])
about = json.loads(meta["about"])
values = arrays["state/values"]
u, v, j = np.split(values, [2 * about["particles"], 4 * about["particles"]])
assert len(j) == about["particles"] and np.isfinite(values).all()
print(meta["format"], about["step"], repr(about["time"]), repr(float(u.min())), repr(float(np.abs(v).max())))
"#;

#[test]
fn numpy_reads_a_checkpoint() {
    let python = std::env::var("NICOLSON_PYTHON").unwrap_or_else(|_| "python3".into());
    if !Command::new(&python).args(["-c", "import numpy"]).output().is_ok_and(|output| output.status.success()) {
        assert!(std::env::var_os("NICOLSON_REQUIRE_READERS").is_none(), "{python} has no NumPy");
        println!("skipped: {python} has no NumPy");
        return;
    }
    let place = tempfile::tempdir().expect("a directory");
    let outcome = start(&Case::solid("crank_nicolson").set("checkpoint", "{ keep = 1 }").scene(), place.path());
    let path = checkpoints(place.path()).pop().expect("a checkpoint");
    let output = Command::new(&python).args(["-c", READER]).arg(&path).output().expect("Python");
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let n = 2 * outcome.report.particles;
    let lowest = outcome.state[..n].iter().copied().fold(f64::INFINITY, f64::min);
    let fastest = outcome.state[n..2 * n].iter().map(|v| v.abs()).fold(0.0, f64::max);
    let words: Vec<&str> = said.split_whitespace().collect();
    assert_eq!(words[..3], ["nicolson", "checkpoint", "8"], "{said}");
    let numbers: Vec<f64> = words[3..].iter().map(|word| word.parse().expect("a number")).collect();
    assert_eq!(numbers, [0.16, lowest, fastest]);
}

/// A checkpoint of format version 1, written when that was new, after four of eight steps with an old factor.
#[test]
fn a_checkpoint_of_the_first_version_can_still_be_continued() {
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/restart/version-1.safetensors");
    if std::env::var_os("NICOLSON_WRITE_GOLDEN").is_some() {
        let place = tempfile::tempdir().expect("a directory");
        let case = Case::solid("crank_nicolson").newton("tangent", "lagged").set("checkpoint.every_steps", "4");
        start(&case.scene(), place.path());
        std::fs::copy(&checkpoints(place.path())[0], &golden).expect("a copy");
    }
    let checkpoint = Checkpoint::read(&golden).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((checkpoint.about.step, checkpoint.about.time, checkpoint.about.particles), (4, 0.08, 36));
    let place = tempfile::tempdir().expect("a directory");
    let scene = checkpoint.scene(&[]).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(checkpoint.differences(&scene), Vec::<String>::new());
    let outcome = go_on(&golden, &place.path().join("golden"));
    let whole = start(&scene, &place.path().join("whole"));
    assert_eq!(outcome.report.steps, whole.report.steps);
    // To rounding: later versions may sum in another order.
    let size = whole.state.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    for (a, b) in outcome.state.iter().zip(&whole.state) {
        assert!((a - b).abs() <= 1e-7 * size, "{a} {b}");
    }
}
