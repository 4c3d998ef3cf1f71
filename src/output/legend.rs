//! Where the legend goes: into a part of the diagram that no curve enters, else beside it.

use plotters::backend::DrawingBackend;

use super::canvas::{Align, Canvas, Drawn, GREY, Point, WHITE, shortened, text_width};
use super::chart::{Area, TEXT};
use super::curve::{Look, Style, draw_curve, draw_marker};

/// Height of one entry in points.
const ROW: f64 = TEXT + 5.0;
/// Length of the sample of the line.
const SAMPLE: f64 = 30.0;
/// Space around the entries.
const PADDING: f64 = 7.0;
/// Longest entry.
const LONGEST: f64 = 230.0;
/// Distance to curves and frame.
const CLEARANCE: f64 = 8.0;

/// The entries of a legend.
#[derive(Debug, Clone, Default)]
pub(super) struct Legend {
    entries: Vec<(String, Look)>,
}

impl Legend {
    /// A legend of the named series; what does not fit into `height` points is counted in a last entry.
    pub(super) fn new(named: impl Iterator<Item = (String, Look)>, height: f64) -> Self {
        let mut entries: Vec<_> = named
            .filter(|(name, ..)| !name.is_empty())
            .map(|(name, look)| (shortened(&name, TEXT, LONGEST), look))
            .collect();
        let fitting = (((height - 2.0 * PADDING) / ROW) as usize).max(2);
        if entries.len() > fitting {
            let hidden = entries.len() - (fitting - 1);
            entries.truncate(fitting - 1);
            entries.push((format!("… and {hidden} more"), Look { style: Style::Points, colour: WHITE, square: false }));
        }
        Self { entries }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    pub(super) fn width(&self) -> f64 {
        let widest = self.entries.iter().map(|(name, ..)| text_width(name, TEXT)).fold(0.0, f64::max);
        2.0 * PADDING + SAMPLE + 7.0 + widest
    }

    fn height(&self) -> f64 {
        2.0 * PADDING + ROW * self.entries.len() as f64 - 5.0
    }

    /// Upper left corner of a place inside `area` that none of the `curves` enters; `None` if there is none.
    pub(super) fn free_place(&self, area: Area, curves: &[Vec<Point>]) -> Option<Point> {
        let (width, height) = (self.width(), self.height());
        let (right, bottom) = (area.right - width - CLEARANCE, area.bottom - height - CLEARANCE);
        let (left, top) = (area.left + CLEARANCE, area.top + CLEARANCE);
        if right < left || bottom < top {
            return None;
        }
        let (centre, middle) = (0.5 * (left + right), 0.5 * (top + bottom));
        let places = [
            (right, top),
            (left, top),
            (right, bottom),
            (left, bottom),
            (centre, top),
            (centre, bottom),
            (right, middle),
            (left, middle),
        ];
        places.into_iter().find(|&(x, y)| {
            let inside = |(px, py): Point| {
                (x - CLEARANCE..=x + width + CLEARANCE).contains(&px)
                    && (y - CLEARANCE..=y + height + CLEARANCE).contains(&py)
            };
            !curves.iter().any(|curve| enters(curve, inside))
        })
    }

    pub(super) fn draw<B: DrawingBackend>(&self, canvas: &mut Canvas<'_, B>, (x, y): Point, framed: bool) -> Drawn {
        if framed {
            let (right, bottom) = (x + self.width(), y + self.height());
            canvas.rectangle((x, y), (right, bottom), WHITE)?;
            canvas.line(&[(x, y), (right, y), (right, bottom), (x, bottom), (x, y)], 0.6, GREY)?;
        }
        for (row, (name, look)) in self.entries.iter().enumerate() {
            let middle = y + PADDING + ROW * (row as f64 + 0.5) - 2.5;
            let sample = [(x + PADDING, middle), (x + PADDING + SAMPLE, middle)];
            let marker = (x + PADDING + 0.5 * SAMPLE, middle);
            let line = match look.style {
                Style::Points => None,
                Style::SolidWithPoints => Some(Style::Solid),
                Style::DashedWithPoints => Some(Style::Dashed),
                style => Some(style),
            };
            if let Some(style) = line {
                draw_curve(canvas, &sample, Look { style, ..*look })?;
            }
            if line != Some(look.style) {
                draw_marker(canvas, marker, *look)?;
            }
            let at = (x + PADDING + SAMPLE + 7.0, middle + 0.35 * TEXT);
            canvas.text(at, name, TEXT, Align::Left)?;
        }
        Ok(())
    }
}

/// Whether a polyline has a point for which `inside` holds, looked at every few points of its length.
fn enters(curve: &[Point], inside: impl Fn(Point) -> bool) -> bool {
    const STRIDE: f64 = 3.0;
    curve.iter().any(|&point| inside(point))
        || curve.windows(2).any(|pair| {
            let (dx, dy) = (pair[1].0 - pair[0].0, pair[1].1 - pair[0].1);
            let pieces = (dx.hypot(dy) / STRIDE).ceil().clamp(1.0, 1000.0) as usize;
            (1..pieces).any(|piece| {
                let part = piece as f64 / pieces as f64;
                inside((pair[0].0 + part * dx, pair[0].1 + part * dy))
            })
        })
}
