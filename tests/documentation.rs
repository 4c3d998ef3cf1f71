//! What the README and the pages promise exists: scenes have pages, links have targets, commands are understood, excerpts
//! are those of the scenes. The numbers come from `examples/verification/reproduce.sh`.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use nicolson::scene::Scene;
use nicolson::study::Study;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Files of a folder with an extension, sorted.
fn files(folder: &str, extension: &str) -> Vec<PathBuf> {
    let entries = fs::read_dir(root().join(folder)).expect("a folder").map(|entry| entry.expect("an entry").path());
    let mut found: Vec<_> = entries.filter(|path| path.extension().is_some_and(|e| e == extension)).collect();
    found.sort();
    found
}

fn stem(path: &Path) -> String {
    path.file_stem().expect("a name").to_string_lossy().into_owned()
}

/// Pages of scenes, the index left out.
fn pages() -> Vec<PathBuf> {
    files("examples/verification", "md").into_iter().filter(|path| stem(path) != "README").collect()
}

fn documents() -> Vec<PathBuf> {
    let mut all = vec![
        "README.md",
        "CONTRIBUTING.md",
        "tests/README.md",
        "examples/verification/README.md",
        "examples/studies/README.md",
    ]
    .into_iter()
    .map(|name| root().join(name))
    .collect::<Vec<_>>();
    all.extend(files("examples", "md"));
    all.extend(pages());
    all
}

#[test]
fn every_scene_has_its_page() {
    let names: BTreeSet<String> = files("examples", "toml").iter().map(|path| stem(path)).collect();
    assert!(names.len() > 20, "{names:?}");
    assert_eq!(pages().iter().map(|path| stem(path)).collect::<BTreeSet<_>>(), names, "scenes on the right");
    let index = read(&root().join("examples/verification/README.md"));
    for name in &names {
        assert!(index.contains(&format!("({name}.md)")), "the index lacks {name}");
        let page = read(&root().join(format!("examples/verification/{name}.md")));
        assert!(page.contains(&format!("\n    nicolson run examples/{name}.toml ")), "{name}: no command");
        let picture = page.contains(&format!("(../pictures/verification/{name}.")); // png or svg
        assert!(picture, "{name}: no figure of its own");
        let (_, rest) = page.split_once("<!-- measured -->\n").unwrap_or_else(|| panic!("{name}: no table"));
        let (table, _) = rest.split_once("<!-- end -->").unwrap_or_else(|| panic!("{name}: no end of the table"));
        assert!(table.lines().count() > 2, "{name}: the table is empty");
    }
}

#[test]
fn excerpts_stand_in_their_scenes() {
    for path in pages() {
        let (name, page) = (stem(&path), read(&path));
        let scene = read(&root().join(format!("examples/{name}.toml")));
        let lines: BTreeSet<&str> = scene.lines().collect();
        let (_, rest) = page.split_once("```toml\n").unwrap_or_else(|| panic!("{name}: no excerpt"));
        let (excerpt, _) = rest.split_once("```").expect("a fence");
        for line in excerpt.lines().filter(|line| !line.is_empty()) {
            assert!(lines.contains(line), "{name}: the scene has no line `{line}`");
        }
    }
}

#[test]
fn the_scene_of_the_readme_is_one() {
    let readme = read(&root().join("README.md"));
    let (_, rest) = readme.split_once("```toml\n").expect("a scene");
    let (text, _) = rest.split_once("```").expect("a fence");
    let scene = Scene::parse(text, "README.md", Path::new(""), &[]).unwrap_or_else(|errors| panic!("{errors}"));
    assert!(scene.setup::<2>().is_ok());
}

/// Targets of links and pictures, `[…](target)`, outside of code.
fn links(text: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut fenced = false;
    for line in text.lines() {
        fenced ^= line.starts_with("```");
        if fenced || line.starts_with("    ") {
            continue;
        }
        for part in line.split("](").skip(1) {
            found.extend(part.split_once(')').map(|(target, _)| target.to_owned()));
        }
    }
    found
}

/// The anchor of a heading, as the usual renderers make it.
fn anchor(heading: &str) -> String {
    let kept = heading.to_lowercase();
    kept.chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c)).map(|c| if c == ' ' { '-' } else { c }).collect()
}

#[test]
fn links_have_targets() {
    let mut checked = 0;
    for document in documents() {
        let own = read(&document);
        for target in links(&own) {
            if target.contains("://") {
                continue;
            }
            let (file, fragment) = target.split_once('#').map_or((target.as_str(), None), |(f, a)| (f, Some(a)));
            let path = if file.is_empty() { document.clone() } else { document.with_file_name("").join(file) };
            assert!(path.exists(), "{}: nothing at {target}", document.display());
            if let Some(fragment) = fragment {
                let text = read(&path);
                let mut headings = text.lines().filter_map(|line| line.strip_prefix('#'));
                let there = headings.any(|heading| anchor(heading.trim_start_matches('#').trim()) == fragment);
                assert!(there, "{}: no heading for {target}", document.display());
            }
            checked += 1;
        }
    }
    assert!(checked > 100, "{checked}");
}

#[test]
fn pictures_are_small_and_used() {
    let text: String = documents().iter().map(|path| read(path)).collect();
    for (folder, most) in [("examples/pictures", 1_500_000), ("examples/pictures/verification", 85_000)] {
        for path in ["png", "svg", "gif"].into_iter().flat_map(|extension| files(folder, extension)) {
            let name = path.file_name().expect("a name").to_string_lossy().into_owned();
            assert!(text.contains(&format!("/{name})")), "{name} is not shown anywhere");
            let size = fs::metadata(&path).expect("a file").len();
            assert!(size < most, "{name}: {size} bytes");
        }
    }
}

