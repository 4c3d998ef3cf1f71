//! Field output: VTU frames in time, and the final picture.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use crate::model::Model;
use crate::output::{Frame, OutOfPlane, OutputError, ParticlePlot, Precision, Series, Tensor, write_atomically};
use crate::scene::settings::OutputField;
use crate::tensor::{Tensor as SmallTensor, von_mises};

/// Names of frames: prefix, number, suffix.
const PREFIX: &str = "fields-";
const SUFFIX: &str = ".vtu";

/// The index of the frames.
const INDEX: &str = "fields.pvd";

/// Removes the frames of a directory whose names are to go.
fn remove_frames(directory: &Path, goes: impl Fn(&str) -> bool) {
    for entry in std::fs::read_dir(directory).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        if is_frame(&name) && goes(&name) {
            // What cannot be removed will be overwritten, or is outside the index.
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

/// Whether a file name is that of a frame.
fn is_frame(name: &str) -> bool {
    let number = name.strip_prefix(PREFIX).and_then(|rest| rest.strip_suffix(SUFFIX));
    number.is_some_and(|number| number.len() >= 5 && number.bytes().all(|byte| byte.is_ascii_digit()))
}

/// Writes frames into a directory, with `fields.pvd` as their index.
pub struct Frames {
    directory: PathBuf,
    fields: Vec<OutputField>,
    provenance: String,
    series: Series,
}

impl Frames {
    /// Frames of the chosen fields; `provenance` is stored in every file. Frames that an earlier run left
    /// in the directory are removed: beside a shorter index they would pass for results of this run.
    pub fn new(directory: &Path, fields: &[OutputField], provenance: String) -> Self {
        remove_frames(directory, |_| true);
        Self {
            directory: directory.to_path_buf(),
            fields: fields.to_vec(),
            provenance,
            series: Series::new(&directory.join(INDEX)),
        }
    }

    /// Goes on after the first `count` frames that a run has left in `source`, whose index is opened here; see
    /// [`begin`](Self::begin).
    ///
    /// # Errors
    /// If there are not so many.
    pub fn reopen(
        source: &Path,
        fields: &[OutputField],
        provenance: String,
        count: usize,
    ) -> Result<Self, OutputError> {
        let series = Series::reopen(&source.join(INDEX), count)?;
        for file in series.files() {
            let path = source.join(file);
            std::fs::metadata(&path).map_err(OutputError::unreadable("the frame", &path))?;
        }
        Ok(Self { directory: source.to_path_buf(), fields: fields.to_vec(), provenance, series })
    }

    /// Makes `directory` hold these frames and no others: copies them if they are elsewhere, and removes those that came
    /// after.
    ///
    /// # Errors
    /// If the disk refuses.
    pub fn begin(&mut self, directory: &Path, same: bool) -> Result<(), OutputError> {
        if !same {
            for file in self.series.files() {
                let (from, to) = (self.directory.join(file), directory.join(file));
                let bytes = std::fs::read(&from).map_err(OutputError::unreadable("the frame", &from))?;
                write_atomically(&to, |file| file.write_all(&bytes))?;
            }
            self.directory = directory.to_path_buf();
            self.series = self.series.clone().moved_to(&directory.join(INDEX));
        }
        self.series.write()?;
        let known: Vec<String> = self.series.files().map(str::to_owned).collect();
        remove_frames(directory, |name| !known.iter().any(|file| file == name));
        Ok(())
    }

    /// Number of frames so far.
    pub fn count(&self) -> usize {
        self.series.frames()
    }

    /// Writes one frame.
    ///
    /// # Errors
    /// If the disk refuses.
    pub fn write<const D: usize>(&mut self, model: &Model<D>, time: f64, state: &[f64]) -> Result<(), OutputError> {
        let positions = current_positions(model, state);
        let pressures = model.pressures(state);
        let gradients: Vec<f64> = if self.fields.contains(&OutputField::DeformationGradient) {
            (0..model.particles())
                .flat_map(|a| {
                    let f = SmallTensor::<D>::identity() + model.gradient().of(a, model.displacements(state));
                    // Row by row, as viewers read tensors.
                    (0..D * D).map(move |k| f[(k / D, k % D)]).collect::<Vec<_>>()
                })
                .collect()
        } else {
            Vec::new()
        };
        let solids = model.has_solids();
        let stresses = [OutputField::Stress, OutputField::VonMises];
        let wanted = solids && self.fields.iter().any(|field| stresses.contains(field));
        let cauchy = if wanted { model.cauchy_stresses(state) } else { Vec::new() };
        // Symmetric: rows are columns.
        let stresses: Vec<f64> = cauchy.iter().flat_map(|stress| stress.iter().copied()).collect();
        let von_mises: Vec<f64> = cauchy.iter().map(von_mises).collect();
        let mut frame = Frame {
            time,
            dim: D,
            positions: &positions,
            scalars: Vec::new(),
            vectors: Vec::new(),
            tensors: Vec::new(),
            provenance: &self.provenance,
        };
        for field in &self.fields {
            match field {
                OutputField::Pressure => frame.scalars.push(("pressure", Cow::Borrowed(&pressures[..]))),
                OutputField::Jacobian => frame.scalars.push(("jacobian", model.volume_ratios(state))),
                OutputField::Volume => frame.scalars.push((
                    "volume",
                    Cow::Owned(current(&model.setup().particles.volumes, &model.volume_ratios(state))),
                )),
                OutputField::Velocity => frame.vectors.push(("velocity", Cow::Borrowed(model.velocities_of(state)))),
                OutputField::Displacement => {
                    frame.vectors.push(("displacement", Cow::Borrowed(model.displacements(state))));
                }
                OutputField::DeformationGradient => frame.tensors.push(Tensor {
                    name: "deformation_gradient",
                    values: Cow::Borrowed(&gradients[..]),
                    out_of_plane: OutOfPlane::Identity,
                }),
                OutputField::Stress if solids => frame.tensors.push(Tensor {
                    name: "stress",
                    values: Cow::Borrowed(&stresses[..]),
                    out_of_plane: OutOfPlane::Given,
                }),
                OutputField::VonMises if solids => frame.scalars.push(("von_mises", Cow::Borrowed(&von_mises[..]))),
                OutputField::Stress | OutputField::VonMises => {}
            }
        }
        let name = format!("{PREFIX}{:05}{SUFFIX}", self.series.frames());
        let path = self.directory.join(&name);
        frame.write(&path, Precision::Double)?;
        self.series.append(time, &path)
    }
}

/// Draws the particles coloured by pressure, or by von Mises stress where there are solids.
///
/// # Errors
/// If the disk refuses.
pub fn draw_particles<const D: usize>(
    model: &Model<D>,
    time: f64,
    state: &[f64],
    path_without_extension: &Path,
) -> Result<[PathBuf; 2], OutputError> {
    let positions = current_positions(model, state);
    // Of particles on a boundary with the part beyond it: they are as large as the others.
    let volumes = current(&model.setup().particles.kernel_volumes, &model.volume_ratios(state));
    let (values, label) = if model.has_solids() {
        (model.cauchy_stresses(state).iter().map(von_mises).collect(), "von Mises stress [Pa]")
    } else {
        (model.pressures(state), "pressure [Pa]")
    };
    ParticlePlot {
        title: &model.setup().title,
        time,
        dim: D,
        positions: &positions,
        values: &values,
        label,
        volumes: &volumes,
        ..ParticlePlot::default()
    }
    .write(path_without_extension)
}

fn current_positions<const D: usize>(model: &Model<D>, state: &[f64]) -> Vec<f64> {
    (0..model.particles()).flat_map(|a| model.position(state, a).iter().copied().collect::<Vec<_>>()).collect()
}

/// V J, m^D.
fn current(volumes: &[f64], ratios: &[f64]) -> Vec<f64> {
    volumes.iter().zip(ratios).map(|(volume, ratio)| volume * ratio).collect()
}
