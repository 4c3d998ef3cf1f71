//! Tables as pictures: cells with a text each, coloured by how good the outcome is.

use std::path::{Path, PathBuf};

use plotters::backend::DrawingBackend;
use plotters::style::RGBColor;

use super::OutputError;
use super::canvas::{Align, BLACK, Canvas, Drawing, Drawn, PALE, shortened, text_width, write_both};
use super::chart::{TEXT, draw_title};

/// Width and height of a cell in points.
const CELL: (f64, f64) = (47.0, 25.0);
/// Size of the text in cells and of the labels.
const SMALL: f64 = 12.0;
/// Room above the first panel, above the cells of each, and below them.
const TOP: f64 = 34.0;
const HEAD: f64 = 26.0;
const FOOT: f64 = 42.0;
/// Room between panels and around them.
const GAP: f64 = 18.0;
/// Height of the legend, and width of its bars.
const LEGEND: f64 = 40.0;
const BAR: f64 = 90.0;
const STRIPES: usize = 30;
/// Share of a text's size by which its baseline lies below its middle.
const HALF_CAPITAL: f64 = 0.35;

/// From a good outcome that is only just one to a perfect one: pale yellow to blue.
const GOOD: [[f64; 3]; 2] = [[253.0, 240.0, 192.0], [127.0, 184.0, 230.0]];
/// From a bad outcome that was nearly good to the worst: pale orange to vermilion.
const BAD: [[f64; 3]; 2] = [[249.0, 201.0, 168.0], [224.0, 106.0, 80.0]];

/// How good an outcome is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Tone {
    /// Good; from 0, only just, to 1, perfect.
    Good(f64),
    /// Bad; from 0, nearly good, to 1, as bad as can be.
    Bad(f64),
}

impl Tone {
    fn colour(self) -> RGBColor {
        let ([from, to], at) = match self {
            Self::Good(quality) => (GOOD, quality),
            Self::Bad(badness) => (BAD, badness),
        };
        // What is no number has the colour of 0.
        let at = at.clamp(0.0, 1.0).max(0.0);
        let mix = |i: usize| (from[i] + at * (to[i] - from[i])).round() as u8;
        RGBColor(mix(0), mix(1), mix(2))
    }
}

/// A cell of a [`Panel`].
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    /// Written into it; shortened if it is too long.
    pub text: String,
    /// Its colour.
    pub tone: Tone,
}

/// One table of [`Panels`].
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Panel {
    /// Written above it.
    pub title: String,
    /// Its rows of cells; a `None`, or one that is missing, stays empty.
    pub cells: Vec<Vec<Option<Cell>>>,
}

/// Tables with the same rows and columns, two side by side, with one legend.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Panels {
    /// Written above everything.
    pub title: String,
    /// Names of the rows.
    pub rows: Vec<String>,
    /// Names of the columns.
    pub columns: Vec<String>,
    /// What the columns are.
    pub columns_label: String,
    /// What the cells of a good outcome say.
    pub good: String,
    /// What the cells of a bad outcome say.
    pub bad: String,
    /// The tables, from the left to the right and from the top to the bottom.
    pub panels: Vec<Panel>,
}

impl Panels {
    /// Writes `PATH.svg` and `PATH.png` as wholes and returns both paths. The same data give the same bytes.
    ///
    /// # Errors
    /// [`OutputError::File`] if the disk refuses.
    pub fn write(&self, path_without_extension: &Path) -> Result<[PathBuf; 2], OutputError> {
        write_both(self, path_without_extension)
    }

    /// Width of the names of the rows.
    fn names(&self) -> f64 {
        self.rows.iter().map(|row| text_width(row, SMALL)).fold(60.0, f64::max) + 8.0
    }

    fn panel_size(&self) -> (f64, f64) {
        (CELL.0 * self.columns.len() as f64, CELL.1 * self.rows.len() as f64)
    }

