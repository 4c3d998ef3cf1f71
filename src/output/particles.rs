//! A still picture of particles coloured by a scalar, as SVG and PNG.
//!
//! In the plane with equal axes; in space by a parallel projection, the nearer over the farther; on the
//! line as the value over the position. Meant for reports and for a first look without a viewer.

use std::path::{Path, PathBuf};

use plotters::backend::DrawingBackend;

use super::axis::{Axis, round_step};
use super::canvas::{Align, BLACK, Canvas, Disc, Drawing, Drawn, Point, shortened, write_both};
use super::chart::{Area, Chart, TEXT, draw_title};
use super::colour::{ColourMap, NOT_FINITE, colour, darker};
use super::colour_bar::ColourBar;
use super::text::readable;
use super::{LinePlot, LineSeries, OutputError, Style};

/// Width of the page in points.
const WIDTH: f64 = 760.0;
/// Highest and lowest plotting area, and the narrowest.
const HEIGHTS: (f64, f64) = (560.0, 150.0);
const NARROWEST: f64 = 240.0;
/// Height of the line below the title.
const CAPTION: f64 = 18.0;
/// Height of the strip with the directions and the scale of a picture of space.
const STRIP: f64 = 74.0;
/// Radius of a disc over the spacing. In the plane large discs touch; small ones cover the plane, or the
/// white between them would wash out the colours.
const RADIUS_OF_LARGE: f64 = 0.5;
const RADIUS_OF_SMALL: f64 = 0.7;
/// Spacing in points from which discs are large.
const LARGE_FROM: f64 = 8.0;
const RADIUS_IN_SPACE: f64 = 0.55;
/// Widest rim in points.
const RIM: f64 = 1.0;
/// Discs of at least this radius in points get a dark rim, so that overlapping ones can be told apart.
const RIM_FROM: f64 = 1.2;
/// Most particles on a line that get a marker each.
const MOST_MARKERS: usize = 150;

/// A picture of particles.
#[derive(Debug, Clone)]
pub struct ParticlePlot<'a> {
    /// Written above, followed by the time; may be empty.
    pub title: &'a str,
    /// Time in s.
    pub time: f64,
    /// Number of space dimensions: 1, 2 or 3.
    pub dim: usize,
    /// Positions in m: `dim` components per particle. Particles without a finite position are left out.
    pub positions: &'a [f64],
    /// One value per particle. Values that are not finite are shown in magenta.
    pub values: &'a [f64],
    /// What the values are, with their unit (`"von Mises stress [Pa]"`).
    pub label: &'a str,
    /// Distance between neighbouring particles in m: the diameter of the discs.
    pub spacing: f64,
    /// How values become colours.
    pub colours: ColourMap,
}

/// A particle on the page of a plane or projected picture.
struct Projected {
    /// Right and up, in m.
    place: Point,
    /// Towards the viewer, in m.
    depth: f64,
    value: f64,
}

/// Everything that is needed to draw, worked out once for both files.
struct Prepared<'a> {
    title: String,
    caption: String,
    chart: Chart<'a>,
    space: bool,
    bar: ColourBar<'a>,
    discs: Vec<Disc>,
    /// Points on the page per m.
    scale: f64,
    size: (f64, f64),
}

