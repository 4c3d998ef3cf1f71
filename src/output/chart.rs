//! The frame of a diagram: title, axes with grid, ticks and labels.

use plotters::backend::DrawingBackend;

use super::axis::{Axis, Label};
use super::canvas::{Align, BLACK, Canvas, Drawn, GREY, PALE, Point, shortened, text_width};

/// Size of axis labels and legends in points.
pub(super) const TEXT: f64 = 13.0;
/// Size of tick labels.
const SMALL: f64 = 12.0;
/// Size of titles.
const TITLE: f64 = 15.0;
/// Length of a tick.
const TICK: f64 = 5.0;
/// Share of a text's size by which its baseline lies below its middle.
const HALF_CAPITAL: f64 = 0.35;

/// A rectangle in points, y downwards.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Area {
    pub(super) left: f64,
    pub(super) top: f64,
    pub(super) right: f64,
    pub(super) bottom: f64,
}

impl Area {
    pub(super) fn width(&self) -> f64 {
        self.right - self.left
    }

    pub(super) fn height(&self) -> f64 {
        self.bottom - self.top
    }
}

/// Two axes and what is written around them.
#[derive(Debug, Clone)]
pub(super) struct Chart<'a> {
    pub(super) title: &'a str,
    pub(super) x_label: &'a str,
    pub(super) y_label: &'a str,
    pub(super) x: Axis,
    pub(super) y: Axis,
    pub(super) area: Area,
}

impl Chart<'_> {
    /// Room to the left of the plotting area that the y axis needs.
    pub(super) fn room_left(y: &Axis) -> f64 {
        let widest = y.ticks.iter().map(|tick| label_width(&tick.label)).fold(0.0, f64::max);
        14.0 + TEXT + 8.0 + widest + TICK + 4.0
    }

    /// Room above the plotting area for the title and the factor of the y axis.
    pub(super) fn room_above(title: &str, y: &Axis) -> f64 {
        let factor = if has_note(y) { SMALL + 6.0 } else { 0.0 };
        let title = if title.is_empty() { 8.0 } else { TITLE + 14.0 };
        8.0 + title + factor
    }

    /// Room below the plotting area for tick labels and the label of the x axis.
    pub(super) fn room_below() -> f64 {
        TICK + SMALL + 10.0 + TEXT + 12.0
    }

    /// Where a pair of values lies; `None` if it has no place.
    pub(super) fn place(&self, (x, y): (f64, f64)) -> Option<Point> {
        let (x, y) = (self.x.place(x)?, self.y.place(y)?);
        Some((self.area.left + x * self.area.width(), self.area.bottom - y * self.area.height()))
    }

    /// Says in the middle of the plotting area why it is empty.
    pub(super) fn say_no_data<B: DrawingBackend>(&self, canvas: &mut Canvas<'_, B>) -> Drawn {
        let Area { left, top, right, bottom } = self.area;
        canvas.text((0.5 * (left + right), 0.5 * (top + bottom)), "no data", TITLE, Align::Centre)
    }

    /// Draws everything but the data. `width` is the width of the whole drawing.
    pub(super) fn draw<B: DrawingBackend>(&self, canvas: &mut Canvas<'_, B>, width: f64, grid: bool) -> Drawn {
        let Area { left, top, right, bottom } = self.area;
        draw_title(canvas, self.title, width)?;
        for tick in &self.x.ticks {
            let x = left + tick.place * self.area.width();
            if grid {
                canvas.line(&[(x, top), (x, bottom)], 0.8, PALE)?;
            }
            canvas.line(&[(x, bottom), (x, bottom + TICK)], 1.0, BLACK)?;
            draw_label(canvas, (x, bottom + TICK + SMALL + 1.0), &tick.label, Align::Centre)?;
        }
        for tick in &self.y.ticks {
            let y = bottom - tick.place * self.area.height();
            if grid {
                canvas.line(&[(left, y), (right, y)], 0.8, PALE)?;
            }
            canvas.line(&[(left - TICK, y), (left, y)], 1.0, BLACK)?;
            draw_label(canvas, (left - TICK - 4.0, y + HALF_CAPITAL * SMALL), &tick.label, Align::Right)?;
        }
        for place in &self.x.minor {
            let x = left + place * self.area.width();
            canvas.line(&[(x, bottom), (x, bottom + 0.6 * TICK)], 0.8, GREY)?;
        }
        for place in &self.y.minor {
            let y = bottom - place * self.area.height();
            canvas.line(&[(left - 0.6 * TICK, y), (left, y)], 0.8, GREY)?;
        }
        canvas.line(&[(left, top), (right, top), (right, bottom), (left, bottom), (left, top)], 1.0, BLACK)?;

        let baseline = bottom + TICK + SMALL + 10.0 + TEXT;
        let label = shortened(self.x_label, TEXT, self.area.width() - 2.0 * note_width(&self.x));
        canvas.text((0.5 * (left + right), baseline), &label, TEXT, Align::Centre)?;
        draw_note(canvas, (right, baseline), &self.x, Align::Right)?;
        let label = shortened(self.y_label, TEXT, self.area.height() + 40.0);
        canvas.text_upwards((14.0 + TEXT * 0.8, 0.5 * (top + bottom)), &label, TEXT, Align::Centre)?;
        draw_note(canvas, (left, top - 6.0), &self.y, Align::Left)
    }
}