    fn panel<B: DrawingBackend>(&self, canvas: &mut Canvas<'_, B>, panel: &Panel, left: f64, top: f64) -> Drawn {
        let (width, height) = self.panel_size();
        canvas.text((left, top - 8.0), &shortened(&panel.title, TEXT, width), TEXT, Align::Left)?;
        for (row, cells) in panel.cells.iter().take(self.rows.len()).enumerate() {
            for (column, cell) in cells.iter().take(self.columns.len()).enumerate() {
                let Some(cell) = cell else { continue };
                let corner = (left + CELL.0 * column as f64, top + CELL.1 * row as f64);
                canvas.rectangle(corner, (corner.0 + CELL.0, corner.1 + CELL.1), cell.tone.colour())?;
                let middle = (corner.0 + 0.5 * CELL.0, corner.1 + 0.5 * CELL.1 + HALF_CAPITAL * SMALL);
                canvas.text(middle, &shortened(&cell.text, SMALL, 1.1 * CELL.0), SMALL, Align::Centre)?;
            }
        }
        for row in 0..=self.rows.len() {
            let y = top + CELL.1 * row as f64;
            canvas.line(&[(left, y), (left + width, y)], 0.8, PALE)?;
        }
        for column in 0..=self.columns.len() {
            let x = left + CELL.0 * column as f64;
            canvas.line(&[(x, top), (x, top + height)], 0.8, PALE)?;
        }
        for (column, name) in self.columns.iter().enumerate() {
            let at = (left + CELL.0 * (column as f64 + 0.5), top + height + SMALL + 3.0);
            canvas.text(at, &shortened(name, SMALL, CELL.0), SMALL, Align::Centre)?;
        }
        let label = shortened(&self.columns_label, SMALL, width);
        canvas.text((left + 0.5 * width, top + height + 2.0 * SMALL + 8.0), &label, SMALL, Align::Centre)
    }

    /// A bar of one kind of colours with what it stands for; returns where it ends.
    fn bar<B: DrawingBackend>(
        canvas: &mut Canvas<'_, B>,
        (left, top): (f64, f64),
        label: &str,
        tone: fn(f64) -> Tone,
    ) -> Result<f64, String> {
        let width = BAR / STRIPES as f64;
        for stripe in 0..STRIPES {
            let x = left + width * stripe as f64;
            // Each stripe reaches into the next, or anti-aliasing would show seams.
            let right = (x + 2.0 * width).min(left + BAR);
            canvas.rectangle((x, top), (right, top + 12.0), tone((stripe as f64 + 0.5) / STRIPES as f64).colour())?;
        }
        let corners = [(left, top), (left + BAR, top), (left + BAR, top + 12.0), (left, top + 12.0), (left, top)];
        canvas.line(&corners, 0.6, BLACK)?;
        canvas.text((left + BAR + 8.0, top + 10.5), label, SMALL, Align::Left)?;
        Ok(left + BAR + 8.0 + text_width(label, SMALL) + 24.0)
    }
}

impl Drawing for Panels {
    fn size(&self) -> (f64, f64) {
        let (width, height) = self.panel_size();
        let across = self.panels.len().clamp(1, 2) as f64;
        let down = self.panels.len().div_ceil(2) as f64;
        (GAP + self.names() + across * (width + GAP), TOP + down * (HEAD + height + FOOT) + LEGEND)
    }

    fn draw<B: DrawingBackend>(&self, canvas: &mut Canvas<'_, B>) -> Drawn {
        let (page, bottom) = self.size();
        let (width, height) = self.panel_size();
        draw_title(canvas, &self.title, page)?;
        let first = GAP + self.names();
        for (index, panel) in self.panels.iter().enumerate() {
            let top = TOP + HEAD + (index / 2) as f64 * (HEAD + height + FOOT);
            if index % 2 == 0 {
                for (row, name) in self.rows.iter().enumerate() {
                    let y = top + CELL.1 * (row as f64 + 0.5) + HALF_CAPITAL * SMALL;
                    canvas.text((first - 8.0, y), name, SMALL, Align::Right)?;
                }
            }
            self.panel(canvas, panel, first + (index % 2) as f64 * (width + GAP), top)?;
        }
        let next = Self::bar(canvas, (first, bottom - LEGEND + 12.0), &self.good, Tone::Good)?;
        Self::bar(canvas, (next, bottom - LEGEND + 12.0), &self.bad, Tone::Bad).map(|_| ())
    }
}
