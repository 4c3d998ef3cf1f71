//! Scene files: TOML text to a validated [`Setup`] and typed settings.
//!
//! ```toml
//! title = "A column under its weight"
//! dimension = 2
//! gravity = [0.0, -9.81]
//!
//! [[body]]
//! name = "column"
//! spacing = 0.25
//! shape.box = { lower = [0.0, 0.0], upper = [2.5, 2.5] }
//! material.hyperelastic_volumetric = { density = 1000.0, gamma = 7.0, wave_speed = 10.0 }
//!
//! [[boundary]]
//! name = "base"
//! select.where = "Y < 1e-9"
//! fix = ["x", "y"]
//!
//! [time]
//! end = 1.0
//! step = 0.05
//! ```
//!
//! Reading goes in two steps. [`Scene::read`] and [`Scene::parse`] take the text and the overrides, and check
//! everything that can be checked without particles; [`Scene::setup`] makes the particles, applies selectors
//! and evaluates fields. If the first step finds a mistake it tries the second as well, so that *all* mistakes
//! are shown together, each with its place, the line and a remedy.
//!
//! Conventions: SI units, unless the scene says `units` or a number has a unit; constraints win over initial values; expressions are fields of the reference
//! position and time ([`crate::expression`]).
#![doc = include_str!("reference.md")]

mod build;
mod checks;
mod difference;
mod document;
mod errors;
mod files;
pub(crate) mod findings;
mod messages;
mod numerics;
mod overrides;
mod read;
pub mod schema;
pub mod settings;
pub(crate) mod sizes;
pub(crate) mod source;
mod times;
mod units;

use std::path::{Path, PathBuf};

pub use difference::differences;
pub use errors::{SceneError, SceneErrors};
pub use sizes::{BodySize, Refusal};

use crate::setup::Setup;
use document::Document;
use findings::Findings;
use settings::{CheckpointSettings, LinearSettings, NewtonSettings, OutputSettings, TimeSettings};
use sizes::{Accept, at_most, few};
use source::Source;

/// Most particles that [`Scene::setup`] makes.
pub const MOST_PARTICLES: usize = 200_000_000;

/// Largest scene file, bytes.
const LARGEST_FILE: u64 = 1 << 24;

/// A scene whose text is understood and whose settings are checked.
#[derive(Debug, Clone)]
pub struct Scene {
    /// Title; default: the name of the file without its ending.
    pub title: String,
    /// Table `[time]`.
    pub time: TimeSettings,
    /// Table `[newton]`.
    pub newton: NewtonSettings,
    /// Table `[linear]`.
    pub linear: LinearSettings,
    /// Table `[output]`.
    pub output: OutputSettings,
    /// Table `[checkpoint]`.
    pub checkpoint: CheckpointSettings,
    dimension: usize,
    document: Document,
    source: Source,
    effective: String,
    base: PathBuf,
    warnings: Vec<String>,
    memory: Option<u64>,
}

impl Scene {
    /// Reads a scene file and applies overrides `(key.path, value)`.
    ///
    /// # Errors
    /// All mistakes found, with their places.
    pub fn read(path: &Path, overrides: &[(String, String)]) -> Result<Self, SceneErrors> {
        let name = path.display().to_string();
        let bytes = crate::files::read(path, LARGEST_FILE).map_err(|error| {
            let remedy = "check the path and the permissions of the scene file";
            SceneErrors::new(vec![SceneError::of_file(&name, format!("the scene cannot be read: {error}"), remedy)])
        })?;
        let text = String::from_utf8(bytes).map_err(|error| SceneErrors::new(vec![not_text(&name, &error)]))?;
        Self::parse(&text, &name, path.parent().unwrap_or(Path::new("")), overrides)
    }

