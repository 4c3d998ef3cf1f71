//! STL, Gmsh and VTU files, good and hostile, through the reader of scenes and through the program.

use std::f64::consts::PI;
use std::fs;

use nicolson::geometry::{Triangle, write_stl};
use nicolson::output::{Frame, Precision};
use nicolson::tensor::Vector;

use super::support::written::read;
use super::{example, good, nicolson, scene};

/// A sphere of radius 1, or a torus of radii 1 and `tube`.
fn round(n: usize, m: usize, tube: Option<f64>) -> Vec<Triangle> {
    let point = |i: usize, j: usize| {
        let around = 2.0 * PI * (i % n) as f64 / n as f64;
        let (radius, height) = match tube {
            Some(tube) => {
                let angle = 2.0 * PI * (j % m) as f64 / m as f64;
                (1.0 + tube * angle.cos(), tube * angle.sin())
            }
            None if j == 0 => (0.0, -1.0),
            None if j == m => (0.0, 1.0),
            None => ((PI * j as f64 / m as f64).sin(), -(PI * j as f64 / m as f64).cos()),
        };
        [radius * around.cos(), radius * around.sin(), height].into()
    };
    let mut triangles: Vec<Triangle> = Vec::new();
    for (i, j) in (0..n).flat_map(|i| (0..m).map(move |j| (i, j))) {
        let [a, b, c, d] = [point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)];
        triangles.extend([[a, b, c], [a, c, d]].into_iter().filter(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0]));
    }
    triangles
}

#[test]
fn stl_files_are_filled() {
    let folder = tempfile::tempdir().expect("a folder");
    let sphere = round(80, 40, None);
    fs::write(folder.path().join("sphère 1.stl"), write_stl(&sphere)).expect("a file");
    fs::write(folder.path().join("torus.stl"), write_stl(&round(100, 50, Some(0.4)))).expect("a file");
    for (file, spacing, volume) in [("sphère 1", 0.1, 4.0 / 3.0 * PI), ("torus", 0.14, 2.0 * PI * PI * 0.16)] {
        let body = format!("spacing = {spacing}\nshape.stl = {{ file = '{file}.stl', shift = [1, 2, 3] }}");
        let (setup, warnings) = good::<3>(&body, "", folder.path());
        let particles = &setup.particles;
        let found: f64 = particles.volumes.iter().sum();
        assert!((found / volume - 1.0).abs() < 5e-3, "{file}: {found} {volume}");
        let centre = particles.positions.iter().zip(&particles.volumes).map(|(x, v)| x * *v).sum::<Vector<3>>() / found;
        assert!((centre - Vector::<3>::from([1.0, 2.0, 3.0])).norm() < 0.1 * spacing, "{file}: {centre}");
        let record = &setup.geometry[0];
        assert_eq!((record.open_edges, record.thin_cells, record.has_faces), (Some(0), 0, true));
        assert!((record.mass - 2.0 * found).abs() < 1e-12 && record.mass_error.unwrap().abs() < 1e-12);
        assert!(warnings.is_empty(), "{warnings:?}");
    }
    // One triangle in a hundred is missing.
    let holed: Vec<Triangle> = sphere.iter().enumerate().filter(|(i, _)| i % 100 != 50).map(|(_, t)| *t).collect();
    fs::write(folder.path().join("holed.stl"), write_stl(&holed)).expect("a file");
    let (setup, warnings) = good::<3>("spacing = 0.2\nshape.stl.file = 'holed.stl'", "", folder.path());
    assert!(setup.particles.faces.is_empty() && setup.geometry[0].open_edges > Some(90));
    assert!(warnings[0].contains("open edges") && warnings[0].contains("winding number"), "{warnings:?}");
    let volume: f64 = setup.particles.volumes.iter().sum();
    assert!((volume / (4.0 / 3.0 * PI) - 1.0).abs() < 0.02, "{volume}");
}

const MESH: &str = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n3\n1 7 \"clamp\"\n1 8 \"pull\"\n2 9 \"plate\"\n\
    $EndPhysicalNames\n$Nodes\n9\n1 0 0 0\n2 1 0 0\n3 2 0 0\n4 0 1 0\n5 1.1 0.9 0\n6 2 1 0\n7 0 2 0\n8 1 2 0\n9 2 2 0\n\
    $EndNodes\n$Elements\n8\n1 1 2 7 1 1 4\n2 1 2 7 1 4 7\n3 1 2 8 1 3 6\n4 1 2 8 1 6 9\n5 3 2 9 1 1 2 5 4\n\
    6 3 2 9 1 2 3 6 5\n7 3 2 9 1 4 5 8 7\n8 3 2 9 1 5 6 9 8\n$EndElements\n";

