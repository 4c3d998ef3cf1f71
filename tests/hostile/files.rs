//! Files that are none, never end, or hold something else.

use std::fs;
use std::io::{Seek, SeekFrom, Write};
use std::os::unix::fs::symlink;
use std::process::Command;

use super::{Place, arguments, done, nicolson, on_scene, refused, refused_scene, scene};

/// A pipe that nobody writes into.
fn pipe(place: &Place, name: &str) {
    let status = Command::new("mkfifo").arg(place.path(name)).status().expect("mkfifo");
    assert!(status.success());
}

#[test]
fn scenes_that_are_no_files() {
    let place = Place::new();
    pipe(&place, "pipe.toml");
    symlink("loop.toml", place.path("loop.toml")).expect("a link");
    symlink("/dev/zero", place.path("zero.toml")).expect("a link");
    fs::create_dir(place.path("directory.toml")).expect("a directory");
    for (name, words) in [
        ("pipe.toml", "a pipe"),
        ("loop.toml", "cannot be read"),
        ("zero.toml", "a device"),
        ("/dev/zero", "a device"),
        ("/dev/stdin", "cannot be read"),
        ("directory.toml", "a directory"),
        ("scene.toml/below", "cannot be read"),
        ("absent.toml", "cannot be read"),
        ("/proc/self/mem", "cannot be read"),
    ] {
        for command in ["check", "run", "jacobian"] {
            let answer = nicolson(&place.path(""), &[command, name]);
            refused(&place, name, &answer, &[words, "help: "]);
        }
    }
    let answer = nicolson(&place.path(""), &["list", "."]);
    assert!(answer.code == 0 && answer.said.contains("pipe.toml"), "{}", answer.complained);
}

#[test]
fn scenes_that_hold_something_else() {
    refused_scene("nothing", "", &["scene.toml:1", "`dimension` is missing"]);
    refused_scene("zeros", [0_u8; 4096], &["scene.toml:1", "help"]);
    refused_scene("no text", b"title = \"\xff\xfe\"\n", &["scene.toml:1", "not UTF-8", "encoding"]);
    refused_scene("UTF-16", b"\xff\xfed\0i\0m\0", &["not UTF-8", "encoding"]);
    refused_scene("a long line", format!("title = \"{}", "x".repeat(10_000_000)), &["scene.toml:1", "help"]);
    refused_scene("a large file", vec![b'#'; (1 << 24) + 1], &["16777217 bytes", "help"]);
    let bodies = "[[body]]\n".repeat(20_000);
    refused_scene("many bodies", format!("dimension = 1\n{bodies}[time]\nend = 1\nstep = 1\n"), &["help"]);
}

#[test]
fn marks_and_line_ends_of_other_systems_work() {
    for (case, text) in [
        ("a byte order mark", format!("\u{feff}{}", super::SCENE)),
        ("line ends", super::SCENE.replace('\n', "\r\n")),
        ("both", format!("\u{feff}{}", super::SCENE.replace('\n', "\r\n"))),
        ("no line end at the end", super::SCENE.trim_end().to_owned()),
    ] {
        let place = Place::new();
        place.file("scene.toml", text);
        done(case, &on_scene(&place, "check", &[]));
        done(case, &on_scene(&place, "run", &[]));
    }
    // In lists of points, too.
    let place = Place::new();
    place.file("scene.toml", with_points("cloud.csv"));
    let cloud: String =
        (0..25).map(|i| format!("{},{}\r\n", 0.25 * f64::from(i % 5), 0.25 * f64::from(i / 5))).collect();
    for mark in ["", "\u{feff}"] {
        place.file("cloud.csv", format!("{mark}x,y\r\n{cloud}"));
        done("points", &on_scene(&place, "check", &[]));
        place.file("cloud.csv", format!("{mark}{cloud}"));
        done("points without names", &on_scene(&place, "check", &[]));
    }
}

const BOX: &str = "spacing = 0.25\nshape.box = { lower = [0.0, 0.0], upper = [1.0, 1.0] }";

fn with_points(file: &str) -> String {
    scene(&[(BOX, &format!("points = {{ file = \"{file}\", spacing = 0.25 }}"))])
}

/// Scenes whose body comes from a file of each kind.
fn with(file: &str) -> String {
    if file.ends_with(".msh") {
        scene(&[(BOX, &format!("mesh = {{ file = \"{file}\" }}"))])
    } else if file.ends_with(".stl") {
        let solid = format!("spacing = 0.25\nshape.stl = {{ file = \"{file}\" }}");
        let space = [(BOX, &*solid), ("dimension = 2", "dimension = 3"), ("[0.0, -9.81]", "[0.0, 0.0, -9.81]")];
        scene(&[&space[..], &[("\"x\", \"y\"", "\"x\", \"y\", \"z\"")]].concat())
    } else {
        with_points(file)
    }
}

const KINDS: [&str; 4] = ["part.csv", "part.vtu", "part.msh", "part.stl"];

