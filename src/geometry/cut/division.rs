//! What of every cell is inside: those on the surface are divided into simplices.

use rayon::prelude::*;

use super::super::simplex::{Corner, Level, Part, add_simplex, permutations};
use super::{CutLattice, SLACK};
use crate::tensor::Vector;

/// Values below this part of a cell are on the surface.
const ON_SURFACE: f64 = 1e-9;
/// Small cells per cell and direction; for regions whose value is expensive, the last.
const DIVISIONS: [usize; 4] = [16, 16, 4, 2];

impl<const D: usize> CutLattice<D> {
    /// Parts of the cells inside, in the order of their numbers.
    pub(super) fn divide(&self) -> Vec<(usize, Part<D>)> {
        let divisions = DIVISIONS[if self.is_costly { 3 } else { D - 1 }];
        let rows = self.cells[1..].iter().product::<usize>();
        let row = |row: usize| {
            let cells = (row * self.cells[0]..(row + 1) * self.cells[0]).filter_map(|number| {
                let part = self.part(&self.index(number), divisions);
                (part.volume > 0.0).then_some((number, part))
            });
            cells.collect::<Vec<_>>()
        };
        (0..rows).into_par_iter().map(row).collect::<Vec<_>>().concat()
    }

    /// What is inside of a cell.
    fn part(&self, index: &[usize; D], divisions: usize) -> Part<D> {
        let lower = Vector::<D>::from_fn(|axis, _| index[axis] as f64);
        let centre = self.raw(&lower.add_scalar(0.5));
        let reach = 0.5 * (D as f64).sqrt() * (1.0 + SLACK);
        if centre >= reach {
            return Part::default();
        }
        if centre <= -reach {
            return Part::whole(&lower);
        }
        let side = divisions + 1;
        let offset = |mut code: usize, base: usize| -> [usize; D] {
            std::array::from_fn(|_| {
                let digit = code % base;
                code /= base;
                digit
            })
        };
        let samples: Vec<Corner<D>> = (0..side.pow(D as u32))
            .map(|code| {
                let at = offset(code, side);
                // A point that cells share has the same bits in all of them.
                let x = Vector::from_fn(|axis, _| index[axis] as f64 + at[axis] as f64 / divisions as f64);
                Corner { x, value: self.value(&x) }
            })
            .collect();
        if samples.iter().all(|sample| sample.value < 0.0) {
            return Part::whole(&lower);
        }
        let mut part = Part::default();
        let orders = permutations::<D>();
        for code in 0..divisions.pow(D as u32) {
            let first = offset(code, divisions);
            for order in orders {
                let mut at = first;
                let mut corners = [Corner { x: lower, value: 0.0 }; 4];
                for (step, corner) in corners.iter_mut().enumerate().take(D + 1) {
                    if step > 0 {
                        at[order[step - 1]] += 1;
                    }
                    *corner = samples[(0..D).rev().fold(0, |number, axis| number * side + at[axis])];
                }
                add_simplex(&mut part, &corners[..=D], self);
            }
        }
        part
    }

    /// The value at a place in cells, in cells.
    fn raw(&self, cells: &Vector<D>) -> f64 {
        self.region.value(&self.place(cells)) / self.spacing
    }
}

impl<const D: usize> Level<D> for CutLattice<D> {
    /// Where the surface crosses an edge between a point inside and one that is not (Illinois method).
    fn crossing(&self, a: &Corner<D>, b: &Corner<D>) -> Vector<D> {
        let (mut low, mut high) = ((0.0, a.value), (1.0, b.value));
        let at = |t: f64| a.x + (b.x - a.x) * t;
        if a.value == 0.0 {
            return a.x;
        }
        if b.value == 0.0 {
            return b.x;
        }
        if self.is_costly {
            // A distance, which is linear but for the curvature.
            return at(a.value / (a.value - b.value));
        }
        let mut t = 0.5;
        for _ in 0..40 {
            t = (low.0 * high.1 - high.0 * low.1) / (high.1 - low.1);
            let value = self.raw(&at(t));
            if value.abs() <= 1e-3 * ON_SURFACE || high.0 - low.0 < ON_SURFACE {
                break;
            }
            if (value < 0.0) == (low.1 < 0.0) {
                low = (t, value);
                high.1 /= 2.0;
            } else {
                high = (t, value);
                low.1 /= 2.0;
            }
        }
        at(t)
    }

    fn value(&self, cells: &Vector<D>) -> f64 {
        let value = self.raw(cells);
        if value.abs() > ON_SURFACE { value } else { 0.0 }
    }
}
