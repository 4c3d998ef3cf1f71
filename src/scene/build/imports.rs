//! Bodies from files: lists of points, and meshes. Paths are sought from the folder of the scene.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::shapes::Filled;
use crate::geometry::{
    MeshPoints, MeshedError, PointError, adapt_volumes, enclosed, mesh_particles, read_faces, read_msh, read_points,
    read_vtu, repeated_points,
};
use crate::scene::document::{MeshPointsText, MeshText, PointsText, Text};
use crate::scene::errors::SceneError;
use crate::scene::findings::Findings;
use crate::setup::{GeometryRecord, Particles};
use crate::tensor::Vector;
use crate::{files, machine};

/// Largest file that is read, bytes.
const LARGEST: u64 = 1 << 33;
/// Most characters of a line that a message holds: it shows those around the mistake.
const LONGEST_SHOWN: usize = 4000;
/// How far points of a plane may leave it, over their extent.
const OFF_PLANE: f64 = 1e-9;

/// Particles of a list of points.
pub(super) fn points<const D: usize>(text: &PointsText, base: &Path, findings: &mut Findings<'_>) -> Option<Filled<D>> {
    let spacing = findings.positive(&text.spacing, "spacing");
    // The file has the units of the scene.
    let unit = findings.units.length();
    let is_vtu = Path::new(text.file.get_ref()).extension().is_some_and(|end| end.eq_ignore_ascii_case("vtu"));
    let particles = spacing.and_then(|spacing| {
        let spacing = spacing / unit;
        if is_vtu { vtu(&text.file, spacing, base, findings) } else { csv(&text.file, spacing, base, findings) }
    });
    let faces = text.faces.as_ref().map(|faces| (faces, content(faces, base, findings)));
    let (spacing, mut particles) = (spacing?, particles?);
    if let Some((key, found)) = faces {
        let (path, list) = found?;
        match read_faces(&list, &particles, spacing / unit) {
            Ok(faces) => particles.faces = faces,
            Err(errors) => {
                for error in errors {
                    findings.elsewhere(key.span(), in_file(&path, &list, error));
                }
                return None;
            }
        }
        let (volume, moment) = enclosed(&particles);
        if volume <= 0.0 || volume.is_nan() {
            let message = format!("the faces enclose a volume of {volume}");
            findings.error(key.span(), message, "give every piece of the boundary its outward normal");
            return None;
        }
        adapt_volumes(&mut particles, volume, &moment);
    }
    if unit != 1.0 {
        enlarge(&mut particles, unit);
    }
    let record = GeometryRecord {
        source: text.file.get_ref().clone(),
        has_faces: !particles.faces.is_empty(),
        ..GeometryRecord::default()
    };
    Some(Filled { particles, spacing, groups: BTreeMap::new(), record: Some(record) })
}

/// Particles in another unit of length.
fn enlarge<const D: usize>(particles: &mut Particles<D>, unit: f64) {
    let volume = unit.powi(D as i32);
    particles.positions.iter_mut().for_each(|position| *position *= unit);
    particles.volumes.iter_mut().chain(&mut particles.kernel_volumes).for_each(|own| *own *= volume);
    for face in &mut particles.faces {
        face.point *= unit;
        face.area *= volume / unit;
    }
}

fn csv<const D: usize>(file: &Text, spacing: f64, base: &Path, findings: &mut Findings<'_>) -> Option<Particles<D>> {
    let (path, list) = content(file, base, findings)?;
    match read_points::<D>(&list, spacing) {
        Ok(particles) => Some(particles),
        Err(errors) => {
            for error in errors {
                findings.elsewhere(file.span(), in_file(&path, &list, error));
            }
            None
        }
    }
}

fn vtu<const D: usize>(file: &Text, spacing: f64, base: &Path, findings: &mut Findings<'_>) -> Option<Particles<D>> {
    let (path, bytes) = bytes(file, base, findings)?;
    let found = match read_vtu(&bytes) {
        Ok(found) => found,
        Err(error) => {
            findings.elsewhere(file.span(), in_file(&path, "", error));
            return None;
        }
    };
    let mut wrong = |message: String, remedy: &str| {
        findings.elsewhere(file.span(), SceneError::of_file(path.display().to_string(), message, remedy));
    };
    let size = found.points.iter().flatten().fold(0.0, |size: f64, x| size.max(x.abs()));
    for (index, point) in found.points.iter().enumerate() {
        if !point.iter().all(|x| x.is_finite()) {
            wrong(format!("point {index} is not finite"), "repair the file");
            return None;
        }
        if point[D..].iter().any(|x| x.abs() > OFF_PLANE * size) {
            wrong(
                format!("point {index} at {point:?} is not in {D} dimensions"),
                "set `dimension` to that of the file",
            );
            return None;
        }
    }
    if let Some(index) = found.volumes.iter().flatten().position(|volume| !(volume.is_finite() && *volume > 0.0)) {
        wrong(format!("the volume of point {index} is not positive"), "volumes are positive");
        return None;
    }
    let positions: Vec<Vector<D>> = found.points.iter().map(|x| Vector::from_fn(|axis, _| x[axis])).collect();
    if let Some((one, other)) = repeated_points(&positions, spacing).first() {
        wrong(format!("points {other} and {one} are the same"), "remove one of the two");
        return None;
    }
    let kernel_volumes = vec![spacing.powi(D as i32); positions.len()];
    let volumes = found.volumes.unwrap_or_else(|| kernel_volumes.clone());
    Some(Particles { positions, volumes, kernel_volumes, ..Particles::default() })
}