#[test]
fn geometry_files_that_are_no_files() {
    for kind in KINDS {
        let place = Place::new();
        place.file("scene.toml", with(kind));
        let check = |what: &str, words: &[&str]| {
            refused(&place, &format!("{kind}: {what}"), &on_scene(&place, "check", &[]), words);
            let _ = fs::remove_file(place.path(kind));
        };
        check("absent", &[kind, "cannot be read", "folder of the scene"]);
        pipe(&place, kind);
        check("a pipe", &[kind, "a pipe"]);
        symlink(kind, place.path(kind)).expect("a link");
        check("a loop", &[kind, "cannot be read"]);
        symlink("/dev/zero", place.path(kind)).expect("a link");
        check("endless", &[kind, "a device"]);
        place.file(kind, "");
        check("empty", &[kind, "help"]);
        place.file(kind, [0_u8; 1000]);
        check("zeros", &[kind, "help"]);
        place.file(kind, b"\xff\xfe\xfd,\n".repeat(100));
        check("no text", &[kind, "help"]);
        place.file(kind, super::SCENE);
        check("a scene", &[kind, "help"]);
        // A hole of a terabyte takes no room on the disk.
        let mut hole = fs::File::create(place.path(kind)).expect("a file");
        if hole.seek(SeekFrom::Start(1 << 40)).and_then(|_| hole.write_all(b"1")).is_ok() {
            check("a terabyte", &[kind, "bytes"]);
        }
        fs::create_dir(place.path(kind)).expect("a directory");
        check("a directory", &[kind, "a directory"]);
    }
}

/// A line of three hundred megabytes, in less memory than would hold its numbers.
#[test]
fn lines_without_end() {
    for kind in ["part.csv", "part.msh"] {
        let place = Place::new();
        place.file("scene.toml", with(kind));
        let head = if kind == "part.msh" { "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n" } else { "0,0\n" };
        let mut text = head.as_bytes().to_vec();
        let piece = if kind == "part.msh" { b"1 " } else { b"1," };
        text.extend(piece.iter().copied().cycle().take(300_000_000));
        place.file(kind, &text);
        drop(text);
        refused(&place, kind, &on_scene(&place, "check", &[]), &[kind, "line", "long"]);
    }
}

#[test]
fn geometry_files_that_promise_more_than_they_hold() {
    let vtu = |count: &str, array: &str| {
        format!(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n\
             <UnstructuredGrid><Piece NumberOfPoints=\"{count}\" NumberOfCells=\"0\">\n<Points>\n{array}\n</Points>\n\
             </Piece></UnstructuredGrid>\n</VTKFile>\n"
        )
    };
    let text = "<DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">0 0 0</DataArray>";
    let raw =
        "<DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"appended\" offset=\"18446744073709551615\"/>";
    let mesh = |counts: &str| format!("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n{counts}\n");
    let mut stl = vec![0_u8; 84];
    stl[80..].copy_from_slice(&u32::MAX.to_le_bytes());
    for (kind, content) in [
        ("part.vtu", vtu("18446744073709551615", text).into_bytes()),
        ("part.vtu", vtu("1000000000000", raw).into_bytes()),
        ("part.vtu", vtu("6148914691236517206", text).into_bytes()),
        ("part.msh", mesh("1 1000000000000000000 1 1000000000000000000").into_bytes()),
        ("part.msh", mesh("18446744073709551615 1 1 1\n2 1 0 18446744073709551615").into_bytes()),
        ("part.msh", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n99999999999999999\n1 0 0 0\n".into()),
        ("part.stl", stl),
    ] {
        let place = Place::new();
        place.file("scene.toml", with(kind));
        place.file(kind, content);
        refused(&place, kind, &on_scene(&place, "check", &[]), &[kind, "help"]);
    }
}

#[test]
fn results_that_are_no_files() {
    let place = Place::new();
    done("a run", &on_scene(&place, "run", &[]));
    for name in ["history.csv", "probes.csv", "report.json", "fields.pvd", "fields-00000.vtu"] {
        let path = place.path("out").join(name);
        let kept = fs::read(&path).ok();
        for what in ["pipe", "zeros", "nothing", "device"] {
            let _ = fs::remove_file(&path);
            match what {
                "pipe" => pipe(&place, &format!("out/{name}")),
                "zeros" => drop(place.file(format!("out/{name}"), vec![0_u8; 4096])),
                "nothing" => drop(place.file(format!("out/{name}"), "")),
                _ => symlink("/dev/zero", &path).expect("a link"),
            }
            for command in [&["render", "out"][..], &["report", "out"], &["plot", "out", "--quantity", "total"]] {
                let answer = nicolson(&place.path(""), command);
                let case = format!("{name}: {what}: {command:?}: {}", answer.complained);
                assert!([0, 2].contains(&answer.code), "{case}");
                assert!(answer.code == 0 || answer.complained.starts_with("error: "), "{case}");
            }
        }
        let _ = fs::remove_file(&path);
        if let Some(kept) = kept {
            fs::write(&path, kept).expect("a file");
        }
    }
    let answer = nicolson(&place.path(""), &arguments(&[&"render", &place.path("scene.toml")]));
    assert_eq!(answer.code, 2, "{}", answer.complained);
}
