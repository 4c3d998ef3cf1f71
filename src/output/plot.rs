//! Line plots as SVG and PNG.
//!
//! Drawn from scratch on the backends of plotters rather than with its chart builder: the builder
//! decides ticks by loops that some ranges never end, and has no notion of a free place for a legend.

use std::path::{Path, PathBuf};

use plotters::backend::DrawingBackend;
use plotters::style::RGBColor;

use super::OutputError;
use super::axis::Axis;
use super::canvas::{Canvas, DENSITY, Drawing, Drawn, Point, document, write_both, write_png, write_svg};
use super::chart::{Area, Chart};
use super::colour::LINES;
use super::legend::Legend;
use super::slope::Slope;

/// Width and height of a plot in points.
const SIZE: (f64, f64) = (760.0, 460.0);
/// Width of curves in points.
const STROKE: f64 = 1.8;
/// Radius of markers in points.
const MARKER: f64 = 3.2;
/// Curves are thinned to what columns of this width in points can show.
const COLUMN: f64 = 0.5;

/// How a series is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Style {
    /// A solid line.
    #[default]
    Solid,
    /// A dashed line.
    Dashed,
    /// A dotted line.
    Dotted,
    /// Markers only.
    Points,
    /// A solid line with markers.
    SolidWithPoints,
}

/// One curve.
#[derive(Debug, Clone, Default)]
pub struct LineSeries {
    /// Name in the legend; empty for none.
    pub name: String,
    /// Pairs (x, y) in the order in which they are connected. Pairs without a place (not finite, or not
    /// positive on a logarithmic axis) interrupt the line.
    pub points: Vec<(f64, f64)>,
    /// How it is drawn. The colour follows from the place in the list; when the colours are used up,
    /// solid lines become dashed.
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

    fn looks(&self) -> impl Iterator<Item = (&LineSeries, Style, RGBColor)> {
        self.series.iter().enumerate().map(|(index, series)| {
            let again = index >= LINES.len();
            let style = if again && series.style == Style::Solid { Style::Dashed } else { series.style };
            (series, style, LINES[index % LINES.len()])
        })
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
        if matches!(series.style, Style::Points | Style::SolidWithPoints) {
            return pieces;
        }
        pieces.iter().map(|piece| thinned(piece)).collect()
    }
}

impl Drawing for LinePlot {
    fn size(&self) -> (f64, f64) {
        let or = |given: f64, usual: f64| if given > 0.0 { given } else { usual };
        let width = or(self.size.0, SIZE.0);
        (width, or(self.size.1, SIZE.1 / SIZE.0 * width))
    }

    fn draw<B: DrawingBackend>(&self, canvas: &mut Canvas<'_, B>) -> Drawn {
        let pairs = || self.series.iter().flat_map(|series| &series.points);
        // Only pairs that have a place count: a NaN in y must not stretch the x axis.
        let shown = |&&(x, y): &&(f64, f64)| {
            let has_place = |value: f64, log: bool| value.is_finite() && (!log || value > 0.0);
            has_place(x, self.log_x) && has_place(y, self.log_y)
        };
        let has_markers = self.series.iter().any(|s| matches!(s.style, Style::Points | Style::SolidWithPoints));
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
        let named = self.looks().map(|(series, style, colour)| (series.name.clone(), style, colour));
        let legend = Legend::new(named, area.height());
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
        for (series, style, colour) in self.looks() {
            for piece in Self::pieces(&chart, series) {
                draw_curve(canvas, &piece, style, colour)?;
            }
        }
        self.slopes.iter().try_for_each(|slope| slope.draw(canvas, &chart))?;
        if legend.is_empty() {
            return Ok(());
        }
        legend.draw(canvas, place.unwrap_or((chart.area.right + 8.0, chart.area.top)), place.is_some())
    }
}

/// Diagrams side by side, row after row.
#[derive(Debug, Clone, Default)]
pub struct PlotGrid {
    /// Diagrams in a row; 0 counts as 1.
    pub columns: usize,
    /// The diagrams, in reading order.
    pub plots: Vec<LinePlot>,
}