/// The words of a line, with single quotes as a shell takes them.
fn words(line: &str) -> Vec<String> {
    let mut found = vec![String::new()];
    for (index, part) in line.split('\'').enumerate() {
        if index % 2 == 1 {
            found.last_mut().expect("a word").push_str(part);
            continue;
        }
        for (i, word) in part.split(' ').enumerate() {
            if i > 0 {
                found.push(String::new());
            }
            found.last_mut().expect("a word").push_str(word);
        }
    }
    found.retain(|word| !word.is_empty());
    found
}

/// Command lines of a document without placeholders: what follows `nicolson`.
fn commands(text: &str) -> Vec<Vec<String>> {
    let starts = ["    nicolson ", "    cargo run --release -- ", "    $ nicolson "];
    let lines = text.lines().filter_map(|line| starts.iter().find_map(|start| line.strip_prefix(start)));
    // SCENE.toml, RUN_DIR, [--out DIR]: the general form of a command.
    let placeholder = |word: &str| {
        let letters: Vec<char> = word.trim_start_matches('[').chars().take(3).collect();
        letters.len() == 3 && letters.iter().all(char::is_ascii_uppercase)
    };
    let whole = lines.filter(|line| !line.contains('…') && !line.split(' ').any(placeholder));
    // A comment after the command.
    whole.map(|line| words(line.split("    ").next().unwrap_or(line))).collect()
}

/// `--help` at the end: everything before it is parsed, nothing is done.
fn understood(arguments: &[String]) -> Result<(), String> {
    let output = Command::new(env!("CARGO_BIN_EXE_nicolson"))
        .args(arguments)
        .arg("--help")
        .stdin(Stdio::null())
        .output()
        .expect("the program starts");
    if output.status.success() { Ok(()) } else { Err(String::from_utf8_lossy(&output.stderr).into_owned()) }
}

#[test]
fn commands_are_understood() {
    let line = |text: &str| words(text);
    assert!(understood(&line("run x.toml --sett a=1")).is_err(), "the check bites");
    assert!(understood(&line("run x.toml --threads many")).is_err(), "the check bites");
    let mut options = BTreeSet::new();
    let mut scenes = 0;
    for document in documents() {
        for command in commands(&read(&document)) {
            let what = format!("{}: nicolson {}", document.display(), command.join(" "));
            // Values and places differ from line to line; what the parser sees of them does not.
            let shape: Vec<String> =
                command.iter().filter(|word| word.starts_with("--") || **word == command[0]).cloned().collect();
            if options.insert(shape) {
                understood(&command).unwrap_or_else(|error| panic!("{what}\n{error}"));
            }
            if let Some(study) = command.iter().find(|word| word.starts_with("examples/studies/")) {
                Study::read(&root().join(study)).unwrap_or_else(|errors| panic!("{what}\n{errors}"));
                continue;
            }
            let Some(scene) = command.iter().find(|word| word.starts_with("examples/") && word.ends_with(".toml"))
            else {
                continue;
            };
            let sets = command.windows(2).filter(|pair| pair[0] == "--set");
            let overrides: Vec<_> = sets
                .map(|pair| pair[1].split_once('=').unwrap_or_else(|| panic!("{what}: no value")))
                .map(|(key, value)| (key.to_owned(), value.to_owned()))
                .collect();
            // The README shows one mistake, and what is said about it.
            if overrides.iter().any(|(key, value)| key == "time.step" && value == "-1") {
                continue;
            }
            Scene::read(&root().join(scene), &overrides).unwrap_or_else(|errors| panic!("{what}\n{errors}"));
            scenes += 1;
        }
    }
    assert!(scenes > 80, "{scenes}");
}

/// What a newcomer types, one command after the other, where there are only the scenes.
#[test]
fn the_first_hour_works() {
    let place = tempfile::tempdir().expect("a directory");
    for file in ["bracket.toml", "bracket.stl", "studies/bracket-stiffness.toml"] {
        let copy = place.path().join("examples").join(file);
        fs::create_dir_all(copy.parent().expect("a directory")).expect("a directory");
        fs::copy(root().join("examples").join(file), copy).expect("a copy");
    }
    let commands = commands(&read(&root().join("examples/first-hour.md")));
    for verb in ["check", "run", "render", "plot", "restart", "report", "sweep", "collect"] {
        assert!(commands.iter().any(|command| command[0] == verb), "no {verb}");
    }
    for command in &commands {
        let program = Command::new(env!("CARGO_BIN_EXE_nicolson")).args(command).current_dir(place.path()).output();
        let output = program.expect("the program runs");
        assert!(output.status.success(), "{command:?}\n{}", String::from_utf8_lossy(&output.stderr));
    }
    for made in ["bracket.png", "bracket-last.png", "bracket.gif", "top.svg", "bracket.html"] {
        assert!(fs::metadata(place.path().join(made)).is_ok_and(|file| file.len() > 1000), "{made}");
    }
    let table = read(&place.path().join("materials.csv"));
    assert_eq!(table.lines().filter(|line| line.contains(",completed,")).count(), 3, "{table}");
    let report = read(&place.path().join("results/bracket/report.json"));
    assert!(report.contains("\"time_reached\": 0.0005"), "the restarted run goes on to its new end");
}
