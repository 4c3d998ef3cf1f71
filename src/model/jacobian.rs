//! Checks of the analytic Jacobian: Taylor remainders (document 004, (6.24)–(6.26) and Table 6.1) and
//! a coloured comparison with differences that names the worst entry.
//!
//! Public, so that who adds a term or a law can check it the same way.

use nicolson_solvers::EvaluationError;
use nicolson_solvers::nonlinear::NonlinearProblem;
use nicolson_solvers::time::{ConservingSystem, StageSystem};
use nicolson_solvers::vector;

use super::{Model, Terms, Unknowns};
use crate::setup::InterfaceChoice;

/// One line of a Taylor table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TaylorRow {
    /// Perturbation ε.
    pub epsilon: f64,
    /// `‖R(y + εδ) − R(y) − ε J δ‖`.
    pub remainder: f64,
    /// `remainder / ε²`: constant for an exact Jacobian.
    pub ratio: f64,
}

/// Taylor table of one residual block.
#[derive(Debug, Clone, PartialEq)]
pub struct BlockTaylor {
    /// `v`, `J` or `u`.
    pub block: &'static str,
    /// One line per ε.
    pub rows: Vec<TaylorRow>,
    /// `‖J δ‖` of the block.
    pub first_order: f64,
    /// Size of rounding noise in the remainder: a block that is linear in the unknowns stays there.
    pub noise: f64,
}

impl BlockTaylor {
    /// Whether the block is linear: every remainder is rounding noise.
    pub fn is_linear(&self) -> bool {
        self.rows.iter().all(|row| row.remainder <= self.noise)
    }

    /// Largest deviation of the ratio from its value at the first ε, relative, over the lines whose
    /// remainder stands clear of rounding noise by `clearance`.
    pub fn deviation(&self, clearance: f64) -> f64 {
        let Some(first) = self.rows.first() else { return 0.0 };
        self.rows
            .iter()
            .filter(|row| row.remainder > clearance * self.noise)
            .map(|row| (row.ratio / first.ratio - 1.0).abs())
            .fold(0.0, f64::max)
    }
}

/// Taylor tables of one selection of terms.
#[derive(Debug, Clone, PartialEq)]
pub struct TaylorReport {
    /// `all`, or the single term that was switched on.
    pub term: &'static str,
    /// One table per residual block.
    pub blocks: Vec<BlockTaylor>,
}

/// An entry of the Jacobian where the analytic value and the difference disagree most.
#[derive(Debug, Clone, PartialEq)]
pub struct WorstEntry {
    /// Row and column.
    pub position: (usize, usize),
    /// Equation and unknown, in words.
    pub names: (String, String),
    /// Analytic value.
    pub analytic: f64,
    /// Central difference.
    pub difference: f64,
}

/// Comparison of all entries with central differences.
#[derive(Debug, Clone, PartialEq)]
pub struct DifferenceReport {
    /// Largest `|analytic − difference|`, relative to the largest entry of its row.
    pub largest_error: f64,
    /// Where it is.
    pub worst: Option<WorstEntry>,
    /// Entries compared.
    pub entries: usize,
    /// Largest difference quotient outside the pattern, relative to the largest entry of its row: a
    /// coupling that the pattern misses.
    pub outside_pattern: f64,
    /// Residual evaluations spent.
    pub evaluations: usize,
}

/// A stage and a point at which to check.
#[derive(Debug, Clone)]
pub struct CheckPoint {
    /// Time of the stage, s.
    pub time: f64,
    /// Shift s of the stage, s.
    pub shift: f64,
    /// Base `ũ`, or the start of a conserving step.
    pub base: Vec<f64>,
    /// Unknowns.
    pub unknowns: Vec<f64>,
    /// Whether this is a conserving step (of length `2 shift`) instead of an implicit stage.
    pub conserving: bool,
}

/// Numbers in (−1, 1) from a seed: the same on every machine.
pub struct Noise(u64);

