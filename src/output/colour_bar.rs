//! The colour bar of a picture of particles, and the range of values it stands for.

use plotters::backend::DrawingBackend;

use super::axis::{Axis, Label};
use super::canvas::{Align, BLACK, Canvas, Drawn, shortened, text_width};
use super::chart::{Area, TEXT, draw_note};
use super::colour::{ColourMap, colour};
use super::text::readable;

/// Width of the bar in points.
const BAR: f64 = 16.0;
/// Distance to the plotting area.
const GAP: f64 = 20.0;
/// Size of its numbers.
const SMALL: f64 = 12.0;
/// Stripes of constant colour.
const STRIPES: usize = 128;

/// A vertical bar to the right of a plotting area.
pub(super) struct ColourBar<'a> {
    label: &'a str,
    low: f64,
    high: f64,
    /// The axis along the bar, for places; its ticks suit a bar of usual length.
    axis: Axis,
    found: Option<(f64, f64)>,
    not_finite: usize,
    /// Whether the map for signed values is used.
    pub(super) signed: bool,
}

impl<'a> ColourBar<'a> {
    /// The bar for these values; `range` tells its ends, else the values do.
    pub(super) fn new(
        label: &'a str,
        values: impl Iterator<Item = f64>,
        map: ColourMap,
        range: Option<(f64, f64)>,
    ) -> Self {
        let (mut found, mut not_finite) = (None, 0);
        for value in values {
            if value.abs() <= 1e300 {
                let (low, high): (f64, f64) = found.unwrap_or((value, value));
                found = Some((low.min(value), high.max(value)));
            } else {
                not_finite += 1;
            }
        }
        let (low, high) = range.unwrap_or_else(|| map.ends(found.unwrap_or((0.0, 1.0))));
        let signed = map.is_signed(low, high);
        Self { label, low, high, axis: Axis::between(low, high, 6.0), found, not_finite, signed }
    }

    /// Where the colour of a value stands on the bar, from 0 to 1; `None` for a value without colour.
    pub(super) fn fraction(&self, value: f64) -> Option<f64> {
        self.axis.place(value)
    }

    /// Room to the right of the plotting area that the bar needs.
    pub(super) fn room(&self) -> f64 {
        GAP + BAR + 9.0 + self.numbers_width() + 10.0 + TEXT + 10.0
    }

    /// Room above the plotting area for the factor of the numbers.
    pub(super) fn room_above(&self) -> f64 {
        37.0 + SMALL + 6.0
    }

    fn numbers_width(&self) -> f64 {
        self.axis.ticks.iter().map(|tick| text_width(text(&tick.label), SMALL)).fold(24.0, f64::max)
    }

    /// The line below the title: the range of the values and how many there are.
    pub(super) fn caption(&self, shown: usize, without_place: usize) -> String {
        let mut caption = self.found.map_or_else(String::new, |(low, high)| {
            // Enough digits to tell the ends apart.
            let spread = low.abs().max(high.abs()) / (high - low);
            let digits = 4 + if spread.is_finite() { spread.log10().clamp(0.0, 11.0) as usize } else { 0 };
            format!("from {} to {}, ", readable(low, digits), readable(high, digits))
        });
        caption += &counted(shown, "particle");
        if self.not_finite > 0 {
            caption += &format!(", {} not finite (magenta)", counted(self.not_finite, "value"));
        }
        if without_place > 0 {
            caption += &format!(", {} not finite (not shown)", counted(without_place, "position"));
        }
        caption
    }

    /// Draws the bar beside `area`.
    pub(super) fn draw<B: DrawingBackend>(&self, canvas: &mut Canvas<'_, B>, area: Area) -> Drawn {
        let (left, right) = (area.right + GAP, area.right + GAP + BAR);
        let Area { top, bottom, .. } = area;
        let height = area.height() / STRIPES as f64;
        for stripe in 0..STRIPES {
            let upper = bottom - height * (stripe + 1) as f64;
            // Each stripe reaches below the one before it, or anti-aliasing would show seams.
            let lower = (upper + 2.0 * height).min(bottom);
            let fraction = (stripe as f64 + 0.5) / STRIPES as f64;
            canvas.rectangle((left, upper), (right, lower), colour(self.signed, fraction))?;
        }
        canvas.line(&[(left, top), (right, top), (right, bottom), (left, bottom), (left, top)], 0.8, BLACK)?;
        let axis = Axis::between(self.low, self.high, area.height() / 30.0);
        for tick in &axis.ticks {
            let y = bottom - tick.place * area.height();
            canvas.line(&[(right, y), (right + 4.0, y)], 0.8, BLACK)?;
            canvas.text((right + 9.0, y + 0.35 * SMALL), text(&tick.label), SMALL, Align::Left)?;
        }
        draw_note(canvas, (left, top - 6.0), &axis, Align::Left)?;
        let label = shortened(self.label, TEXT, area.height() + 60.0);
        let x = right + 9.0 + self.numbers_width() + 10.0 + 0.8 * TEXT;
        canvas.text_upwards((x, 0.5 * (top + bottom)), &label, TEXT, Align::Centre)
    }
}

fn counted(count: usize, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}

fn text(label: &Label) -> &str {
    match label {
        Label::Text(text) => text,
        // The bar is never logarithmic.
        Label::Power(_) => "",
    }
}
