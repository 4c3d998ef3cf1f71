//! Triangles that show a slope in a diagram with two logarithmic axes.

use plotters::backend::DrawingBackend;

use super::canvas::{Align, Canvas, Drawn, GREY, Point};
use super::chart::Chart;
use super::text::readable;

/// How far below a curve its triangle lies, as a factor.
const BELOW: f64 = 0.6;
/// Size of its numbers in points.
const TEXT: f64 = 12.0;

/// A right-angled triangle whose longest side has a given slope, below two points of a curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slope {
    /// The slope: the order of convergence.
    pub order: f64,
    /// The left point.
    pub from: (f64, f64),
    /// Where the right point lies along x.
    pub to: f64,
}

impl Slope {
    /// The lowest value of the triangle.
    pub(super) fn foot(&self) -> f64 {
        // Room for the number below it.
        0.75 * BELOW * self.from.1
    }

    /// The corners: left, lower right, upper right. None where the axes have no place for them.
    pub(super) fn corners(&self, chart: &Chart<'_>) -> Option<[Point; 3]> {
        let low = BELOW * self.from.1;
        // A little inside of the points, so that both can be seen.
        let ratio = self.to / self.from.0;
        let (left, right) = (self.from.0 * ratio.powf(0.15), self.from.0 * ratio.powf(0.85));
        let low = low * ratio.powf(0.15 * self.order);
        let high = low * (right / left).powf(self.order);
        Some([chart.place((left, low))?, chart.place((right, low))?, chart.place((right, high))?])
    }

    pub(super) fn draw<B: DrawingBackend>(&self, canvas: &mut Canvas<'_, B>, chart: &Chart<'_>) -> Drawn {
        let Some([left, right, top]) = self.corners(chart) else { return Ok(()) };
        canvas.line(&[left, right, top, left], 1.0, GREY)?;
        canvas.text((0.5 * (left.0 + right.0), right.1 + TEXT + 2.0), "1", TEXT, Align::Centre)?;
        let at = (right.0 + 6.0, 0.5 * (right.1 + top.1) + 0.35 * TEXT);
        canvas.text(at, &readable(self.order, 2), TEXT, Align::Left)
    }
}