impl ParticlePlot<'_> {
    /// Writes `PATH.svg` and `PATH.png` as wholes and returns both paths. The same data give the same bytes.
    ///
    /// # Errors
    /// [`OutputError::Unsuitable`] for a dimension that is not 1, 2 or 3; [`OutputError::WrongLength`] if
    /// positions and values do not fit; [`OutputError::File`] if the disk refuses.
    pub fn write(&self, path_without_extension: &Path) -> Result<[PathBuf; 2], OutputError> {
        const ACTION: &str = "draw the particles into";
        if !(1..=3).contains(&self.dim) {
            return Err(OutputError::Unsuitable {
                action: ACTION,
                path: path_without_extension.to_path_buf(),
                reason: format!("points have {} dimensions", self.dim),
                remedy: "use 1, 2 or 3",
            });
        }
        let expected = self.dim * self.values.len();
        OutputError::check_length(ACTION, path_without_extension, "positions", expected, self.positions.len())?;
        if self.dim == 1 {
            return self.over_position().write(path_without_extension);
        }
        write_both(&self.prepare(), path_without_extension)
    }

    fn stamped_title(&self) -> String {
        let stamp = format!("t = {} s", readable(self.time, 4));
        if self.title.is_empty() { stamp } else { format!("{}, {stamp}", self.title) }
    }

    /// The picture on the line: the value over the position.
    fn over_position(&self) -> LinePlot {
        let mut points: Vec<_> = self.positions.iter().copied().zip(self.values.iter().copied()).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        let style = if points.len() <= MOST_MARKERS { Style::SolidWithPoints } else { Style::Solid };
        LinePlot {
            title: self.stamped_title(),
            x_label: "x [m]".to_owned(),
            y_label: self.label.to_owned(),
            series: vec![LineSeries { name: String::new(), points, style }],
            ..LinePlot::default()
        }
    }

    fn prepare(&self) -> Prepared<'_> {
        let space = self.dim == 3;
        let mut particles: Vec<Projected> = (self.positions.chunks_exact(self.dim).zip(self.values))
            .filter(|(position, _)| position.iter().all(|component| component.abs() < 1e150))
            .map(|(position, &value)| project(position, value))
            .collect();
        // Stable, so that the picture does not depend on the sorting of equals.
        particles.sort_by(|a, b| a.depth.total_cmp(&b.depth));

        let bar = ColourBar::new(self.label, particles.iter().map(|particle| particle.value), self.colours);
        let (horizontal, vertical) = (extent(&particles, |place| place.0), extent(&particles, |place| place.1));
        let spacing = self.usable_spacing(horizontal, vertical, particles.len());
        let grown = |(low, high): (f64, f64), margin: f64| (low - margin, high + margin);
        let margin = 0.7 * spacing + 0.03 * (horizontal.1 - horizontal.0).max(vertical.1 - vertical.0);
        let (horizontal, vertical) = (grown(horizontal, margin), grown(vertical, margin));

        // The y axis decides how much room there is, and the room decides the range of the y axis; the
        // labels hardly depend on the range, so once is enough.
        let draft = Axis::between(vertical.0, vertical.1, 6.0);
        let left = if space { 24.0 } else { Chart::room_left(&draft) };
        let room = (WIDTH - left - bar.room(), HEIGHTS.0);
        let scale = (room.0 / (horizontal.1 - horizontal.0)).min(room.1 / (vertical.1 - vertical.0));
        let width = (scale * (horizontal.1 - horizontal.0)).clamp(NARROWEST, room.0);
        let height = (scale * (vertical.1 - vertical.0)).clamp(HEIGHTS.1, room.1);
        let widened = |(low, high): (f64, f64), length: f64| {
            let middle = 0.5 * (low + high);
            (middle - 0.5 * length / scale, middle + 0.5 * length / scale)
        };
        let (horizontal, vertical) = (widened(horizontal, width), widened(vertical, height));
        let x = Axis::between(horizontal.0, horizontal.1, width / 75.0);
        let y = Axis::between(vertical.0, vertical.1, height / 40.0);
        let title = self.stamped_title();
        let top = Chart::room_above(&title, &y).max(bar.room_above()) + CAPTION;
        let area = Area { left, top, right: left + width, bottom: top + height };
        let below = if space { STRIP } else { Chart::room_below() };
        // Titles come from `title` and `caption` below, which may be wider than the plotting area.
        let chart = Chart { title: "", x_label: "x [m]", y_label: "y [m]", x, y, area };

        let radius = match scale * spacing {
            apart if space => RADIUS_IN_SPACE * apart,
            apart if apart < LARGE_FROM => RADIUS_OF_SMALL * apart,
            apart => RADIUS_OF_LARGE * apart,
        };
        let discs = discs(&chart, &bar, &particles, radius, space);
        let caption = bar.caption(particles.len(), self.values.len() - particles.len());
        let size = (area.right + bar.room(), area.bottom + below);
        Prepared { title, caption, chart, space, bar, discs, scale, size }
    }

    /// The spacing given, or a guess from the area per particle if it is of no use.
    fn usable_spacing(&self, horizontal: (f64, f64), vertical: (f64, f64), count: usize) -> f64 {
        if self.spacing > 0.0 && self.spacing < 1e150 {
            return self.spacing;
        }
        let (width, height) = (horizontal.1 - horizontal.0, vertical.1 - vertical.0);
        let guess = (width.max(0.01 * height) * height.max(0.01 * width) / count.max(1) as f64).sqrt();
        if guess > 0.0 { guess } else { 1.0 }
    }
}

