//! Curves: how a series looks, lines, dashes and markers.

use plotters::backend::DrawingBackend;
use plotters::style::RGBColor;

use super::canvas::{Canvas, Drawn, Point};

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
    /// A dashed line with markers.
    DashedWithPoints,
}

impl Style {
    pub(super) fn has_markers(self) -> bool {
        matches!(self, Self::Points | Self::SolidWithPoints | Self::DashedWithPoints)
    }
}

/// What tells a series from the others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Look {
    pub(super) style: Style,
    pub(super) colour: RGBColor,
    /// Square markers instead of discs.
    pub(super) square: bool,
}

/// Draws an unbroken piece of a curve. A single point becomes a marker whatever the style.
pub(super) fn draw_curve<B: DrawingBackend>(canvas: &mut Canvas<'_, B>, points: &[Point], look: Look) -> Drawn {
    match look.style {
        _ if points.len() == 1 => {}
        Style::Solid | Style::SolidWithPoints => canvas.line(points, STROKE, look.colour)?,
        Style::Dashed | Style::DashedWithPoints => draw_dashes(canvas, points, (9.0, 6.0), look.colour)?,
        Style::Dotted => draw_dashes(canvas, points, (2.0, 4.5), look.colour)?,
        Style::Points => {}
    }
    if points.len() == 1 || look.style.has_markers() {
        points.iter().try_for_each(|&point| draw_marker(canvas, point, look))?;
    }
    Ok(())
}

/// Draws the marker of a series.
pub(super) fn draw_marker<B: DrawingBackend>(canvas: &mut Canvas<'_, B>, (x, y): Point, look: Look) -> Drawn {
    if look.square {
        canvas.rectangle((x - MARKER, y - MARKER), (x + MARKER, y + MARKER), look.colour)
    } else {
        canvas.disc((x, y), MARKER, look.colour)
    }
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
pub(super) fn thinned(points: &[Point]) -> Vec<Point> {
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
