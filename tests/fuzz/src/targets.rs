//! What is fuzzed: plain functions of bytes, which `tests/corpus.rs` runs over the corpus as well. Whatever the bytes, no
//! panic, and every mistake has words.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use nicolson::expression::Expression;
use nicolson::geometry::{
    MeshPoints, PointError, Surface, mesh_particles, read_faces, read_msh, read_points, read_stl, read_vtu,
};
use nicolson::model::Model;
use nicolson::output::{StoredFrame, StoredTable, parse_container};
use nicolson::scene::{Scene, SceneErrors};
use nicolson::simulation::{Checkpoint, RunOptions, Silent, restart};
use nicolson::tensor::Vector;

/// A reader, and the folder of `corpus/` with its seeds.
pub struct Target {
    /// Name, and name of the folder.
    pub name: &'static str,
    /// Reads the bytes.
    pub run: fn(&[u8]),
}

/// All targets.
pub const TARGETS: &[Target] = &[
    Target { name: "scene", run: scene },
    Target { name: "expression", run: expression },
    Target { name: "points", run: points },
    Target { name: "stl", run: stl },
    Target { name: "msh", run: msh },
    Target { name: "vtu", run: vtu },
    Target { name: "table", run: table },
    Target { name: "frame", run: frame },
    Target { name: "checkpoint", run: checkpoint },
];

/// Most particles of a scene: what is looked for depends on the text, not on the size.
const MOST_PARTICLES: usize = 200;
/// Most triangles whose surface is looked at more closely: all of them are asked about every point.
const MOST_TRIANGLES: usize = 500;

/// Scene files: text, settings, particles, selections, and the forces of the first moment.
fn scene(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    let scene = match Scene::parse(&text, "scene.toml", Path::new("/nonexistent"), &[]) {
        Ok(scene) => scene,
        Err(errors) => return explained(&errors),
    };
    // What was understood can be told and understood again.
    assert!(Scene::parse(scene.text(), "scene.toml", Path::new("/nonexistent"), &[]).is_ok());
    match scene.dimension() {
        1 => model::<1>(&scene),
        2 => model::<2>(&scene),
        _ => model::<3>(&scene),
    }
}

fn explained(errors: &SceneErrors) {
    assert!(!errors.is_empty());
    assert!(errors.iter().all(|error| !error.message.is_empty() && !error.remedy.is_empty()));
    assert!(!errors.to_string().is_empty());
}

fn model<const D: usize>(scene: &Scene) {
    let setup = match scene.setup_within::<D>(MOST_PARTICLES) {
        Ok((setup, _)) => setup,
        Err(errors) => return explained(&errors),
    };
    let Ok(mut model) = Model::new(setup, None, None) else { return };
    let Ok(state) = model.initial_state() else { return };
    // Denormal densities give forces that are not finite; a run finds out in its first step.
    let _ = model.forces_at(0.0, &state, &mut Vec::new());
}

/// Expressions: parse, evaluate, differentiate.
fn expression(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    match Expression::parse(&text) {
        Ok(expression) => {
            let values: Vec<f64> = [[0.0, 0.0, 0.0], [1.5, -2.5, 1e300], [-1e-308, 0.5, f64::MAX]]
                .into_iter()
                .flat_map(|place| [expression.value(place, 0.25), expression.rate(place, 0.25)])
                .collect();
            if !expression.depends_on_time() && !expression.depends_on_position() {
                assert!(values[0].to_bits() == values[2].to_bits() || values[0].is_nan() && values[2].is_nan());
            }
            assert!(Expression::parse(expression.text()).is_ok());
        }
        Err(error) => {
            assert!(!error.message.is_empty() && !error.remedy.is_empty());
            assert!(error.span.start <= error.span.end && error.span.end <= text.len(), "{error:?}");
        }
    }
}

fn told(errors: &[PointError]) {
    assert!(!errors.is_empty());
    assert!(errors.iter().all(|error| !error.message.is_empty() && !error.remedy.is_empty()));
}

/// Lists of points and of faces; the first byte tells the dimension and the kind.
fn points(data: &[u8]) {
    let Some((first, rest)) = data.split_first() else { return };
    let text = String::from_utf8_lossy(rest);
    match first % 3 {
        0 => lists::<1>(&text),
        1 => lists::<2>(&text),
        _ => lists::<3>(&text),
    }
}

