//! The interactive view of the particles: their frames as 32-bit numbers in base64, and the script that draws them.

use serde_json::json;

use super::super::OutputError;
use super::super::canvas::DENSITY;
use super::super::colour::{ColourMap, samples};
use super::super::particle_sizes::Sizes;
use super::super::particles::ParticlePlot;
use super::super::picture::base64;
use super::super::quantity::Quantity;
use super::super::stored_frame::StoredFrame;
use super::super::stored_run::StoredRun;
use super::super::view::{NO_BOUNDS, has_place, widened};
use super::text::{self, embedded, escaped};

/// Fields to choose from, at most.
const MOST_FIELDS: usize = 6;
/// Frames that are kept by leaving out particles.
const FEW_FRAMES: usize = 16;
/// Frames beyond which nobody sees a difference.
const MOST_FRAMES: usize = 400;
/// Bytes of base64 per 32-bit number.
const BYTES: f64 = 16.0 / 3.0;
/// Colours of a map.
const COLOURS: usize = 33;

/// Which frames and particles are kept.
#[derive(Debug, PartialEq)]
struct Thinning {
    frames: Vec<usize>,
    /// Every how manieth particle.
    stride: usize,
}

impl Thinning {
    /// As many of `frames` frames of `particles` particles with `numbers` numbers each as fit into `bytes`.
    fn new(frames: usize, particles: usize, numbers: usize, bytes: usize) -> Self {
        let room = bytes as f64 / BYTES / (numbers * particles.max(1)) as f64;
        let few = frames.min(FEW_FRAMES);
        let stride = if room >= few as f64 { 1 } else { (few as f64 / room.max(1e-9)).ceil() as usize };
        let fitting = if stride > 1 { few } else { frames.min(room as usize).min(MOST_FRAMES) };
        let count = fitting.max(1);
        let at = |index: usize| if count == 1 { frames - 1 } else { index * (frames - 1) / (count - 1) };
        Self { frames: (0..count).map(at).collect(), stride }
    }
}

/// The section with the view, in at most about `bytes` bytes.
pub(super) fn section(run: &StoredRun, bytes: usize, script: &str) -> Result<String, OutputError> {
    let dim = run.dim();
    let last = run.frame(run.frames() - 1)?;
    let still = still_picture(run, &last)?;
    let fields = quantities(&last)?;
    let first = run.frame(0)?;
    let count = first.points();
    let numbers = dim + fields.len();
    // The picture for browsers without WebGL, and sizes of the particles.
    let other = still.len() + (count as f64 * BYTES) as usize + 10_000;
    let thinning = Thinning::new(run.frames(), count, numbers, bytes.saturating_sub(other));
    let keep = |values: &[f64], components: usize| -> Vec<f64> {
        values.chunks_exact(components).step_by(thinning.stride).flatten().copied().collect()
    };

    let positions = run.positions(&first)?;
    let volumes = run.drawn_volumes(&first)?;
    let sizes = Sizes::new(dim, &volumes, 0.0, &positions);
    let larger = (thinning.stride as f64).powf(1.0 / dim as f64);
    let edges: Vec<f64> = (0..count).step_by(thinning.stride).map(|at| larger * sizes.of(at)).collect();
    let same = edges.iter().all(|&edge| (edge - edges[0]).abs() < 1e-6 * edges[0]);

    let bounds = widened(NO_BOUNDS, &positions, dim);
    let centre: Vec<f64> =
        bounds[..dim].iter().map(|(low, high)| if low <= high { 0.5 * (low + high) } else { 0.0 }).collect();
    let (mut reached, mut ranges) = (NO_BOUNDS, vec![(f64::INFINITY, f64::NEG_INFINITY); fields.len()]);
    let (mut times, mut frames) = (Vec::new(), Vec::new());
    for &index in &thinning.frames {
        let frame = run.frame(index)?;
        if frame.points() != count {
            return Err(OutputError::Malformed {
                path: frame.path().to_path_buf(),
                reason: format!("it has {} particles, the first frame {count}", frame.points()),
            });
        }
        let positions = keep(&run.positions(&frame)?, dim);
        // 32 bits tell small motions apart only near zero.
        let relative: Vec<f64> =
            positions.chunks_exact(dim).flat_map(|at| at.iter().zip(&centre).map(|(x, c)| x - c)).collect();
        reached = widened(reached, &relative, dim);
        let mut packed = packed_bytes(&relative);
        for (quantity, range) in fields.iter().zip(&mut ranges) {
            let values = keep(&quantity.values(&frame)?, 1);
            let finite = values.iter().filter(|value| has_place(&[**value]));
            *range = finite.fold(*range, |(low, high), &value| (low.min(value), high.max(value)));
            packed.extend(packed_bytes(&values));
        }
        times.push(frame.time());
        frames.push(base64(&packed));
    }
    let described = fields.iter().zip(&ranges).map(|(quantity, &(low, high))| {
        let (low, high) = if low <= high { (low, high) } else { (0.0, 1.0) };
        let map = ColourMap::default();
        let (low, high, signed) = (map.ends((low, high)).0, map.ends((low, high)).1, map.is_signed(low, high));
        json!({ "label": quantity.label(), "low": low, "high": high, "signed": signed })
    });
    let map = |signed: bool| samples(signed, COLOURS).map(|colour| [colour.0, colour.1, colour.2]).collect::<Vec<_>>();
    let data = json!({
        "dim": dim,
        "count": edges.len(),
        "times": times,
        "fields": described.collect::<Vec<_>>(),
        "bounds": reached[..dim].iter().map(|&(low, high)| if low <= high { [low, high] } else { [0.0, 1.0] }).collect::<Vec<_>>(),
        "edge": sizes.typical * larger,
        "edges": if same { String::new() } else { base64(&packed_bytes(&edges)) },
        "maps": [map(false), map(true)],
        "frames": frames,
    });
    let mut notes = String::new();
    if thinning.frames.len() < run.frames() {
        notes += &format!("{} of {} frames", thinning.frames.len(), run.frames());
    }
    if thinning.stride > 1 {
        let and = if notes.is_empty() { "" } else { " and " };
        notes += &format!("{and}{} of {count} particles, drawn larger,", edges.len());
    }
    if !notes.is_empty() {
        notes = format!(
            "<p class=\"note\">To keep this file small it holds {} only; `nicolson render` draws all.</p>\n",
            notes.trim_end_matches(',')
        );
    }
    let view = include_str!("viewer.html").replace("PICTURE", &still).replace("TITLE", &escaped(run.title()));
    let content = format!(
        "{notes}{view}<script type=\"application/json\" id=\"particles\">{}</script>\n<script>\n{script}</script>\n",
        embedded(&data)
    );
    Ok(text::section("Particles", &content))
}

