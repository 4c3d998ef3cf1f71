//! Line plots as SVG and PNG.
//!
//! Drawn from scratch on the backends of plotters rather than with its chart builder: the builder
//! decides ticks by loops that some ranges never end, and has no notion of a free place for a legend.

use std::path::{Path, PathBuf};

use plotters::backend::DrawingBackend;

use super::OutputError;
use super::axis::Axis;
use super::canvas::{Canvas, DENSITY, Drawing, Drawn, Point, document, write_both, write_png, write_svg};
use super::chart::{Area, Chart};
use super::colour::LINES;
use super::curve::{Look, Style, draw_curve, thinned};
use super::legend::Legend;
use super::slope::Slope;

/// Width and height of a plot in points.
pub(super) const SIZE: (f64, f64) = (760.0, 460.0);

/// One curve.
#[derive(Debug, Clone, Default)]
pub struct LineSeries {
    /// Name in the legend; empty for none.
    pub name: String,
    /// Pairs (x, y) in the order in which they are connected. Pairs without a place (not finite, or not
    /// positive on a logarithmic axis) interrupt the line.
    pub points: Vec<(f64, f64)>,
    /// How it is drawn. The colour follows from the place in the list; when the colours are used up,
    /// solid lines become dashed and markers square.
    pub style: Style,
}

/// A diagram of curves.
///
/// Any data give a picture: none, a single point, constants, NaN, ranges of hundreds of decades.
#[derive(Debug, Clone, Default)]
pub struct LinePlot {
    /// Written above; may be empty.
    pub title: String,
    /// What is along x, with its unit (`"t [s]"`).
    pub x_label: String,
    /// What is along y, with its unit.
    pub y_label: String,
    /// The curves; later ones are drawn over earlier ones.
    pub series: Vec<LineSeries>,
    /// Whether x is logarithmic.
    pub log_x: bool,
    /// Whether y is logarithmic.
    pub log_y: bool,
    /// Ends of the x axis before its margin; `None`: those of the data.
    pub x_range: Option<(f64, f64)>,
    /// Ends of the y axis before its margin; `None`: those of the data.
    pub y_range: Option<(f64, f64)>,
    /// Triangles that show slopes; on two logarithmic axes.
    pub slopes: Vec<Slope>,
    /// Width and height in points; 0 for the usual ones.
    pub size: (f64, f64),
}

impl LinePlot {
    /// Writes `PATH.svg` and `PATH.png` as wholes and returns both paths. The same data give the same bytes.
    ///
    /// # Errors
    /// [`OutputError::File`] if the disk refuses, [`OutputError::Drawing`] if the drawing library does.
    pub fn write(&self, path_without_extension: &Path) -> Result<[PathBuf; 2], OutputError> {
        write_both(self, path_without_extension)
    }

    /// Writes an SVG document or a PNG picture, as the extension says.
    ///
    /// # Errors
    /// [`OutputError::Request`] for any other extension; as [`LinePlot::write`].
    pub fn write_as(&self, path: &Path) -> Result<(), OutputError> {
        match path.extension().and_then(|kind| kind.to_str()).map(str::to_lowercase).as_deref() {
            Some("svg") => write_svg(self, path),
            Some("png") => write_png(self, DENSITY, path),
            _ => {
                let what = format!("cannot tell the format of {}", path.display());
                Err(OutputError::request(what, "give a name that ends in .svg or .png"))
            }
        }
    }

    /// The plot as an SVG document; `path` is what messages name.
    pub(super) fn document(&self, path: &Path) -> Result<String, OutputError> {
        document(self, path)
    }

    pub(super) fn looks(&self) -> impl Iterator<Item = (&LineSeries, Look)> {
        self.series.iter().enumerate().map(|(index, series)| {
            let again = index >= LINES.len();
            let style = if again && series.style == Style::Solid { Style::Dashed } else { series.style };
            (series, Look { style, colour: LINES[index % LINES.len()], square: again })
        })
    }