/// A title in the middle above everything.
pub(super) fn draw_title<B: DrawingBackend>(canvas: &mut Canvas<'_, B>, title: &str, width: f64) -> Drawn {
    let title = shortened(title, TITLE, width - 20.0);
    canvas.text((0.5 * width, 8.0 + TITLE), &title, TITLE, Align::Centre)
}

fn label_width(label: &Label) -> f64 {
    match label {
        Label::Text(text) => text_width(text, SMALL),
        Label::Power(power) => text_width("10", SMALL) + power_width(*power),
    }
}

fn power_text(power: i32) -> String {
    power.to_string().replace('-', "−")
}

fn power_width(power: i32) -> f64 {
    text_width(&power_text(power), 0.75 * SMALL) + 1.0
}

/// A tick label with its baseline at `at`, horizontally centred or to the left of it.
fn draw_label<B: DrawingBackend>(canvas: &mut Canvas<'_, B>, at: Point, label: &Label, align: Align) -> Drawn {
    match label {
        Label::Text(text) => canvas.text(at, text, SMALL, align),
        Label::Power(power) => {
            // The join of base and exponent is fixed, so it does not matter which font the viewer has.
            let exponent = power_width(*power);
            let join = match align {
                Align::Centre => at.0 + 0.5 * (text_width("10", SMALL) - exponent),
                _ => at.0 - exponent,
            };
            draw_power(canvas, (join, at.1), "10", *power)
        }
    }
}

/// `base` to the left of `at`, raised to a power to the right of it.
fn draw_power<B: DrawingBackend>(canvas: &mut Canvas<'_, B>, at: Point, base: &str, power: i32) -> Drawn {
    canvas.text(at, base, SMALL, Align::Right)?;
    canvas.text((at.0 + 1.0, at.1 - 0.4 * SMALL), &power_text(power), 0.75 * SMALL, Align::Left)
}

fn has_note(axis: &Axis) -> bool {
    axis.exponent != 0 || axis.reference.is_some()
}

fn reference_text(axis: &Axis) -> String {
    let reference = axis.reference.as_deref().unwrap_or_default();
    match reference.strip_prefix('−') {
        _ if reference.is_empty() => String::new(),
        Some(digits) => format!("− {digits}"),
        None => format!("+ {reference}"),
    }
}

fn note_width(axis: &Axis) -> f64 {
    let factor = if axis.exponent == 0 { 0.0 } else { text_width("×10", SMALL) + power_width(axis.exponent) + 4.0 };
    factor + text_width(&reference_text(axis), SMALL) + 6.0
}

/// What the labels of an axis are to be multiplied by, and what is to be added.
pub(super) fn draw_note<B: DrawingBackend>(canvas: &mut Canvas<'_, B>, at: Point, axis: &Axis, align: Align) -> Drawn {
    if !has_note(axis) {
        return Ok(());
    }
    let mut x = if align == Align::Right { at.0 - note_width(axis) } else { at.0 };
    if axis.exponent != 0 {
        x += text_width("×10", SMALL);
        draw_power(canvas, (x, at.1), "×10", axis.exponent)?;
        x += power_width(axis.exponent) + 4.0;
    }
    canvas.text((x, at.1), &reference_text(axis), SMALL, Align::Left)
}