#[test]
fn meshes_bring_their_groups() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("plate.msh"), MESH).expect("a file");
    let rest = "[[boundary]]\nselect.group = 'clamp'\nfix = ['x', 'y']\n[[traction]]\ngroup = 'pull'\nvalue = [1, 0]";
    for (kind, particles, held) in [("cells", 4, vec![0, 2]), ("nodes", 9, vec![0, 3, 6])] {
        let body = format!("mesh = {{ file = 'plate.msh', particles = '{kind}', group = 'plate' }}");
        let (setup, _) = good::<2>(&body, rest, folder.path());
        assert_eq!(setup.particles.positions.len(), particles);
        assert!((setup.particles.volumes.iter().sum::<f64>() - 4.0).abs() < 1e-14);
        let fixed = |a: &usize| setup.constraints[*a][0] == nicolson::setup::Constraint::Fixed;
        assert_eq!((0..particles).filter(fixed).collect::<Vec<_>>(), held);
        let pulled: f64 = setup.tractions[0].areas.iter().map(|(_, area)| area).sum();
        assert!((pulled - 2.0).abs() < 1e-14, "{pulled}");
    }
    let error = |body: &str| read::<2>(&scene(2, body, rest), folder.path()).expect_err(body).to_string();
    assert!(error("mesh = { file = 'plate.msh', group = 'plat' }").contains("it has plate"));
    assert!(error("mesh = { file = 'none.msh' }").contains("none.msh cannot be read"));
    assert!(error("mesh = { file = '/dev/zero' }").contains("it is not a file"));
    assert!(error("mesh = { file = 'plate.msh' }\nspacing = 1").contains("`spacing` belongs to lattices"));
    fs::write(folder.path().join("cut.msh"), &MESH[..MESH.len() / 2]).expect("a file");
    let cut = error("mesh = { file = 'cut.msh' }");
    assert!(cut.contains("cut.msh:") && cut.contains("help: "), "{cut}");
}

#[test]
fn points_come_from_frames() {
    let folder = tempfile::tempdir().expect("a folder");
    let positions: Vec<f64> = (0..25).flat_map(|i| [f64::from(i % 5), f64::from(i / 5)]).collect();
    let volumes = vec![0.5; 25];
    let frame = |positions: &[f64]| {
        let frame = Frame {
            time: 0.0,
            dim: 2,
            positions,
            scalars: vec![("volume", volumes.as_slice().into())],
            vectors: Vec::new(),
            tensors: Vec::new(),
            provenance: "{}",
        };
        frame.write(&folder.path().join("a.vtu"), Precision::Double).expect("a file");
    };
    frame(&positions);
    let body = "points = { file = 'a.vtu', spacing = 1 }";
    let (setup, _) = good::<2>(body, "", folder.path());
    assert_eq!((setup.particles.positions.len(), setup.particles.volumes[3]), (25, 0.5));
    assert_eq!((setup.geometry[0].mass, setup.geometry[0].has_faces), (25.0, false));
    let error = |dimension: usize| {
        let text = scene(dimension, body, "");
        let outcome = if dimension == 1 {
            read::<1>(&text, folder.path()).map(drop)
        } else {
            read::<2>(&text, folder.path()).map(drop)
        };
        outcome.expect_err("a mistake").to_string()
    };
    assert!(error(1).contains("is not in 1 dimensions"));
    let mut twice = positions.clone();
    twice[4] = twice[2];
    frame(&twice);
    assert!(error(2).contains("points 1 and 2 are the same"));
    twice[4] = f64::NAN;
    frame(&twice);
    assert!(error(2).contains("point 2 is not finite"));
}

#[test]
fn hostile_files_give_exit_2() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    let cube = write_stl(&round(8, 4, None));
    let mut huge = cube.clone();
    huge[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
    let mut nan = cube.clone();
    nan[96..100].copy_from_slice(&f32::NAN.to_le_bytes());
    let mut vast = cube.clone();
    vast[96..100].copy_from_slice(&f32::MAX.to_le_bytes());
    let files: Vec<(&str, Vec<u8>)> = vec![
        ("empty.stl", Vec::new()),
        ("huge.stl", huge),
        ("nan.stl", nan),
        ("vast.stl", vast),
        ("cut.stl", cube[..200].to_vec()),
        ("noise.stl", (0..5000_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect()),
        ("text.stl", b"solid \xff\xfe\nfacet normal 0 0 1\nouter loop\nvertex 1e999 0 0\n".to_vec()),
    ];
    for (name, bytes) in &files {
        fs::write(at(name), bytes).expect("a file");
        let text = scene(3, &format!("spacing = 0.2\nshape.stl.file = '{name}'"), "");
        fs::write(at("scene.toml"), text).expect("a file");
        let output = nicolson(&["check", "scene.toml"], folder.path());
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{name}: {said}");
        assert!(said.contains("help: ") && !said.contains("panicked"), "{name}: {said}");
    }
}

#[test]
fn check_draws_a_preview_and_reports_the_geometry() {
    let folder = tempfile::tempdir().expect("a folder");
    let bracket = example("bracket.toml");
    let path = bracket.to_string_lossy();
    let output = nicolson(&["check", &path, "--preview", "seen é.png"], folder.path());
    let said = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(said.contains("triangles          24, open edges 0") && said.contains("seen é.png"), "{said}");
    let picture = fs::read(folder.path().join("seen é.png")).expect("the picture");
    assert!(picture.starts_with(b"\x89PNG") && picture.len() > 10_000);
    let drawing = fs::read_to_string(folder.path().join("seen é.svg")).expect("the drawing");
    assert!(
        drawing.contains("fixed: ") && drawing.contains("loaded: ") && drawing.contains("Bracket, clamped and hit")
    );
    assert_eq!(nicolson(&["check", &path, "--preview", "seen.jpg"], folder.path()).status.code(), Some(2));
    assert_eq!(nicolson(&["check", &path, "--preview", "none/seen.png"], folder.path()).status.code(), Some(3));
    assert_eq!(nicolson(&["check", &path, "--preview"], folder.path()).status.code(), Some(0));
    assert!(folder.path().join("bracket-preview.png").exists());
}
