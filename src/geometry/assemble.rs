//! From parts of cells to particles.
//!
//! A cell of which less than a half is inside is no particle: what it holds goes to a neighbour with more. Particles sit at
//! the centroids, so that their moments are those of the body too.

use super::cut::{CutError, CutLattice};
use super::simplex::{Part, Patch};
use crate::setup::{Face, Particles, Side};
use crate::tensor::{Tensor, Vector, inverse, outer};

/// A cell with less inside is merged, where a neighbour has more.
const PARTICLE: f64 = 0.5;
/// A cell with less inside is no particle in any case.
const LEAST: f64 = 0.1;
/// How far the volume of a whole cell may be off.
const WHOLE: f64 = 1e-9;
/// Relative error with which a surface must close.
const CLOSED: f64 = 1e-11;
/// Part of the volume by which it may be scaled to the exact one.
const SCALED: f64 = 0.05;
/// How far a face may be from a side of the bounding box, cells, and its normal from its direction.
const ON_SIDE: f64 = 1e-3;
const ALONG: f64 = 1.0 - 1e-8;

/// What filling a region came to.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CutReport {
    /// Volume of what the cells hold, m^D.
    pub found: f64,
    /// Volume by a formula or by the triangles, m^D, to which the volumes were scaled.
    pub exact: Option<f64>,
    /// Cells of which a part is inside.
    pub cut: usize,
    /// Of these, cells whose part went to a neighbour.
    pub merged: usize,
    /// Cells without a neighbour that is at least half inside: the region is thinner than the spacing there.
    pub thin: usize,
    /// Whether the boundary has faces: not if it is open or meets itself.
    pub has_faces: bool,
}

/// Makes the particles.
pub(super) fn assemble<const D: usize>(
    lattice: &CutLattice<D>,
    mut parts: Vec<(usize, Part<D>)>,
    exact: Option<f64>,
    is_sound: bool,
) -> Result<(Particles<D>, CutReport), CutError> {
    let mut report = CutReport {
        cut: parts.iter().filter(|(_, part)| (part.volume - 1.0).abs() > WHOLE).count(),
        ..Default::default()
    };
    merge(lattice, &mut parts, &mut report);
    parts.retain(|(_, part)| part.volume > 0.0);
    if parts.is_empty() {
        return Err(CutError::Empty);
    }
    let found: f64 = parts.iter().map(|(_, part)| part.volume).sum();
    let spacing = lattice.spacing();
    let cell = spacing.powi(D as i32);
    report.found = found * cell;
    // An open surface encloses no volume that could be known better.
    report.exact = exact.filter(|_| is_sound);
    let scale = report.exact.map(|exact| exact / report.found).filter(|scale| (scale - 1.0).abs() < SCALED);
    let scale = scale.unwrap_or(1.0);
    let mut particles = Particles {
        positions: parts.iter().map(|(_, part)| lattice.place(&(part.moment / part.volume))).collect(),
        volumes: parts.iter().map(|(_, part)| part.volume * cell * scale).collect(),
        kernel_volumes: vec![cell; parts.len()],
        ..Particles::default()
    };
    let patches = || parts.iter().flat_map(|(_, part)| &part.patches);
    let open: Vector<D> = patches().map(|patch| patch.area).sum();
    let total: f64 = patches().map(|patch| patch.area.norm()).sum();
    if is_sound
        && open.norm() <= CLOSED * total.max(1.0)
        && let Some(place) = consistent(patches(), found * scale)
    {
        report.has_faces = true;
        let area = spacing.powi(D as i32 - 1);
        for (particle, (_, part)) in parts.iter().enumerate() {
            for patch in part.patches.iter().filter(|patch| patch.area.norm() > 0.0) {
                let size = patch.area.norm();
                particles.faces.push(Face {
                    particle,
                    normal: lattice.direction(&(patch.area / size)),
                    area: size * area,
                    point: lattice.place(&place(&patch.point())),
                    side: side(lattice, patch),
                });
            }
        }
    }
    Ok((particles, report))
}