impl Noise {
    /// A sequence that depends on the seed alone.
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0xD1B5_4A32_D192_ED03)
    }

    /// The next number (splitmix64).
    #[expect(clippy::should_implement_trait, reason = "an iterator would have to promise an end that never comes")]
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^= z >> 31;
        (z >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

impl<const D: usize> Model<D> {
    /// A point in general position near a state: displacements shaken by `amount` spacings,
    /// velocities by `amount` spacings per shift, volume ratios by `amount`, so that every term of
    /// the Jacobian is at work.
    ///
    /// # Errors
    /// If even the shaken state is outside the domain of the law.
    pub fn check_point(
        &mut self,
        time: f64,
        shift: f64,
        state: &[f64],
        amount: f64,
        seed: u64,
    ) -> Result<CheckPoint, EvaluationError> {
        let mut noise = Noise::new(seed);
        let n = self.particles();
        let length = amount * self.smallest_distance();
        let mut base = state.to_vec();
        for (i, value) in base.iter_mut().enumerate() {
            *value += noise.next()
                * if i < n * D {
                    length
                } else if i < 2 * n * D {
                    length / shift
                } else {
                    amount
                };
        }
        self.begin_stage(time, shift, &base);
        let base = self.stage.base.clone();
        let mut unknowns = vec![0.0; NonlinearProblem::unknowns(self)];
        self.start_from(&base, &mut unknowns);
        for value in &mut unknowns {
            *value += noise.next() * length / shift;
        }
        let at = CheckPoint { time, shift, base, unknowns, conserving: false };
        self.pose(&at);
        self.residual(&at.unknowns, &mut vec![0.0; at.unknowns.len()])?;
        Ok(at)
    }

    /// Size of variations within which the residual is close to its Taylor polynomial, relative to that of the laws
    /// alone: the limiter of the upwinding curves within the jumps of a pair, and some of these are small anywhere.
    pub fn taylor_scale(&self) -> f64 {
        let limited = self.upwind.as_ref().is_some_and(|u| u.options.interface == InterfaceChoice::Limited);
        if limited { 1e-2 } else { 1.0 }
    }

    /// Poses the problem of a check point.
    fn pose(&mut self, at: &CheckPoint) {
        if at.conserving {
            self.begin_conserving(at.time, 2.0 * at.shift, &at.base);
        } else {
            self.begin_stage(at.time, at.shift, &at.base);
        }
    }

    /// Block of an unknown.
    fn block_of(&self, unknown: usize) -> &'static str {
        let name = self.unknowns.describe(unknown);
        match name.as_bytes().first() {
            Some(b'v') if name.starts_with("velocity") => "v",
            Some(b'd') => "u",
            _ => "J",
        }
    }

    /// Taylor remainders per residual block at a point, in a random direction, for the selected terms.
    ///
    /// # Errors
    /// If a perturbed point is outside the domain of the law.
    pub fn taylor(
        &mut self,
        at: &CheckPoint,
        (term, terms): (&'static str, Terms),
        epsilons: &[f64],
        seed: u64,
    ) -> Result<TaylorReport, EvaluationError> {
        let kept = (self.terms, self.linear);
        self.select_terms(terms);
        self.pose(at);
        let outcome = self.taylor_selected(at, term, epsilons, seed);
        (self.terms, self.linear) = kept;
        self.stage.evaluated.clear();
        self.forget_linearisation();
        outcome
    }

    fn taylor_selected(
        &mut self,
        at: &CheckPoint,
        term: &'static str,
        epsilons: &[f64],
        seed: u64,
    ) -> Result<TaylorReport, EvaluationError> {
        let size = at.unknowns.len();
        let mut noise = Noise::new(seed);
        // A direction that strains the lattice by a tenth at ε = 1.
        let amplitude = 0.1 * self.smallest_distance() / at.shift;
        let direction: Vec<f64> = (0..size).map(|_| noise.next() * amplitude).collect();
        let (mut start, mut trial, mut first) = (vec![0.0; size], vec![0.0; size], vec![0.0; size]);
        let scale = self.residual(&at.unknowns, &mut start)?;
        self.linearise(&at.unknowns)?;
        self.tangent().apply(&direction, &mut first);
        let blocks: Vec<&'static str> = (0..size).map(|i| self.block_of(i)).collect();
        let mut report: Vec<BlockTaylor> = ["v", "J", "u"]
            .into_iter()
            .filter(|block| blocks.contains(block))
            .map(|block| {
                let part: Vec<f64> =
                    blocks.iter().zip(&first).filter(|(b, _)| **b == block).map(|(_, value)| *value).collect();
                BlockTaylor {
                    block,
                    rows: Vec::new(),
                    first_order: vector::norm(&part),
                    noise: 1e-14 * (scale + vector::norm(&start)),
                }
            })
            .collect();
        for &epsilon in epsilons {
            let point: Vec<f64> = at.unknowns.iter().zip(&direction).map(|(y, d)| y + epsilon * d).collect();
            self.residual(&point, &mut trial)?;
            for table in &mut report {
                let remainder: f64 = (0..size)
                    .filter(|&i| blocks[i] == table.block)
                    .map(|i| (trial[i] - start[i] - epsilon * first[i]).powi(2))
                    .sum::<f64>()
                    .sqrt();
                table.rows.push(TaylorRow { epsilon, remainder, ratio: remainder / (epsilon * epsilon) });
            }
        }
        Ok(TaylorReport { term, blocks: report })
    }

    /// The selections of terms that make sense for this model: all together, then each by itself.
    pub fn term_selections(&self) -> Vec<(&'static str, Terms)> {
        let mut list = vec![("all", Terms::ALL), ("stress", Terms { stress: true, volume_rate: true, ..Terms::NONE })];
        if self.unknowns() != Unknowns::Velocity {
            list.push(("volume rate", Terms { volume_rate: true, ..Terms::NONE }));
        }
        if let Some(upwind) = self.upwind() {
            if upwind.has_velocity() {
                list.push(("D_v", Terms { velocity_upwind: true, ..Terms::NONE }));
            }
            if upwind.has_pressure() {
                list.push(("D_p", Terms { pressure_upwind: true, ..Terms::NONE }));
            }
        }
        if self.hourglass().is_some() {
            list.push(("hourglass", Terms { hourglass: true, ..Terms::NONE }));
        }
        list
    }

    /// Compares every assembled entry with a central difference of the residual. Columns that share
    /// no row are perturbed together, so the number of evaluations does not grow with the cloud.
    ///
    /// # Errors
    /// If a perturbed point is outside the domain of the law.
    pub fn compare_with_differences(&mut self, at: &CheckPoint) -> Result<DifferenceReport, EvaluationError> {
        let size = at.unknowns.len();
        self.pose(at);
        self.linearise(&at.unknowns)?;
        let matrix = self.tangent_matrix();
        let rings: Vec<Vec<u32>> = (0..self.particles()).map(|a| self.gradient.neighbourhood.two_ring(a)).collect();
        let colours = colour(&rings);
        let per_particle = (0..self.particles()).map(|a| self.unknowns.of(a).len()).max().unwrap_or(0);
        let largest = self.row_maxima(&matrix, size);
        // Third root of rounding, in units of the strain that a unit of the unknowns causes.
        let step = 6e-6 * self.taylor_scale().sqrt() * self.smallest_distance() / at.shift;
        let mut report =
            DifferenceReport { largest_error: 0.0, worst: None, entries: 0, outside_pattern: 0.0, evaluations: 0 };
        let (mut plus, mut minus) = (vec![0.0; size], vec![0.0; size]);
        for group in &colours {
            for field in 0..per_particle {
                let columns: Vec<usize> = group.iter().filter_map(|&e| self.unknowns.of(e).nth(field)).collect();
                if columns.is_empty() {
                    continue;
                }
                let mut point = at.unknowns.clone();
                columns.iter().for_each(|&c| point[c] += step);
                self.residual(&point, &mut plus)?;
                columns.iter().for_each(|&c| point[c] = at.unknowns[c] - step);
                self.residual(&point, &mut minus)?;
                report.evaluations += 2;
                // The column that may touch a row is the one whose particle has the row in its ring.
                let mut owner = vec![usize::MAX; self.particles()];
                for &c in &columns {
                    for &row in &rings[self.unknowns.particle_of(c)] {
                        owner[row as usize] = c;
                    }
                }
                for row in 0..size {
                    let difference = (plus[row] - minus[row]) / (2.0 * step);
                    let column = owner[self.unknowns.particle_of(row)];
                    if column == usize::MAX {
                        report.outside_pattern = report.outside_pattern.max(difference.abs() / largest[row]);
                        continue;
                    }
                    report.entries += 1;
                    let analytic = matrix.get(row, column);
                    let error = (analytic - difference).abs() / largest[row];
                    if error > report.largest_error || report.worst.is_none() {
                        report.largest_error = error;
                        report.worst = Some(WorstEntry {
                            position: (row, column),
                            names: (self.describe(row), self.describe(column)),
                            analytic,
                            difference,
                        });
                    }
                }
            }
        }
        Ok(report)
    }

    fn row_maxima(&self, matrix: &nicolson_solvers::linear::SparseMatrix, size: usize) -> Vec<f64> {
        let pattern = self.slots().pattern();
        let offsets = pattern.offsets();
        (0..size)
            .map(|row| {
                let values = &matrix.values()[offsets[row]..offsets[row + 1]];
                values.iter().fold(f64::MIN_POSITIVE, |m, v| m.max(v.abs()))
            })
            .collect()
    }
}

/// Groups of particles whose two-rings do not overlap.
fn colour(rings: &[Vec<u32>]) -> Vec<Vec<usize>> {
    let mut groups: Vec<(Vec<usize>, Vec<bool>)> = Vec::new();
    for (e, ring) in rings.iter().enumerate() {
        let fitting = groups.iter_mut().find(|(_, taken)| ring.iter().all(|&row| !taken[row as usize]));
        let (members, taken) = match fitting {
            Some(group) => group,
            None => {
                groups.push((Vec::new(), vec![false; rings.len()]));
                match groups.last_mut() {
                    Some(group) => group,
                    None => continue,
                }
            }
        };
        members.push(e);
        for &row in ring {
            taken[row as usize] = true;
        }
    }
    groups.into_iter().map(|(members, _)| members).collect()
}