fn lists<const D: usize>(text: &str) {
    match read_points::<D>(text, 0.1) {
        Ok(particles) => {
            assert!(!particles.positions.is_empty());
            assert!(particles.positions.iter().flatten().all(|x| x.is_finite()));
            assert!(particles.volumes.iter().all(|volume| *volume > 0.0));
        }
        Err(errors) => told(&errors),
    }
    let corners = (0..1 << D).map(|corner| Vector::<D>::from_fn(|axis, _| f64::from(corner >> axis & 1)));
    let cloud = nicolson::setup::Particles {
        positions: corners.collect(),
        volumes: vec![0.1; 1 << D],
        kernel_volumes: vec![0.1; 1 << D],
        ..Default::default()
    };
    match read_faces::<D>(text, &cloud, 1.0) {
        Ok(faces) => assert!(faces.iter().all(|face| face.particle < 1 << D && face.area > 0.0)),
        Err(errors) => told(&errors),
    }
}

/// Triangles, and what a surface makes of them.
fn stl(data: &[u8]) {
    match read_stl(data) {
        Ok(triangles) if triangles.len() <= MOST_TRIANGLES => {
            let surface = Surface::new(triangles);
            let (lower, upper) = surface.bounds();
            for place in [lower, (lower + upper) * 0.5, upper + (upper - lower)] {
                let _ = (surface.winding(&place), surface.signed_distance(&place));
            }
            let _ = (surface.volume(), surface.moment(), surface.open_edges());
        }
        Ok(_) => {}
        Err(errors) => told(&errors),
    }
}

/// Meshes, and the particles of their cells and nodes.
fn msh(data: &[u8]) {
    let mesh = match read_msh(data) {
        Ok(mesh) => mesh,
        Err(error) => return told(&[error]),
    };
    assert!(mesh.elements.iter().all(|element| element.nodes.len() == element.form.size().1));
    assert!(mesh.elements.iter().flat_map(|element| &element.nodes).all(|node| *node < mesh.nodes.len()));
    for points in [MeshPoints::Cells, MeshPoints::Nodes] {
        let volumes = [
            mesh_particles::<1>(&mesh, points, None).map(|meshed| meshed.particles.volumes),
            mesh_particles::<2>(&mesh, points, None).map(|meshed| meshed.particles.volumes),
            mesh_particles::<3>(&mesh, points, None).map(|meshed| meshed.particles.volumes),
        ];
        assert!(volumes.iter().flatten().flatten().all(|volume| *volume > 0.0));
    }
}

/// Points of other programs.
fn vtu(data: &[u8]) {
    match read_vtu(data) {
        Ok(found) => {
            assert!(!found.points.is_empty());
            assert!(found.volumes.is_none_or(|volumes| volumes.len() == found.points.len()));
        }
        Err(error) => told(&[error]),
    }
}

/// Histories and probes, which `plot` and `report` read.
fn table(data: &[u8]) {
    match StoredTable::parse(Path::new("history.csv"), data) {
        Ok(table) => {
            let names = table.names().iter();
            assert!(names.filter_map(|name| table.get(name)).all(|column| column.len() == table.rows()));
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}

/// Frames, which `render` and `report` read.
fn frame(data: &[u8]) {
    let frame = match StoredFrame::parse(Path::new("fields.vtu"), data.to_vec()) {
        Ok(frame) => frame,
        Err(error) => return assert!(!error.to_string().is_empty()),
    };
    if let Ok(positions) = frame.positions() {
        assert_eq!(positions.len(), 3 * frame.points());
    }
    for (name, components) in frame.fields() {
        if let Ok(Some(field)) = frame.field(name) {
            // Of fields with the same name the first is given.
            assert!(field.components == components || frame.fields().filter(|(other, _)| *other == name).count() > 1);
            assert_eq!(field.values.len(), field.components * frame.points());
        }
    }
    let _ = frame.provenance();
}

/// Checkpoints: the file, and with any checksum what a run makes of its content before its first step.
fn checkpoint(data: &[u8]) {
    let path = Path::new("step-0000000001.safetensors");
    if let Err(error) = parse_container(path, data, true) {
        assert!(!error.to_string().is_empty());
    }
    let Ok((about, arrays)) = parse_container(path, data, false) else { return };
    let Ok(about) = serde_json::from_str(&about) else { return };
    let checkpoint = Checkpoint { path: PathBuf::from(path), about, arrays };
    let scene = match checkpoint.scene(&[]) {
        Ok(scene) => scene,
        Err(errors) => return explained(&errors),
    };
    let small = match scene.dimension() {
        1 => scene.setup_within::<1>(MOST_PARTICLES).is_ok(),
        2 => scene.setup_within::<2>(MOST_PARTICLES).is_ok(),
        _ => scene.setup_within::<3>(MOST_PARTICLES).is_ok(),
    };
    if small {
        let interrupted = AtomicBool::new(true);
        let outcome = restart(&scene, &checkpoint, false, &RunOptions::default(), &mut Silent, &interrupted);
        assert!(outcome.map_or_else(|error| !error.to_string().is_empty(), |_| true));
    }
}