/// Gives small parts to neighbours.
fn merge<const D: usize>(lattice: &CutLattice<D>, parts: &mut [(usize, Part<D>)], report: &mut CutReport) {
    let volumes: Vec<f64> = parts.iter().map(|(_, part)| part.volume).collect();
    let numbers: Vec<usize> = parts.iter().map(|(number, _)| *number).collect();
    let cells = lattice.cells();
    // The fullest neighbour across a side, else across an edge or a corner; the first of equals.
    let fullest = |number: usize, least: f64| {
        let home = lattice.index(number);
        let mut best: Option<(bool, f64, usize)> = None;
        for code in 0..3_usize.pow(D as u32) {
            let step: [isize; D] = std::array::from_fn(|axis| (code / 3_usize.pow(axis as u32) % 3) as isize - 1);
            let mut index = [0; D];
            let is_inside = (0..D).all(|axis| {
                let at = home[axis].wrapping_add_signed(step[axis]);
                index[axis] = at;
                at < cells[axis]
            });
            let across = step.iter().filter(|step| **step != 0).count();
            if !is_inside || across == 0 {
                continue;
            }
            let Ok(other) = numbers.binary_search(&lattice.number(&index)) else { continue };
            let found = (across == 1, volumes[other], other);
            if volumes[other] >= least && best.is_none_or(|best| (found.0, found.1) > (best.0, best.1)) {
                best = Some(found);
            }
        }
        best.map(|(_, _, other)| other)
    };
    let target = |at: usize| {
        let fuller = fullest(numbers[at], PARTICLE);
        if fuller.is_some() || volumes[at] >= LEAST { fuller } else { fullest(numbers[at], LEAST) }
    };
    let small: Vec<usize> = (0..parts.len()).filter(|at| volumes[*at] < PARTICLE).collect();
    let mut targets: Vec<Option<usize>> = small.iter().map(|at| target(*at)).collect();
    // A cell that keeps what it has may have been given to: nothing is passed on twice, as only those with less than
    // `LEAST` go to small ones, and small ones of at least that size stay where no fuller one is near.
    let mut goes = vec![None; parts.len()];
    small.iter().zip(&targets).for_each(|(at, target)| goes[*at] = *target);
    for (at, target) in small.iter().zip(&mut targets) {
        if let Some(other) = target.filter(|_| volumes[*at] < LEAST)
            && goes[other].is_some()
        {
            *target = goes[other];
        }
    }
    for (at, target) in small.into_iter().zip(targets) {
        match target {
            Some(other) => {
                let taken = std::mem::take(&mut parts[at].1);
                parts[other].1.merge(&taken);
                report.merged += 1;
            }
            None if volumes[at] < LEAST => parts[at].1 = Part::default(),
            None => report.thin += 1,
        }
    }
}

/// The linear map of places of faces, about their middle, for which `Σ a N ⊗ X = |Ω| I`: merging pieces with different
/// normals, and scaling the volume, left that a little off.
fn consistent<'a, const D: usize>(
    patches: impl Iterator<Item = &'a Patch<D>> + Clone,
    volume: f64,
) -> Option<impl Fn(&Vector<D>) -> Vector<D>> {
    let count = patches.clone().count();
    let middle = patches.clone().map(Patch::point).sum::<Vector<D>>() / count as f64;
    let enclosed = patches.fold(Tensor::<D>::zeros(), |sum, patch| sum + outer(&patch.area, &(patch.point() - middle)));
    let map = (inverse(&enclosed)? * volume).transpose();
    let is_small = (map - Tensor::identity()).amax() < SCALED;
    is_small.then_some(move |x: &Vector<D>| middle + map * (x - middle))
}

/// The side of the bounding box that a patch lies in.
fn side<const D: usize>(lattice: &CutLattice<D>, patch: &Patch<D>) -> Option<Side> {
    let normal = patch.area.normalize();
    let axis = (0..D).find(|axis| normal[*axis].abs() > ALONG)?;
    let upper = normal[axis] > 0.0;
    let (low, high) = lattice.bounds();
    let end = if upper { high[axis] } else { low[axis] };
    ((patch.point()[axis] - end).abs() < ON_SIDE).then_some(Side { axis, upper })
}