/// Right, up and towards the viewer. Space is seen from 60° beside −x and 30° above, z upwards.
fn project(position: &[f64], value: f64) -> Projected {
    let &[x, y, z] = position else {
        return Projected { place: (position[0], position[1]), depth: 0.0, value };
    };
    let (right, up, towards) = directions();
    let along = |axis: [f64; 3]| axis[0] * x + axis[1] * y + axis[2] * z;
    Projected { place: (along(right), along(up)), depth: along(towards), value }
}

/// Unit vectors of the projection: to the right, upwards, towards the viewer.
fn directions() -> ([f64; 3], [f64; 3], [f64; 3]) {
    let (azimuth, elevation) = (-60f64.to_radians(), 30f64.to_radians());
    let ((sa, ca), (se, ce)) = (azimuth.sin_cos(), elevation.sin_cos());
    ([-sa, ca, 0.0], [-se * ca, -se * sa, ce], [ce * ca, ce * sa, se])
}

fn extent(particles: &[Projected], component: impl Fn(Point) -> f64) -> (f64, f64) {
    let values = particles.iter().map(|particle| component(particle.place));
    let range = values.fold(None, |range: Option<(f64, f64)>, value| {
        let (low, high) = range.unwrap_or((value, value));
        Some((low.min(value), high.max(value)))
    });
    range.unwrap_or((0.0, 1.0))
}

fn discs(chart: &Chart<'_>, bar: &ColourBar<'_>, particles: &[Projected], radius: f64, space: bool) -> Vec<Disc> {
    let mut discs = Vec::with_capacity(particles.len());
    for particle in particles {
        let Some(centre) = chart.place(particle.place) else { continue };
        let fill = bar.fraction(particle.value).map_or(NOT_FINITE, |fraction| colour(bar.signed, fraction));
        if space && radius >= RIM_FROM {
            discs.push(Disc { centre, radius, colour: darker(fill) });
            discs.push(Disc { centre, radius: (0.82 * radius).max(radius - RIM), colour: fill });
        } else {
            discs.push(Disc { centre, radius, colour: fill });
        }
    }
    discs
}

impl Drawing for Prepared<'_> {
    fn size(&self) -> (f64, f64) {
        self.size
    }

    fn draw<B: DrawingBackend>(&self, canvas: &mut Canvas<'_, B>) -> Drawn {
        canvas.cloud(self.chart.area, &self.discs)?;
        draw_title(canvas, &self.title, self.size.0)?;
        let caption = shortened(&self.caption, 0.9 * TEXT, self.size.0 - 20.0);
        canvas.text((0.5 * self.size.0, 24.0 + CAPTION), &caption, 0.9 * TEXT, Align::Centre)?;
        if self.discs.is_empty() {
            self.chart.say_no_data(canvas)?;
        }
        if self.space {
            self.draw_strip(canvas)?;
        } else {
            self.chart.draw(canvas, self.size.0, false)?;
        }
        self.bar.draw(canvas, self.chart.area)
    }
}

impl Prepared<'_> {
    /// The directions of x, y and z, and a bar of known length.
    fn draw_strip<B: DrawingBackend>(&self, canvas: &mut Canvas<'_, B>) -> Drawn {
        const ARM: f64 = 30.0;
        let (right, up, _) = directions();
        let origin = (self.chart.area.left + 14.0, self.chart.area.bottom + STRIP - 24.0);
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            let arm = |length: f64| (origin.0 + length * right[axis], origin.1 - length * up[axis]);
            canvas.line(&[origin, arm(ARM)], 1.4, BLACK)?;
            let (x, y) = arm(ARM + 8.0);
            canvas.text((x, y + 0.3 * TEXT), name, TEXT, Align::Centre)?;
        }
        let length = round_step(0.12 * self.chart.area.width() / self.scale);
        let (left, y) = (origin.0 + 90.0, origin.1);
        let right = left + length * self.scale;
        canvas.line(&[(left, y), (right, y)], 2.0, BLACK)?;
        canvas.line(&[(left, y - 4.0), (left, y + 4.0)], 1.2, BLACK)?;
        canvas.line(&[(right, y - 4.0), (right, y + 4.0)], 1.2, BLACK)?;
        canvas.text((0.5 * (left + right), y - 8.0), &format!("{} m", readable(length, 3)), TEXT, Align::Centre)
    }
}