impl PlotGrid {
    /// As [`LinePlot::write`].
    ///
    /// # Errors
    /// As [`LinePlot::write`].
    pub fn write(&self, path_without_extension: &Path) -> Result<[PathBuf; 2], OutputError> {
        write_both(self, path_without_extension)
    }

    fn columns(&self) -> usize {
        self.columns.clamp(1, self.plots.len().max(1))
    }
}

impl Drawing for PlotGrid {
    fn size(&self) -> (f64, f64) {
        let columns = self.columns();
        (SIZE.0 * columns as f64, SIZE.1 * self.plots.len().div_ceil(columns).max(1) as f64)
    }

    fn draw<B: DrawingBackend>(&self, canvas: &mut Canvas<'_, B>) -> Drawn {
        let columns = self.columns();
        for (index, plot) in self.plots.iter().enumerate() {
            canvas.count_from((SIZE.0 * (index % columns) as f64, SIZE.1 * (index / columns) as f64));
            plot.draw(canvas)?;
        }
        Ok(())
    }
}

/// Draws an unbroken piece of a curve. A single point becomes a marker whatever the style.
pub(super) fn draw_curve<B: DrawingBackend>(
    canvas: &mut Canvas<'_, B>,
    points: &[Point],
    style: Style,
    colour: RGBColor,
) -> Drawn {
    match style {
        _ if points.len() == 1 => {}
        Style::Solid | Style::SolidWithPoints => canvas.line(points, STROKE, colour)?,
        Style::Dashed => draw_dashes(canvas, points, (9.0, 6.0), colour)?,
        Style::Dotted => draw_dashes(canvas, points, (2.0, 4.5), colour)?,
        Style::Points => {}
    }
    if points.len() == 1 || matches!(style, Style::Points | Style::SolidWithPoints) {
        for &point in points {
            canvas.disc(point, MARKER, colour)?;
        }
    }
    Ok(())
}

/// Draws a polyline as dashes of length `on` with gaps of length `off`, measured along the line.
fn draw_dashes<B: DrawingBackend>(
    canvas: &mut Canvas<'_, B>,
    points: &[Point],
    (on, off): (f64, f64),
    colour: RGBColor,
) -> Drawn {
    let Some(&first) = points.first() else { return Ok(()) };
    let (mut dash, mut drawing, mut left) = (vec![first], true, on);
    for pair in points.windows(2) {
        let (from, to) = (pair[0], pair[1]);
        let length = (to.0 - from.0).hypot(to.1 - from.1);
        let mut done = 0.0;
        while length - done > left {
            done += left;
            let at = (from.0 + done / length * (to.0 - from.0), from.1 + done / length * (to.1 - from.1));
            if drawing {
                dash.push(at);
                canvas.line(&dash, STROKE, colour)?;
            }
            dash.clear();
            dash.push(at);
            drawing = !drawing;
            left = if drawing { on } else { off };
        }
        left -= length - done;
        if drawing {
            dash.push(to);
        }
    }
    if drawing { canvas.line(&dash, STROKE, colour) } else { Ok(()) }
}

/// Replaces the points within one column by the first, lowest, highest and last of them: a history of
/// a million steps then looks the same and takes a few kilobytes.
fn thinned(points: &[Point]) -> Vec<Point> {
    let column = |point: &Point| (point.0 / COLUMN).floor();
    let mut kept = Vec::new();
    for group in points.chunk_by(|a, b| column(a) == column(b)) {
        if group.len() <= 4 {
            kept.extend_from_slice(group);
            continue;
        }
        let indices = 1..group.len() - 1;
        let lowest = indices.clone().min_by(|&a, &b| group[a].1.total_cmp(&group[b].1)).unwrap_or(0);
        let highest = indices.max_by(|&a, &b| group[a].1.total_cmp(&group[b].1)).unwrap_or(0);
        let (early, late) = (lowest.min(highest), lowest.max(highest));
        kept.extend([group[0], group[early], group[late], group[group.len() - 1]]);
    }
    kept
}
