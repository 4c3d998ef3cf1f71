//! A still picture of particles coloured by a scalar, as SVG and PNG.
//!
//! In the plane with equal axes; in space from a chosen direction, the nearer over the farther; on the
//! line as the value over the position. Meant for reports and for a first look without a viewer.

use std::path::{Path, PathBuf};

use plotters::backend::DrawingBackend;

use super::axis::{Axis, round_step};
use super::canvas::{Align, BLACK, Canvas, DENSITY, Disc, Drawing, Drawn, Point, document, picture, shortened};
use super::canvas::{write_both, write_png};
use super::chart::{Area, Chart, TEXT, draw_title};
use super::colour::{ColourMap, NOT_FINITE, colour};
use super::colour_bar::ColourBar;
use super::particle_sizes::Sizes;
use super::picture::Picture;
use super::splat::Look;
use super::text::readable;
use super::view::{Bounds, Camera, NO_BOUNDS, View, has_place, widened};
use super::{LinePlot, LineSeries, OutputError, Style};

/// Width of the page in points, where nothing else is asked for.
const WIDTH: f64 = 760.0;
/// Highest and lowest plotting area, and the narrowest.
const HEIGHTS: (f64, f64) = (560.0, 150.0);
const NARROWEST: f64 = 240.0;
/// Height of the line below the title.
const CAPTION: f64 = 18.0;
/// Height of the strip with the directions and the scale of a picture of space.
const STRIP: f64 = 74.0;
/// Width in points of the line around a body in the plane.
const OUTLINE: f64 = 1.0;
/// Most particles on a line that get a marker each.
const MOST_MARKERS: usize = 150;

/// A picture of particles.
#[derive(Debug, Clone, Default)]
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
    /// Volume of each particle in m^dim: it decides the size of its disc. Empty: all have the `spacing`.
    pub volumes: &'a [f64],
    /// Distance between neighbouring particles in m; if it is of no use (0), that of the nearest neighbours is.
    pub spacing: f64,
    /// How values become colours.
    pub colours: ColourMap,
    /// The values at the ends of the colour bar; `None`: the smallest and the largest.
    pub range: Option<(f64, f64)>,
    /// Reference positions, of which the outline is drawn below; empty for none. In the plane only.
    pub reference: &'a [f64],
    /// From where space is seen.
    pub view: View,
    /// Low and high end in m of all that there must be room for; `None`: the particles.
    pub frame: Option<Extent>,
    /// Width and height of the page in points; 0 for what suits the particles.
    pub page: (f64, f64),
}

/// What the pictures of a series have in common, so that nothing jumps between them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extent {
    /// Low and high end in each direction, m.
    pub bounds: [(f64, f64); 3],
    /// Low and high end of the picture to the right and upwards, m.
    pub seen: [(f64, f64); 2],
    /// Smallest and largest value.
    pub values: (f64, f64),
    /// Edge of most particles, m.
    pub edge: f64,
}

/// A particle on the page of a plane or projected picture.
struct Projected {
    place: Point,
    depth: f64,
    value: f64,
    /// Apparent edge length, m.
    size: f64,
}

