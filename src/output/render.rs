//! Pictures and animations from the frames of a run directory.

use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::animation::Animation;
use super::particles::{Extent, ParticlePlot};
use super::quantity::Quantity;
use super::stored_frame::StoredFrame;
use super::stored_run::{StoredRun, truncated};
use super::view::View;
use super::{ColourMap, OutputError, write_atomically};

/// Seconds of an animation of many frames, and the shortest and longest time of a frame in hundredths.
const SECONDS: f64 = 6.0;
const DELAYS: (f64, f64) = (4.0, 25.0);
/// How long the last frame stays, in hundredths of a second.
const LAST: u16 = 100;
/// Smallest and largest picture, in pixels to each side.
const SIDES: std::ops::RangeInclusive<usize> = 160..=8000;

/// Which frames are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrameChoice {
    /// The last one.
    Last,
    /// One, counted from 0.
    One(usize),
    /// All.
    All,
}

/// What is drawn, and how. The default is what suits the run.
#[derive(Debug, Clone, Default)]
pub struct Rendering {
    /// Field of the frames.
    pub field: Option<String>,
    /// Component of a vector or tensor.
    pub component: Option<String>,
    /// Which frames; without a choice all for an animation and the last for a picture.
    pub frames: Option<FrameChoice>,
    /// File to write: `.png`, `.svg` or `.gif`. Several pictures get the number of their frame before the extension.
    pub out: Option<PathBuf>,
    /// From where space is seen.
    pub view: Option<View>,
    /// Width of the picture in pixels.
    pub width: Option<usize>,
    /// Height of the picture in pixels.
    pub height: Option<usize>,
    /// Values at the ends of the colour bar.
    pub range: Option<(f64, f64)>,
    /// Whether the outline of the reference configuration is drawn below.
    pub reference: bool,
    /// Frames of an animation per second.
    pub rate: Option<f64>,
}

/// What is drawn of a frame.
struct Loaded {
    time: f64,
    positions: Vec<f64>,
    values: Vec<f64>,
    volumes: Vec<f64>,
    reference: Vec<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Format {
    Png,
    Svg,
    Gif,
}

impl Rendering {
    /// Draws frames of the run in `directory` and returns the files that were written, each of them whole.
    ///
    /// # Errors
    /// What [`StoredRun::open`], [`StoredRun::frame`] and [`Quantity::choose`] say; [`OutputError::Request`] for a
    /// size, format or view that is impossible; [`OutputError::File`] if the disk refuses.
    pub fn write(&self, directory: &Path) -> Result<Vec<PathBuf>, OutputError> {
        self.check()?;
        let run = StoredRun::open(directory)?;
        if self.view.is_some() && run.dim() < 3 {
            let what = format!("the run in {} has {} dimensions", directory.display(), run.dim());
            return Err(OutputError::request(what, "leave the view out: it is for three"));
        }
        let format = self.out.as_deref().map_or(Ok(self.usual_format()), format_of)?;
        let usual = if format == Format::Gif { FrameChoice::All } else { FrameChoice::Last };
        let chosen: Vec<usize> = match self.frames.unwrap_or(usual) {
            FrameChoice::Last => vec![run.frames() - 1],
            FrameChoice::One(index) => vec![index],
            FrameChoice::All => (0..run.frames()).collect(),
        };
        let first = run.frame(chosen[0])?;
        let quantity = Quantity::choose(&first, self.field.as_deref(), self.component.as_deref())?;
        let several = chosen.len() > 1;
        let out = match &self.out {
            Some(out) => out.clone(),
            None => directory.join(default_name(&quantity, format, (!several).then_some(chosen[0]))),
        };
        check_parent(&out)?;
        let source = Source { rendering: self, run: &run, quantity: &quantity, label: quantity.label(), format };
        let extent = if several { Some(source.extent(&chosen)?) } else { None };
        if format == Format::Gif {
            source.animation(&chosen, extent, &out)?;
            return Ok(vec![out]);
        }
        let file = |&index: &usize| {
            let path = if several { numbered(&out, index) } else { out.clone() };
            let loaded = source.load(index)?;
            let plot = source.plot(&loaded, extent);
            match format {
                Format::Svg => {
                    let document = plot.document(&path)?;
                    write_atomically(&path, |file| file.write_all(document.as_bytes()))?;
                }
                _ => plot.write_png(self.density(format), &path)?,
            }
            Ok(path)
        };
        chosen.par_iter().map(file).collect()
    }