/// Particles of a mesh.
pub(super) fn mesh<const D: usize>(text: &MeshText, base: &Path, findings: &mut Findings<'_>) -> Option<Filled<D>> {
    let scale = text.scale.as_ref().map_or(Some(findings.units.length()), |scale| findings.positive(scale, "scale"));
    let (path, bytes) = bytes(&text.file, base, findings)?;
    let mut mesh = match read_msh(&bytes) {
        Ok(mesh) => mesh,
        Err(error) => {
            findings.elsewhere(text.file.span(), in_file(&path, &String::from_utf8_lossy(&bytes), error));
            return None;
        }
    };
    let scale = scale?;
    mesh.nodes.iter_mut().for_each(|node| *node *= scale);
    let points = match text.particles {
        MeshPointsText::Cells => MeshPoints::Cells,
        MeshPointsText::Nodes => MeshPoints::Nodes,
    };
    let group = text.group.as_ref().map(|group| group.get_ref().trim().to_owned());
    match mesh_particles::<D>(&mesh, points, group.as_deref()) {
        Ok(meshed) => {
            let record = GeometryRecord {
                source: text.file.get_ref().clone(),
                has_faces: true,
                exact_volume: Some(meshed.particles.volumes.iter().sum()),
                volume_error: Some(0.0),
                ..GeometryRecord::default()
            };
            let (particles, spacing, groups) = (meshed.particles, meshed.spacing, meshed.groups);
            Some(Filled { particles, spacing, groups, record: Some(record) })
        }
        Err(error) => {
            let remedy = match &error {
                MeshedError::NoCells(_) => "mesh the whole body, and set `dimension` to that of its cells",
                MeshedError::NoGroup(..) => "choose one of the groups of its cells, or remove `group`",
                MeshedError::NoVolume(_) => "repair the mesh there",
                MeshedError::OffPlane(..) => "move the mesh into the plane z = 0, or use `dimension = 3`",
            };
            let place = text.group.as_ref().filter(|_| matches!(error, MeshedError::NoGroup(..))).unwrap_or(&text.file);
            findings.error(place.span(), error.to_string(), remedy);
            None
        }
    }
}

/// A file beside the scene.
pub(super) fn bytes(file: &Text, base: &Path, findings: &mut Findings<'_>) -> Option<(PathBuf, Vec<u8>)> {
    read_by(files::read, file, base, findings)
}

fn read_by(
    read: fn(&Path, u64) -> std::io::Result<Vec<u8>>,
    file: &Text,
    base: &Path,
    findings: &mut Findings<'_>,
) -> Option<(PathBuf, Vec<u8>)> {
    let path = base.join(file.get_ref());
    let mut wrong = |why: String| {
        let message = format!("{} cannot be read: {why}", path.display());
        findings.error(file.span(), message, "paths are sought from the folder of the scene file");
    };
    // What it holds takes a few times its size.
    let most = machine::available_memory().map_or(LARGEST, |memory| LARGEST.min(memory / 4));
    match read(&path, most) {
        Ok(bytes) => Some((path, bytes)),
        Err(why) => {
            wrong(why.to_string());
            None
        }
    }
}

/// Text of a file beside the scene.
fn content(file: &Text, base: &Path, findings: &mut Findings<'_>) -> Option<(PathBuf, String)> {
    let (path, bytes) = read_by(files::read_lines, file, base, findings)?;
    match String::from_utf8(bytes) {
        Ok(content) => Some((path, content)),
        Err(_) => {
            let message = format!("{} is not UTF-8 text", path.display());
            findings.error(file.span(), message, "give a file of numbers separated by commas");
            None
        }
    }
}

/// A mistake in a file; line 0 is none.
pub(super) fn in_file(path: &Path, content: &str, error: PointError) -> SceneError {
    let origin = path.display().to_string();
    if error.line == 0 {
        return SceneError::of_file(origin, error.message, error.remedy);
    }
    let line = content.lines().nth(error.line.saturating_sub(1));
    let shown = |line: &str| {
        line.chars().take(LONGEST_SHOWN).map(|letter| if letter.is_control() { ' ' } else { letter }).collect()
    };
    SceneError {
        origin,
        line: Some(error.line),
        column: Some(error.column),
        source_line: line.map(shown),
        length: error.length,
        message: error.message,
        remedy: error.remedy,
    }
}