/// Everything that is needed to draw, worked out once for both files.
struct Prepared<'a> {
    title: String,
    caption: String,
    chart: Chart<'a>,
    directions: Option<[[f64; 3]; 3]>,
    bar: ColourBar<'a>,
    under: Vec<Disc>,
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
        self.check(path_without_extension)?;
        if self.dim == 1 {
            return self.over_position().write(path_without_extension);
        }
        write_both(&self.prepare(), path_without_extension)
    }

    /// Writes a PNG picture of `density` pixels per point.
    ///
    /// # Errors
    /// As [`ParticlePlot::write`].
    pub fn write_png(&self, density: f64, path: &Path) -> Result<(), OutputError> {
        self.check(path)?;
        if self.dim == 1 {
            return write_png(&self.over_position(), density, path);
        }
        write_png(&self.prepare(), density, path)
    }

    /// An SVG document; `path` is what messages name.
    ///
    /// # Errors
    /// As [`ParticlePlot::write`].
    pub fn document(&self, path: &Path) -> Result<String, OutputError> {
        self.check(path)?;
        if self.dim == 1 { document(&self.over_position(), path) } else { document(&self.prepare(), path) }
    }

    /// The picture as pixels; `path` is what messages name.
    pub(super) fn pixels(&self, density: f64, path: &Path) -> Result<Picture, OutputError> {
        self.check(path)?;
        if self.dim == 1 {
            return picture(&self.over_position(), density, path);
        }
        picture(&self.prepare(), density, path)
    }

    /// Pixels per point and points of a page of `width` pixels: the text neither vanishes in small pictures nor
    /// fills them.
    pub fn density(width: usize) -> f64 {
        (width as f64 / WIDTH).clamp(1.0, DENSITY)
    }

    fn check(&self, path: &Path) -> Result<(), OutputError> {
        const ACTION: &str = "draw the particles into";
        if !(1..=3).contains(&self.dim) {
            return Err(OutputError::Unsuitable {
                action: ACTION,
                path: path.to_path_buf(),
                reason: format!("points have {} dimensions", self.dim),
                remedy: "use 1, 2 or 3",
            });
        }
        let count = self.values.len();
        OutputError::check_length(ACTION, path, "positions", self.dim * count, self.positions.len())?;
        for (name, components, found) in
            [("volumes", 1, self.volumes.len()), ("reference", self.dim, self.reference.len())]
        {
            if found > 0 {
                OutputError::check_length(ACTION, path, name, components * count, found)?;
            }
        }
        Ok(())
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
            x_range: self.frame.map(|frame| frame.bounds[0]),
            y_range: self.range.or(self.frame.map(|frame| frame.values)),
            size: self.page,
            ..LinePlot::default()
        }
    }

    /// Everything that a series of pictures must have room for, as far as this one tells, added to what is known.
    /// `bounds` are those of the whole series: perspective depends on them.
    pub fn extent(&self, known: Option<Extent>, bounds: [(f64, f64); 3]) -> Extent {
        let nothing = (f64::INFINITY, f64::NEG_INFINITY);
        let sizes = || Sizes::new(self.dim, self.volumes, self.spacing, self.positions);
        let mut extent =
            known.unwrap_or_else(|| Extent { bounds, seen: [nothing; 2], values: nothing, edge: sizes().typical });
        let join = |range: &mut (f64, f64), value: f64| *range = (range.0.min(value), range.1.max(value));
        if self.dim > 1 {
            for particle in self.project(&Camera::new(&self.view, &bounds), &Sizes::none()) {
                join(&mut extent.seen[0], particle.place.0);
                join(&mut extent.seen[1], particle.place.1);
            }
        }
        self.values.iter().filter(|value| value.abs() <= 1e300).for_each(|&value| join(&mut extent.values, value));
        extent
    }

    /// Low and high end in each direction, added to what is known.
    pub fn bounds(&self, known: Option<[(f64, f64); 3]>) -> [(f64, f64); 3] {
        widened(widened(known.unwrap_or(NO_BOUNDS), self.positions, self.dim), self.reference, self.dim)
    }

    fn project(&self, camera: &Camera, sizes: &Sizes<'_>) -> Vec<Projected> {
        let particles = self.positions.chunks_exact(self.dim).zip(self.values).enumerate();
        particles
            .filter(|(_, (position, _))| has_place(position))
            .filter_map(|(at, (position, &value))| {
                let seen = camera.see(position)?;
                Some(Projected { place: seen.place, depth: seen.depth, value, size: seen.size * sizes.of(at) })
            })
            .collect()
    }

    fn prepare(&self) -> Prepared<'_> {
        let space = self.dim == 3;
        let bounds: Bounds = self.frame.map_or_else(|| self.bounds(None), |frame| frame.bounds);
        let camera = Camera::new(&self.view, &bounds);
        let mut sizes = Sizes::new(self.dim, self.volumes, self.spacing, self.positions);
        if let Some(frame) = self.frame {
            sizes.usual = frame.edge;
        }
        let mut particles = self.project(&camera, &sizes);
        // Stable, so that the picture does not depend on the sorting of equals.
        particles.sort_by(|a, b| a.depth.total_cmp(&b.depth));

        let range = self.range.or(self.frame.map(|frame| frame.values).filter(|(low, high)| low <= high));
        let fixed = range.map(|range| if self.range.is_none() { self.colours.ends(range) } else { range });
        let bar = ColourBar::new(self.label, particles.iter().map(|particle| particle.value), self.colours, fixed);
        let usable = |(low, high): (f64, f64)| if low <= high { (low, high) } else { (0.0, 1.0) };
        let seen = self.frame.map_or_else(|| self.extent(None, bounds).seen, |frame| frame.seen);
        let seen = if space { seen } else { [0, 1].map(|axis| join(seen[axis], bounds[axis])) };
        let (horizontal, vertical) = (usable(seen[0]), usable(seen[1]));
        let grown = |(low, high): (f64, f64), margin: f64| (low - margin, high + margin);
        let margin = 0.7 * sizes.usual + 0.03 * (horizontal.1 - horizontal.0).max(vertical.1 - vertical.0);
        let (horizontal, vertical) = (grown(horizontal, margin), grown(vertical, margin));

        // The y axis decides how much room there is, and the room decides the range of the y axis; the
        // labels hardly depend on the range, so once is enough.
        let draft = Axis::between(vertical.0, vertical.1, 6.0);
        let title = self.stamped_title();
        let left = if space { 24.0 } else { Chart::room_left(&draft) };
        let top = Chart::room_above(&title, &draft).max(bar.room_above()) + CAPTION;
        let below = if space { STRIP } else { Chart::room_below() };
        let (page, tall) = (if self.page.0 > 0.0 { self.page.0 } else { WIDTH }, self.page.1 > 0.0);
        let highest = if tall { self.page.1 - top - below } else { HEIGHTS.0 * (page / WIDTH) };
        let room = ((page - left - bar.room()).max(40.0), highest.max(40.0));
        let scale = (room.0 / (horizontal.1 - horizontal.0)).min(room.1 / (vertical.1 - vertical.0));
        let fitted = |wanted: f64, least: f64, most: f64, exact: bool| {
            if exact { most } else { wanted.clamp(least.min(most), most) }
        };
        let width = fitted(scale * (horizontal.1 - horizontal.0), NARROWEST, room.0, self.page.0 > 0.0);
        let height = fitted(scale * (vertical.1 - vertical.0), HEIGHTS.1, room.1, tall);
        let broadened = |(low, high): (f64, f64), length: f64| {
            let middle = 0.5 * (low + high);
            (middle - 0.5 * length / scale, middle + 0.5 * length / scale)
        };
        let (horizontal, vertical) = (broadened(horizontal, width), broadened(vertical, height));
        let x = Axis::between(horizontal.0, horizontal.1, width / 75.0);
        let y = Axis::between(vertical.0, vertical.1, height / 40.0);
        let area = Area { left, top, right: left + width, bottom: top + height };
        // Titles come from `title` and `caption` below, which may be wider than the plotting area.
        let chart = Chart { title: "", x_label: "x [m]", y_label: "y [m]", x, y, area };

        let disc = |place: Point, depth: f64, size: f64, colour| {
            let radius = sizes.radius(size, scale);
            chart.place(place).map(|centre| Disc { centre, radius, depth: depth * scale, colour })
        };
        let shade = |value: f64| bar.fraction(value).map_or(NOT_FINITE, |at| colour(bar.signed, at));
        let discs = particles.iter().filter_map(|p| disc(p.place, p.depth, p.size, shade(p.value))).collect();
        let under = if space { &[] } else { self.reference };
        let under = (under.chunks_exact(self.dim).enumerate())
            .filter(|(_, position)| has_place(position))
            .filter_map(|(at, position)| disc((position[0], position[1]), 0.0, sizes.of(at), BLACK))
            .collect();
        let caption = bar.caption(particles.len(), self.values.len() - particles.len());
        let size = (area.right + bar.room(), area.bottom + below);
        let directions = space.then(|| self.view.directions());
        Prepared { title, caption, chart, directions, bar, under, discs, scale, size }
    }
}

