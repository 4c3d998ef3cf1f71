//! Studies with mistakes: exit code 2, the place, a remedy, and nothing is run.

use std::fs;

use super::{example, nicolson};

/// Text of the study after its scene, and parts of the message: place, what, and what to do.
const CASES: &[(&str, &str, &str, &str)] = &[
    ("[grid", ":2:", "not TOML", "tables as"),
    ("[gird]\ntime.step = [0.1]", ":2:2", "unknown key `gird`", "did you mean `grid`?"),
    ("", "study.toml:1:1", "nothing varies", "`[grid]`"),
    ("[grid]", ":2:", "the grid has no keys", "add one"),
    ("grid = 3", ":2:8", "`grid` is not a table", "write `[grid]`"),
    ("[grid]\ntime.step = 0.1", ":3:13", "not a list of values", "time.step = […"),
    ("[grid]\ntime.step = []", ":3:13", "not a list of values", "list its values"),
    ("case = 1", ":2:8", "`case` is not a list of tables", "[[case]]"),
    ("[grid]\ntime.step = [0.1]\n[[case]]\ntime.end = 1", ":4:", "both `[grid]` and `[[case]]`", "remove one"),
    ("[set]\ntime.step = 0.1\n[grid]\ntime.step = [0.1]", ":5:6", "`time.step` is set twice", "one place"),
    ("[[case]]\n[[case.body]]\nspacing = 1", ":3:", "`body` is a list of tables", "body.0.spacing"),
    ("[grid]\nbody.0.counts = [[1, 2]]\nbody.0.spcing = [0.1, 0.2]", ":4:8", "unknown key `spcing`", "`spacing`"),
    ("[grid]\ntime.step = [0.01, -1]", ":3:20", "`step` is -1", "positive"),
    ("[grid]\ntime.scheme = [\"midpoint\", \"midpiont\"]", ":3:", "`midpiont`", "did you mean `midpoint`?"),
    ("[grid]\nbody.7.spacing = [0.1]", ":3:", "has no element 7", "from 0 to 0"),
    ("[grid]\ndimension = [2, 1]", "dam-break.toml:", "(case 2: dimension = 1)", "give 1 component"),
    ("[grid]\ntime.cfl = [0.3, 0.5]", ":3:", "both set the step", "remove one"),
    ("[convergence]\nquantty = \"x\"", ":3:1", "unknown key `quantty`", "did you mean `quantity`?"),
    ("[convergence]\nsizes = [2, 1]\nrefine.time.step = 1", ":2:", "`quantity` is missing", "add `quantity"),
    ("[convergence]\nquantity = 3\nsizes = [2, 1]\nrefine.time.step = 1", ":3:12", "a quantity is a text", "quotes"),
    ("[convergence]\nquantity = \"unknowns\"\nsizes = [2, 1]", ":2:", "no key is refined", "[convergence.refine]"),
    (
        "[convergence]\nquantity = \"unknowns\"\nsizes = [1, 2]\nrefine.time.step = 1",
        ":4:9",
        "do not fall",
        "coarse to fine",
    ),
    (
        "[convergence]\nquantity = \"unknowns\"\nsizes = [1]\nrefine.time.step = 1",
        ":4:9",
        "do not fall",
        "at least two",
    ),
    ("[convergence]\nquantity = \"unknowns\"\nrefine.time.step = 1", ":4:20", "not a list of numbers", "add `sizes"),
    (
        "[convergence]\nquantity = \"unknowns\"\nsizes = [2, 1]\nrefine.time.step = [1, 2, 3]",
        ":5:20",
        "has 3 value(s) for 2 sizes",
        "one value for each",
    ),
    (
        "[convergence]\nquantity = \"unknowns\"\nexact = \"0\"\nrefine.time.step = [0.02, 0.01]",
        ":4:9",
        "`exact` is not a number",
        "extrapolated",
    ),
    (
        "[convergence]\nquantity = \"probes.front.displacment.0\"\nrefine.time.step = [0.02, 0.01]",
        ":3:12",
        "no number `probes.front.displacment.0`",
        "did you mean `probes.front.displacement.0`?",
    ),
    (
        "[convergence]\nquantity = \"errors.displacement.l2\"\nrefine.time.step = [0.02, 0.01]",
        ":3:12",
        "no number `errors.displacement.l2`",
        "there are probes.front.displacement.0",
    ),
];

#[test]
fn mistakes_of_a_study_are_located_before_anything_runs() {
    let directory = tempfile::tempdir().expect("a directory");
    let (file, out) = (directory.path().join("study.toml"), directory.path().join("out"));
    let scene = format!("scene = {:?}\n", example("dam-break").display().to_string());
    let mut wrong = Vec::new();
    let mut check = |text: &str, place: &str, what: &str, remedy: &str| {
        fs::write(&file, text).expect("a file");
        let answer = nicolson(&["sweep".as_ref(), file.as_os_str(), "--out".as_ref(), out.as_os_str()]);
        let said = &answer.complained;
        let place = if place.starts_with(':') { format!("study.toml{place}") } else { place.to_owned() };
        let good = said.contains(&place) && said.contains(what) && said.contains(remedy) && said.starts_with("error: ");
        if answer.code != 2 || !good || !answer.said.is_empty() || out.exists() || !said.contains("help: ") {
            wrong.push(format!("{text}\n{place} {what}, {remedy}\n{} {said}", answer.code));
        }
    };
    for (text, place, what, remedy) in CASES {
        check(&format!("{scene}{text}\n"), place, what, remedy);
    }
    let grid = "[grid]\ntime.step = [0.01]\n";
    check(grid, "study.toml", "the key `scene` is missing", "add `scene");
    check(&format!("scene = 3\n{grid}"), ":1:9", "`scene` is not a text", "write `scene");
    check(
        &format!("scene = \"absent.toml\"\n{grid}"),
        ":1:9",
        "absent.toml cannot be read",
        "from the folder of the study",
    );
    let long: Vec<String> = (0..400).map(|at| (f64::from(at) + 0.5).to_string()).collect();
    let many = format!("{scene}[grid]\ntime.step = [{0}]\ntime.end = [{0}]\n", long.join(", "));
    check(&many, ":2:2", "more than 100000 cases", "split the study");
    assert!(wrong.is_empty(), "{}", wrong.join("\n---\n"));
}

#[test]
fn every_mistake_is_shown_once() {
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("study.toml");
    let scene = example("dam-break").display().to_string();
    let text = format!(
        "scene = {scene:?}\n[grid]\ntime.step = [0.01, -1]\nbody.0.smoothing = [1.2, 0.1, 1.0]\ntime.end = [0.1, 0.2]\n"
    );
    fs::write(&file, text).expect("a file");
    let answer = nicolson(&["sweep".as_ref(), file.as_os_str()]);
    assert_eq!(answer.code, 2);
    assert_eq!(answer.complained.matches("help: ").count(), 2, "{}", answer.complained);
    let absent = nicolson(&["sweep".as_ref(), directory.path().join("absent.toml").as_os_str()]);
    assert!(absent.code == 2 && absent.complained.contains("the study cannot be read"), "{}", absent.complained);
}
