//! A picture of a scene before it runs: particles, what holds or moves them, and the loads on them, as SVG and PNG.

use std::path::{Path, PathBuf};

use plotters::backend::DrawingBackend;
use plotters::style::RGBColor;

use super::OutputError;
use super::axis::round_step;
use super::canvas::{Align, BLACK, Canvas, Disc, Drawing, Drawn, Point, shortened, text_width, write_both};
use super::chart::{Area, TEXT, draw_title};
use super::splat::Look;
use super::text::readable;

/// Size of the drawing area, and of what is around it, in points.
const WIDTH: f64 = 720.0;
const HIGHEST: f64 = 560.0;
const LOWEST: f64 = 120.0;
const MARGIN: f64 = 24.0;
const TOP: f64 = 52.0;
const STRIP: f64 = 88.0;
/// Room around the particles, over the larger extent: for the arrows.
const ROOM: f64 = 0.12;
/// Longest arrow over the larger extent, and most arrows.
const ARROW: f64 = 0.1;
const MOST_ARROWS: usize = 150;
const RED: RGBColor = RGBColor(0xc8, 0x1e, 0x1e);

/// What a particle is bound to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Hold {
    /// Nothing.
    Free,
    /// Nothing, but it carries a load.
    Loaded,
    /// Its place in some directions.
    PartlyFixed,
    /// Its place.
    Fixed,
    /// A motion that the scene prescribes.
    Moving,
}

impl Hold {
    const ALL: [(Self, &'static str, RGBColor); 5] = [
        (Self::Free, "free", RGBColor(0xb4, 0xc0, 0xcc)),
        (Self::Loaded, "loaded", RGBColor(0xe8, 0x83, 0x6b)),
        (Self::PartlyFixed, "fixed in some directions", RGBColor(0x6f, 0xa3, 0xe0)),
        (Self::Fixed, "fixed", RGBColor(0x1c, 0x4a, 0x94)),
        (Self::Moving, "moved as prescribed", RGBColor(0x7a, 0x3f, 0x9e)),
    ];

    fn colour(self) -> RGBColor {
        Self::ALL.iter().find(|(hold, ..)| *hold == self).map_or(BLACK, |(.., colour)| *colour)
    }
}

/// A scene before it runs.
#[derive(Debug, Clone)]
pub struct Preview<'a> {
    /// Written above.
    pub title: &'a str,
    /// Number of space dimensions: 1, 2 or 3.
    pub dim: usize,
    /// Positions in m: `dim` components per particle.
    pub positions: &'a [f64],
    /// One per particle.
    pub holds: &'a [Hold],
    /// Particles with the loads on them, `dim` components each, in any one unit.
    pub loads: &'a [(usize, Vec<f64>)],
    /// Distance of neighbouring particles in m.
    pub spacing: f64,
    /// Written below, such as gravity.
    pub notes: &'a str,
}

struct Prepared<'a> {
    preview: &'a Preview<'a>,
    area: Area,
    discs: Vec<Disc>,
    arrows: Vec<(Point, Point)>,
    /// Points per m.
    scale: f64,
}

impl Preview<'_> {
    /// Writes `PATH.svg` and `PATH.png` as wholes and returns both paths.
    ///
    /// # Errors
    /// [`OutputError::Unsuitable`] for a dimension that is not 1, 2 or 3; [`OutputError::WrongLength`] if positions and
    /// holds do not fit; [`OutputError::File`] if the disk refuses.
    pub fn write(&self, path_without_extension: &Path) -> Result<[PathBuf; 2], OutputError> {
        const ACTION: &str = "draw the preview into";
        if !(1..=3).contains(&self.dim) {
            return Err(OutputError::Unsuitable {
                action: ACTION,
                path: path_without_extension.to_path_buf(),
                reason: format!("points have {} dimensions", self.dim),
                remedy: "use 1, 2 or 3",
            });
        }
        let expected = self.dim * self.holds.len();
        OutputError::check_length(ACTION, path_without_extension, "positions", expected, self.positions.len())?;
        write_both(&self.prepare(), path_without_extension)
    }

    fn prepare(&self) -> Prepared<'_> {
        let mut particles: Vec<([f64; 3], Hold)> = self
            .positions
            .chunks_exact(self.dim)
            .zip(self.holds)
            .filter(|(position, _)| position.iter().all(|x| x.abs() < 1e150))
            .map(|(position, hold)| (self.project(position), *hold))
            .collect();
        particles.sort_by(|(a, _), (b, _)| a[2].total_cmp(&b[2]));
        let extent = |axis: usize| {
            let values = particles.iter().map(|(place, _)| place[axis]);
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
        };
        let (x, y) = if particles.is_empty() { ((0.0, 1.0), (0.0, 1.0)) } else { (extent(0), extent(1)) };
        let longest = (x.1 - x.0).max(y.1 - y.0).max(self.spacing).max(f64::MIN_POSITIVE);
        let room = ROOM * longest + self.spacing;
        let (width, height) = (x.1 - x.0 + 2.0 * room, y.1 - y.0 + 2.0 * room);
        let scale = (WIDTH / width).min(HIGHEST / height);
        let tall = (scale * height).clamp(LOWEST, HIGHEST);
        let area = Area { left: MARGIN, top: TOP, right: MARGIN + WIDTH, bottom: TOP + tall };
        let middle = ((x.0 + x.1) / 2.0, (y.0 + y.1) / 2.0);
        let on_page = |place: &[f64]| {
            let centre = (0.5 * (area.left + area.right), 0.5 * (area.top + area.bottom));
            (centre.0 + scale * (place[0] - middle.0), centre.1 - scale * (place[1] - middle.1))
        };
        let radius = (0.5 * scale * self.spacing).max(0.6);
        let mut discs = Vec::with_capacity(particles.len());
        for (place, hold) in &particles {
            let (centre, colour) = (on_page(place), hold.colour());
            // Balls touch; discs leave a little white between them.
            let radius = if self.dim == 3 { radius } else { 0.92 * radius };
            discs.push(Disc { centre, radius, depth: scale * place[2], colour });
        }
        let size = |load: &[f64]| load.iter().map(|x| x * x).sum::<f64>().sqrt();
        let largest = self.loads.iter().map(|(_, load)| size(load)).filter(|size| size.is_finite()).fold(0.0, f64::max);
        let every = self.loads.len().div_ceil(MOST_ARROWS).max(1);
        let arrows = self.loads.iter().step_by(every).filter_map(|(particle, load)| {
            let position = self.positions.get(particle * self.dim..(particle + 1) * self.dim)?;
            let length = ARROW * longest / largest;
            let tip: Vec<f64> = position.iter().zip(load).map(|(x, load)| x + load * length).collect();
            let is_drawn = largest > 0.0 && tip.len() == self.dim && tip.iter().all(|x| x.abs() < 1e150);
            is_drawn.then(|| (on_page(&self.project(position)), on_page(&self.project(&tip))))
        });
        Prepared { preview: self, area, discs, arrows: arrows.collect(), scale }
    }

    /// Right, up and towards the viewer: in space from 60° beside −x and 30° above, z upwards.
    fn project(&self, position: &[f64]) -> [f64; 3] {
        match *position {
            [x] => [x, 0.0, 0.0],
            [x, y] => [x, y, 0.0],
            [x, y, z, ..] => directions().map(|axis| axis[0] * x + axis[1] * y + axis[2] * z),
            [] => [0.0; 3],
        }
    }
}