    /// A legend of at most `height` points.
    pub(super) fn legend(&self, height: f64) -> Legend {
        Legend::new(self.looks().map(|(series, look)| (series.name.clone(), look)), height)
    }

    /// The unbroken pieces of a series in points on the page, thinned.
    fn pieces(chart: &Chart<'_>, series: &LineSeries) -> Vec<Vec<Point>> {
        let mut pieces = vec![Vec::new()];
        for &pair in &series.points {
            match (chart.place(pair), pieces.last_mut()) {
                (Some(point), Some(piece)) => piece.push(point),
                _ => pieces.push(Vec::new()),
            }
        }
        pieces.retain(|piece| !piece.is_empty());
        if series.style.has_markers() {
            return pieces;
        }
        pieces.iter().map(|piece| thinned(piece)).collect()
    }

    /// Draws it with its own legend, or without one.
    pub(super) fn draw_with<B: DrawingBackend>(&self, canvas: &mut Canvas<'_, B>, has_legend: bool) -> Drawn {
        let pairs = || self.series.iter().flat_map(|series| &series.points);
        // Only pairs that have a place count: a NaN in y must not stretch the x axis.
        let shown = |&&(x, y): &&(f64, f64)| {
            let has_place = |value: f64, log: bool| value.is_finite() && (!log || value > 0.0);
            has_place(x, self.log_x) && has_place(y, self.log_y)
        };
        let has_markers = self.series.iter().any(|series| series.style.has_markers());
        let margin = if has_markers { 0.03 } else { 0.0 };
        let both = |range: Option<(f64, f64)>| range.into_iter().flat_map(|(low, high)| [low, high]);
        let axis = |range, values: &mut dyn Iterator<Item = f64>, log, margin| match range {
            Some(_) => Axis::new(both(range), log, margin),
            None => Axis::new(values, log, margin),
        };
        let x = axis(self.x_range, &mut pairs().filter(shown).map(|pair| pair.0), self.log_x, margin);
        let feet = self.slopes.iter().map(Slope::foot);
        let y = axis(self.y_range, &mut pairs().filter(shown).map(|pair| pair.1).chain(feet), self.log_y, 0.06);
        let size = self.size();
        let area = Area {
            left: Chart::room_left(&y),
            top: Chart::room_above(&self.title, &y),
            right: size.0 - 24.0,
            bottom: size.1 - Chart::room_below(),
        };
        let mut chart = Chart { title: &self.title, x_label: &self.x_label, y_label: &self.y_label, x, y, area };
        let legend = if has_legend { self.legend(area.height()) } else { Legend::default() };
        let curves = |chart: &Chart<'_>| -> Vec<Vec<Point>> {
            let triangles = self.slopes.iter().filter_map(|slope| slope.corners(chart)).map(|corners| corners.to_vec());
            self.series.iter().flat_map(|series| Self::pieces(chart, series)).chain(triangles).collect()
        };
        let place = legend.free_place(area, &curves(&chart));
        if place.is_none() && !legend.is_empty() {
            chart.area.right -= legend.width() + 4.0;
        }

        chart.draw(canvas, size.0, true)?;
        if pairs().find(shown).is_none() {
            chart.say_no_data(canvas)?;
        }
        for (series, look) in self.looks() {
            for piece in Self::pieces(&chart, series) {
                draw_curve(canvas, &piece, look)?;
            }
        }
        self.slopes.iter().try_for_each(|slope| slope.draw(canvas, &chart))?;
        if legend.is_empty() {
            return Ok(());
        }
        legend.draw(canvas, place.unwrap_or((chart.area.right + 8.0, chart.area.top)), place.is_some())
    }
}

impl Drawing for LinePlot {
    fn size(&self) -> (f64, f64) {
        let or = |given: f64, usual: f64| if given > 0.0 { given } else { usual };
        let width = or(self.size.0, SIZE.0);
        (width, or(self.size.1, SIZE.1 / SIZE.0 * width))
    }

    fn draw<B: DrawingBackend>(&self, canvas: &mut Canvas<'_, B>) -> Drawn {
        self.draw_with(canvas, true)
    }
}