    fn usual_format(&self) -> Format {
        if self.frames == Some(FrameChoice::All) { Format::Gif } else { Format::Png }
    }

    fn check(&self) -> Result<(), OutputError> {
        for (name, side) in [("width", self.width), ("height", self.height)] {
            if side.is_some_and(|side| !SIDES.contains(&side)) {
                let what = format!("a {name} of {} pixels is impossible", side.unwrap_or_default());
                return Err(OutputError::request(
                    what,
                    format!("choose one from {} to {}", SIDES.start(), SIDES.end()),
                ));
            }
        }
        if let Some((low, high)) = self.range.filter(|(low, high)| !(low < high && low.abs().max(high.abs()) <= 1e300))
        {
            let what = format!("the range from {low} to {high} is empty");
            return Err(OutputError::request(what, "give a smaller and a larger value"));
        }
        if let Some(rate) = self.rate.filter(|rate| !(0.1..=50.0).contains(rate)) {
            let what = format!("{rate} frames per second are impossible");
            return Err(OutputError::request(what, "choose 0.1 to 50"));
        }
        Ok(())
    }

    /// Pixels per point.
    fn density(&self, format: Format) -> f64 {
        let usual = if format == Format::Gif { 1.0 } else { super::canvas::DENSITY };
        self.width.map_or(usual, ParticlePlot::density)
    }
}

/// A run and what is to be drawn of it.
struct Source<'a> {
    rendering: &'a Rendering,
    run: &'a StoredRun,
    quantity: &'a Quantity,
    label: String,
    format: Format,
}