fn directions() -> [[f64; 3]; 3] {
    let ((sa, ca), (se, ce)) = ((-60.0_f64).to_radians().sin_cos(), 30.0_f64.to_radians().sin_cos());
    [[-sa, ca, 0.0], [-se * ca, -se * sa, ce], [ce * ca, ce * sa, se]]
}

impl Drawing for Prepared<'_> {
    fn size(&self) -> (f64, f64) {
        (self.area.right + MARGIN, self.area.bottom + STRIP)
    }

    fn draw<B: DrawingBackend>(&self, canvas: &mut Canvas<'_, B>) -> Drawn {
        let Self { preview, area, .. } = self;
        let look = if preview.dim == 3 { Look::Balls } else { Look::Flat { outline: 0.0 } };
        canvas.cloud(*area, &[], &self.discs, look)?;
        for (from, to) in &self.arrows {
            arrow(canvas, *from, *to)?;
        }
        let (width, _) = self.size();
        draw_title(canvas, preview.title, width)?;
        let count = format!("{} particles", preview.holds.len());
        let loads = if preview.loads.is_empty() { "" } else { ", tractions in red" };
        let notes = if preview.notes.is_empty() { String::new() } else { format!(", {}", preview.notes) };
        let caption = shortened(&format!("{count}{loads}{notes}"), 0.9 * TEXT, width - 20.0);
        canvas.text((0.5 * width, 42.0), &caption, 0.9 * TEXT, Align::Centre)?;
        let mut left = area.left;
        let row = area.bottom + 22.0;
        for (hold, name, colour) in Hold::ALL {
            let count = preview.holds.iter().filter(|found| **found == hold).count();
            if count > 0 {
                let label = format!("{name}: {count}");
                canvas.disc((left + 6.0, row - 4.5), 5.5, colour)?;
                canvas.text((left + 16.0, row), &label, TEXT, Align::Left)?;
                left += 30.0 + text_width(&label, TEXT);
            }
        }
        self.directions(canvas)
    }
}

impl Prepared<'_> {
    /// The directions of the axes, and a bar of known length.
    fn directions<B: DrawingBackend>(&self, canvas: &mut Canvas<'_, B>) -> Drawn {
        let y = self.area.bottom + STRIP - 12.0;
        let origin = (self.area.left + 12.0, y);
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate().take(self.preview.dim) {
            let mut unit = [0.0; 3];
            unit[axis] = 1.0;
            let [right, up, _] = self.preview.project(&unit[..self.preview.dim]);
            let arm = |length: f64| (origin.0 + length * right, origin.1 - length * up);
            canvas.line(&[origin, arm(22.0)], 1.4, BLACK)?;
            let (x, y) = arm(30.0);
            canvas.text((x, y + 0.3 * TEXT), name, TEXT, Align::Centre)?;
        }
        let length = round_step(0.15 * WIDTH / self.scale);
        let (left, right) = (self.area.left + 110.0, self.area.left + 110.0 + length * self.scale);
        canvas.line(&[(left, y), (right, y)], 2.0, BLACK)?;
        canvas.text((right + 8.0, y + 0.35 * TEXT), &format!("{} m", readable(length, 3)), TEXT, Align::Left)
    }
}

/// An arrow in red.
fn arrow<B: DrawingBackend>(canvas: &mut Canvas<'_, B>, from: Point, to: Point) -> Drawn {
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let length = dx.hypot(dy);
    if length < 1.0 {
        return Ok(());
    }
    canvas.line(&[from, to], 1.2, RED)?;
    let head = (0.35 * length).min(6.0) / length;
    for side in [-0.45, 0.45] {
        let wing = (to.0 - head * (dx - side * dy), to.1 - head * (dy + side * dx));
        canvas.line(&[wing, to], 1.2, RED)?;
    }
    Ok(())
}
