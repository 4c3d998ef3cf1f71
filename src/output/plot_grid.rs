//! Line plots side by side.

use std::path::{Path, PathBuf};

use plotters::backend::DrawingBackend;

use super::OutputError;
use super::canvas::{Canvas, Drawing, Drawn, Point, write_both};
use super::legend::Legend;
use super::plot::{LinePlot, SIZE};

/// Where the legend of several diagrams begins in its place.
const LEGEND_CORNER: Point = (80.0, 30.0);

/// Diagrams side by side, row after row. Where all have the same series, one legend after the last serves them all.
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

    /// The legend of all diagrams together, if there is such a thing.
    fn shared_legend(&self) -> Option<Legend> {
        let series =
            |plot: &'_ LinePlot| plot.looks().map(|(series, look)| (series.name.clone(), look)).collect::<Vec<_>>();
        let (first, others) = self.plots.split_first()?;
        let same = !others.is_empty() && others.iter().all(|plot| series(plot) == series(first));
        same.then(|| first.legend(SIZE.1))
    }

    /// Upper left corner of the place for a diagram.
    fn corner(&self, index: usize) -> Point {
        let columns = self.columns();
        (SIZE.0 * (index % columns) as f64, SIZE.1 * (index / columns) as f64)
    }
}

impl Drawing for PlotGrid {
    fn size(&self) -> (f64, f64) {
        let columns = self.columns();
        let places = self.plots.len() + usize::from(self.shared_legend().is_some());
        (SIZE.0 * columns as f64, SIZE.1 * places.div_ceil(columns).max(1) as f64)
    }

    fn draw<B: DrawingBackend>(&self, canvas: &mut Canvas<'_, B>) -> Drawn {
        let legend = self.shared_legend();
        for (index, plot) in self.plots.iter().enumerate() {
            canvas.count_from(self.corner(index));
            plot.draw_with(canvas, legend.is_none())?;
        }
        let Some(legend) = legend else { return Ok(()) };
        canvas.count_from(self.corner(self.plots.len()));
        legend.draw(canvas, LEGEND_CORNER, false)
    }
}