impl Source<'_> {
    fn load(&self, index: usize) -> Result<Loaded, OutputError> {
        let frame = self.run.frame(index)?;
        let positions = self.run.positions(&frame)?;
        let volumes = self.run.drawn_volumes(&frame)?;
        let reference = if self.rendering.reference { self.reference(&frame, &positions)? } else { Vec::new() };
        Ok(Loaded { time: frame.time(), values: self.quantity.values(&frame)?, positions, volumes, reference })
    }

    /// Positions less displacements; those of the first frame where displacements are not stored.
    fn reference(&self, frame: &StoredFrame, positions: &[f64]) -> Result<Vec<f64>, OutputError> {
        match frame.field("displacement")?.filter(|field| field.components == 3) {
            Some(field) => {
                let displacements = truncated(&field.values, self.run.dim());
                Ok(positions.iter().zip(displacements).map(|(x, u)| x - u).collect())
            }
            None => self.run.positions(&self.run.frame(0)?),
        }
    }

    fn plot<'a>(&'a self, loaded: &'a Loaded, frame: Option<Extent>) -> ParticlePlot<'a> {
        let rendering = self.rendering;
        let density = rendering.density(self.format);
        let points = |side: Option<usize>| side.map_or(0.0, |side| side as f64 / density);
        ParticlePlot {
            title: self.run.title(),
            time: loaded.time,
            dim: self.run.dim(),
            positions: &loaded.positions,
            values: &loaded.values,
            label: &self.label,
            volumes: &loaded.volumes,
            spacing: 0.0,
            colours: ColourMap::default(),
            range: rendering.range,
            reference: &loaded.reference,
            view: rendering.view.unwrap_or_default(),
            frame,
            page: (points(rendering.width), points(rendering.height)),
        }
    }

    /// What all these frames have in common. The bounds come first, because perspective depends on them.
    fn extent(&self, chosen: &[usize]) -> Result<Extent, OutputError> {
        let mut bounds = None;
        for &index in chosen {
            bounds = Some(self.plot(&self.load(index)?, None).bounds(bounds));
        }
        let bounds = bounds.unwrap_or_default();
        let mut extent = None;
        for &index in chosen {
            extent = Some(self.plot(&self.load(index)?, None).extent(extent, bounds));
        }
        Ok(extent.unwrap_or(Extent { bounds, seen: [(0.0, 1.0); 2], values: (0.0, 1.0), edge: 1.0 }))
    }

    fn animation(&self, chosen: &[usize], extent: Option<Extent>, out: &Path) -> Result<(), OutputError> {
        let density = self.rendering.density(Format::Gif);
        let draw = |&index: &usize| {
            let loaded = self.load(index)?;
            self.plot(&loaded, extent).pixels(density, out)
        };
        let first = draw(&chosen[0])?;
        let values = extent.map(|extent| extent.values).filter(|(low, high)| low <= high);
        let (low, high) = match self.rendering.range.or(values) {
            Some(range) => range,
            None => {
                let values = self.load(chosen[0])?.values;
                let finite = || values.iter().copied().filter(|value| value.is_finite());
                (finite().fold(0.0, f64::min), finite().fold(0.0, f64::max))
            }
        };
        let signed = ColourMap::default().is_signed(low, high);
        let usual = (100.0 * SECONDS / chosen.len() as f64).clamp(DELAYS.0, DELAYS.1);
        let delay = self.rendering.rate.map_or(usual, |rate| 100.0 / rate).round() as u16;
        // Drawn in parallel, a few at a time, and written in order. A frame that cannot be read ends it before the
        // file has its name.
        let mut failure = None;
        let written = write_atomically(out, |file| {
            let mut animation = Animation::new(file, first.size(), signed)?;
            for group in chosen.chunks(rayon::current_num_threads().max(1)) {
                let pictures: Result<Vec<_>, OutputError> = group.par_iter().map(draw).collect();
                let pictures = match pictures {
                    Ok(pictures) => pictures,
                    Err(error) => {
                        failure = Some(error);
                        return Err(std::io::Error::other("a frame cannot be drawn"));
                    }
                };
                for (index, picture) in group.iter().zip(&pictures) {
                    let last = Some(index) == chosen.last() && chosen.len() > 1;
                    animation.push(picture, if last { LAST.max(delay) } else { delay })?;
                }
            }
            Ok(())
        });
        failure.map_or(written, Err)
    }
}

fn format_of(path: &Path) -> Result<Format, OutputError> {
    match path.extension().and_then(|kind| kind.to_str()).map(str::to_lowercase).as_deref() {
        Some("png") => Ok(Format::Png),
        Some("svg") => Ok(Format::Svg),
        Some("gif") => Ok(Format::Gif),
        _ => {
            let what = format!("cannot tell the format of {}", path.display());
            Err(OutputError::request(what, "give a name that ends in .png, .svg or .gif"))
        }
    }
}

/// The directory of a file to be written must be there.
pub(super) fn check_parent(path: &Path) -> Result<(), OutputError> {
    let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if parent.is_dir() {
        return Ok(());
    }
    let what = format!("cannot write {}: there is no directory {}", path.display(), parent.display());
    Err(OutputError::request(what, "create it first or correct the path"))
}

fn default_name(quantity: &Quantity, format: Format, index: Option<usize>) -> String {
    let name: String =
        quantity.name().chars().map(|c| if c.is_alphanumeric() || "-_".contains(c) { c } else { '_' }).collect();
    match (format, index) {
        (Format::Gif, _) => format!("{name}.gif"),
        (_, Some(index)) => format!("{name}-{index:05}.png"),
        _ => format!("{name}.png"),
    }
}

/// `name-00012.png` for `name.png`.
fn numbered(path: &Path, index: usize) -> PathBuf {
    let mut name = path.file_stem().unwrap_or_default().to_os_string();
    name.push(format!("-{index:05}."));
    name.push(path.extension().unwrap_or_default());
    path.with_file_name(name)
}