/// What can be chosen: the fields of a frame, the usual one first.
fn quantities(frame: &StoredFrame) -> Result<Vec<Quantity>, OutputError> {
    let mut chosen = vec![Quantity::choose(frame, None, None)?];
    for (name, components) in frame.fields().filter(|(name, _)| *name != "volume") {
        let plain = components < 9 || (name == "stress" && frame.fields().all(|(name, _)| name != "von_mises"));
        let quantity = Quantity::choose(frame, Some(name), None)?;
        if plain && !chosen.contains(&quantity) && chosen.len() < MOST_FIELDS {
            chosen.push(quantity);
        }
    }
    Ok(chosen)
}

/// The frame as `render` draws it, for browsers that cannot do better and for paper.
fn still_picture(run: &StoredRun, frame: &StoredFrame) -> Result<String, OutputError> {
    let quantity = Quantity::choose(frame, None, None)?;
    let (values, label) = (quantity.values(frame)?, quantity.label());
    let volumes = run.drawn_volumes(frame)?;
    let picture = ParticlePlot {
        title: run.title(),
        time: frame.time(),
        dim: run.dim(),
        positions: &run.positions(frame)?,
        values: &values,
        label: &label,
        volumes: &volumes,
        ..ParticlePlot::default()
    }
    .pixels(DENSITY, frame.path())?;
    let mut file = Vec::new();
    picture.encode(&mut file).map_err(OutputError::file("draw", frame.path()))?;
    Ok(base64(&file))
}

/// Little-endian 32-bit numbers.
fn packed_bytes(values: &[f64]) -> Vec<u8> {
    values.iter().flat_map(|&value| (value as f32).to_le_bytes()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_go_before_particles_and_the_ends_stay() {
        let all = Thinning::new(5, 100, 4, 1_000_000);
        assert_eq!(all, Thinning { frames: vec![0, 1, 2, 3, 4], stride: 1 });
        // Room for 20 frames of 100.
        let some = Thinning::new(100, 1000, 4, (20.0 * 4000.0 * BYTES) as usize + 1);
        assert_eq!((some.frames.len(), some.frames[0], some.frames[19], some.stride), (20, 0, 99, 1));
        // Room for 4 of 1000 frames: 16, of every fourth particle.
        let few = Thinning::new(1000, 1000, 4, (4.0 * 4000.0 * BYTES) as usize + 1);
        assert_eq!((few.frames.len(), few.frames[15], few.stride), (16, 999, 4));
        assert_eq!(Thinning::new(1, 10_000_000, 8, 0).frames, [0]);
    }
}