/// A range that holds both; an empty one does not count.
fn join(a: (f64, f64), b: (f64, f64)) -> (f64, f64) {
    (a.0.min(b.0), a.1.max(b.1))
}

impl Drawing for Prepared<'_> {
    fn size(&self) -> (f64, f64) {
        self.size
    }

    fn draw<B: DrawingBackend>(&self, canvas: &mut Canvas<'_, B>) -> Drawn {
        let look = if self.directions.is_some() { Look::Balls } else { Look::Flat { outline: OUTLINE } };
        canvas.cloud(self.chart.area, &self.under, &self.discs, look)?;
        draw_title(canvas, &self.title, self.size.0)?;
        let caption = shortened(&self.caption, 0.9 * TEXT, self.size.0 - 20.0);
        canvas.text((0.5 * self.size.0, 24.0 + CAPTION), &caption, 0.9 * TEXT, Align::Centre)?;
        if self.discs.is_empty() {
            self.chart.say_no_data(canvas)?;
        }
        match &self.directions {
            Some(directions) => self.draw_strip(canvas, directions)?,
            None => self.chart.draw(canvas, self.size.0, false)?,
        }
        self.bar.draw(canvas, self.chart.area)
    }
}

impl Prepared<'_> {
    /// The directions of x, y and z, and a bar of known length.
    fn draw_strip<B: DrawingBackend>(&self, canvas: &mut Canvas<'_, B>, directions: &[[f64; 3]; 3]) -> Drawn {
        const ARM: f64 = 30.0;
        let [right, up, _] = directions;
        let origin = (self.chart.area.left + 34.0, self.chart.area.bottom + STRIP - 34.0);
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            let arm = |length: f64| (origin.0 + length * right[axis], origin.1 - length * up[axis]);
            if right[axis].hypot(up[axis]) < 0.1 {
                // It points at the viewer.
                continue;
            }
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