    /// Reads a scene from text. `name` stands in messages; files that the scene names are sought from `base`.
    ///
    /// # Errors
    /// All mistakes found, with their places.
    pub fn parse(text: &str, name: &str, base: &Path, overrides: &[(String, String)]) -> Result<Self, SceneErrors> {
        let source = Source::new(name, text, overrides);
        let mut findings = Findings::new(&source);
        let Some((document, effective)) = read::read(text, overrides, &mut findings) else {
            return Err(findings.finish().err().unwrap_or_default());
        };
        findings.units = document.units;
        let time = times::time(&document, &mut findings);
        let newton = numerics::newton(&document, &mut findings);
        let linear = numerics::linear(&document, &mut findings);
        let output = numerics::output(&document, &mut findings);
        let checkpoint = numerics::checkpoint(&document, &mut findings);
        let dimension = *document.dimension.get_ref();
        if !(1..=3).contains(&dimension) {
            let message = format!("`dimension` is {dimension}");
            findings.error(document.dimension.span(), message, "choose 1, 2 or 3");
        }
        if findings.count() > 0 {
            // Only for what else is wrong, if that costs little.
            match dimension {
                1 => drop(build::build::<1>(&document, base, &few, &mut findings)),
                2 => drop(build::build::<2>(&document, base, &few, &mut findings)),
                3 => drop(build::build::<3>(&document, base, &few, &mut findings)),
                _ => {}
            }
        }
        let warnings = findings.finish()?;
        let Some(time) = time else {
            // Unreachable: without time settings a mistake was noted.
            return Err(SceneErrors::default());
        };
        let stem = Path::new(name).file_stem().map(|stem| stem.to_string_lossy().into_owned());
        Ok(Self {
            title: document.title.clone().or(stem).unwrap_or_default(),
            time,
            newton,
            linear,
            output,
            checkpoint,
            dimension: dimension as usize,
            document,
            source,
            effective,
            base: base.to_owned(),
            warnings,
            memory: None,
        })
    }

    /// Lets a run that would need more memory than this, bytes, be refused before any is taken; `None` for no limit, as at
    /// first. See [`crate::machine::available_memory`].
    pub fn limit_memory(&mut self, limit: Option<u64>) {
        self.memory = limit;
    }

    /// Bytes of memory that a run may need.
    pub fn memory_limit(&self) -> Option<u64> {
        self.memory
    }

    /// Number of dimensions: 1, 2 or 3. The argument that [`Scene::setup`] wants.
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// The text of the scene with all overrides in it: reading it again gives the same scene.
    pub fn text(&self) -> &str {
        &self.effective
    }

    /// The file that the scene was read from, or what stands for it in messages.
    pub fn name(&self) -> &str {
        self.source.name()
    }

    /// Where the files that the scene names are sought from.
    pub fn base(&self) -> &Path {
        &self.base
    }

    /// The files that bodies are read from, as the scene names them, each once.
    pub fn files(&self) -> Vec<String> {
        files::files(&self.document)
    }

    /// Makes the particles, applies selectors, evaluates fields. Also gives warnings: what is possible but
    /// perhaps not meant.
    ///
    /// # Errors
    /// All mistakes found, with their places; also if `D` is not [`Scene::dimension`].
    pub fn setup<const D: usize>(&self) -> Result<(Setup<D>, Vec<String>), SceneErrors> {
        self.setup_within(MOST_PARTICLES)
    }

    /// [`Scene::setup`] with an own limit on the number of particles, which is checked before any are made.
    ///
    /// # Errors
    /// As for [`Scene::setup`].
    pub fn setup_within<const D: usize>(&self, most_particles: usize) -> Result<(Setup<D>, Vec<String>), SceneErrors> {
        self.build(&at_most(most_particles))
    }

    /// [`Scene::setup`] if it is accepted, which is asked before any particles are made.
    ///
    /// # Errors
    /// As for [`Scene::setup`], and the refusal.
    pub fn setup_if<const D: usize>(
        &self,
        accept: &dyn Fn(&[BodySize]) -> Result<(), Refusal>,
    ) -> Result<(Setup<D>, Vec<String>), SceneErrors> {
        let few_enough = at_most(MOST_PARTICLES);
        self.build(&|bodies| few_enough(bodies).and_then(|()| accept(bodies)))
    }

    fn build<const D: usize>(&self, accept: &Accept<'_>) -> Result<(Setup<D>, Vec<String>), SceneErrors> {
        let mut findings = Findings::new(&self.source);
        findings.units = self.document.units;
        let mut setup = None;
        if D == self.dimension {
            setup = build::build::<D>(&self.document, &self.base, accept, &mut findings);
        } else {
            let message = format!("the scene has {} dimension(s), the computation {D}", self.dimension);
            findings.error(self.document.dimension.span(), message, "set up the scene in its own dimension");
        }
        let mut warnings = self.warnings.clone();
        warnings.extend(findings.finish()?);
        let mut setup = setup.ok_or_else(SceneErrors::default)?;
        setup.title.clone_from(&self.title);
        Ok((setup, warnings))
    }
}

fn not_text(name: &str, error: &std::string::FromUtf8Error) -> SceneError {
    let start = error.utf8_error().valid_up_to();
    let (line, column, length, source_line) =
        source::place(&String::from_utf8_lossy(error.as_bytes()), start, start + 1);
    SceneError {
        origin: name.to_owned(),
        line: Some(line),
        column: Some(column),
        source_line: Some(source_line),
        length,
        message: "the file is not UTF-8 text".to_owned(),
        remedy: "save it with the encoding UTF-8".to_owned(),
    }
}
