//! The shapes of `[[body]]`.

mod plan;

use std::collections::BTreeMap;

pub(super) use plan::plan;

use super::regions::Cut;
use crate::expression::Expression;
use crate::geometry::{BoxLattice, Group, MapError, MappedLattice, RingLattice};
use crate::model::Noise;
use crate::scene::checks::{padded, place};
use crate::scene::findings::{Findings, Span};
use crate::setup::{GeometryRecord, Particles};
use crate::tensor::Vector;

/// A body before its corners are placed: that must wait until the number of particles is known to be bearable.
pub(super) enum Plan<const D: usize> {
    /// A lattice in a box.
    Lattice(BoxLattice<D>),
    /// A bent or perturbed lattice.
    Mapped(Mapping<D>),
    /// Rings, with the amount of a perturbation in spacings, and its seed.
    Ring(RingLattice, (f64, u64)),
    /// A lattice that a region cuts out of.
    Cut(Box<Cut<D>>),
    /// Particles from a file.
    Filled(Box<Filled<D>>),
}

/// What bends and shakes a lattice.
pub(super) struct Mapping<const D: usize> {
    lattice: BoxLattice<D>,
    map: Option<[Expression; D]>,
    /// Amount in spacings, and seed.
    perturbation: Option<(f64, u64)>,
    /// Place of the shape in the scene.
    span: Span,
}

/// A body that is ready to be filled.
pub(super) enum Shape<const D: usize> {
    /// A lattice in a box.
    Lattice(BoxLattice<D>),
    /// A bent lattice, and whether it still fills its box.
    Mapped(MappedLattice<D>, bool),
    /// Rings, with amount and seed of a perturbation.
    Ring(RingLattice, (f64, u64)),
    /// Particles that are there already.
    Filled(Box<Filled<D>>),
}

/// Particles as they are, with what is known of them.
pub(super) struct Filled<const D: usize> {
    pub particles: Particles<D>,
    /// Distance of neighbours, m.
    pub spacing: f64,
    /// Groups that a file names.
    pub groups: BTreeMap<String, Group>,
    /// What filling came to; its body and mass are not yet known.
    pub record: Option<GeometryRecord>,
}

impl<const D: usize> Plan<D> {
    /// Number of particles.
    pub fn approximate_count(&self) -> f64 {
        match self {
            Self::Lattice(lattice) => lattice.approximate_count(),
            Self::Mapped(mapping) => mapping.lattice.approximate_count(),
            Self::Ring(ring, _) => ring.approximate_count(),
            Self::Cut(cut) => cut.lattice.approximate_count(),
            Self::Filled(filled) => filled.particles.positions.len() as f64,
        }
    }

    /// Places the corners; `None` if a mistake was noted.
    pub fn shape(self, findings: &mut Findings<'_>) -> Option<Shape<D>> {
        match self {
            Self::Lattice(lattice) => Some(Shape::Lattice(lattice)),
            Self::Mapped(mapping) => mapping.bent(findings),
            Self::Ring(ring, perturbation) => Some(Shape::Ring(ring, perturbation)),
            Self::Cut(cut) => cut.fill(findings).map(|filled| Shape::Filled(Box::new(filled))),
            Self::Filled(filled) => Some(Shape::Filled(filled)),
        }
    }
}

impl<const D: usize> Mapping<D> {
    fn bent(self, findings: &mut Findings<'_>) -> Option<Shape<D>> {
        let Self { lattice, map, perturbation, span } = self;
        let (amount, seed) = perturbation.unwrap_or_default();
        let mut noise = Noise::new(seed);
        let image = |from: Vector<D>| match &map {
            Some(map) => Vector::from_fn(|axis, _| map[axis].value(padded(&from), 0.0)),
            None => from,
        };
        match MappedLattice::shaken(lattice, amount, || noise.next(), image) {
            Ok(mapped) => Some(Shape::Mapped(mapped, map.is_none())),
            Err(error) => {
                let (message, remedy) = match error {
                    MapError::NotFinite { from, to } => (
                        format!("the map sends {} to {to:?}", place(&from.into())),
                        "check for 0/0 and roots of negative numbers",
                    ),
                    MapError::Folded { around } => (
                        format!("the cell around {} is turned inside out", place(&around.into())),
                        "make the map keep the sense of rotation, use smaller cells, or perturb less",
                    ),
                };
                findings.error(span, message, remedy);
                None
            }
        }
    }
}

impl<const D: usize> Shape<D> {
    /// Whether it fills the box between its corners.
    pub fn is_box(&self) -> bool {
        matches!(self, Self::Lattice(_) | Self::Mapped(_, true))
    }

    /// The lattice, if it is neither bent nor shaken.
    pub fn lattice(&self) -> Option<&BoxLattice<D>> {
        match self {
            Self::Lattice(lattice) => Some(lattice),
            _ => None,
        }
    }

    /// Distance of neighbouring particles, m: the edge of a cube with the volume of the average cell.
    pub fn spacing(&self) -> f64 {
        match self {
            Self::Lattice(lattice) => lattice.mean_spacing(),
            Self::Mapped(mapped, _) => mapped.mean_spacing(),
            Self::Ring(ring, _) => ring.mean_spacing(),
            Self::Filled(filled) => filled.spacing,
        }
    }

    /// Longest distance of neighbouring particles over the spacing.
    pub fn stretch(&self) -> f64 {
        match self {
            Self::Lattice(lattice) => lattice.spacings().into_iter().fold(0.0, f64::max) / lattice.mean_spacing(),
            Self::Mapped(mapped, _) => mapped.longest_edge() / mapped.mean_spacing(),
            Self::Ring(ring, _) => ring.longest_edge() / ring.mean_spacing(),
            Self::Filled(_) => 1.0,
        }
    }

    /// The particles, and what a file says of them.
    pub fn filled(self) -> Filled<D> {
        let spacing = self.spacing();
        let particles = match self {
            Self::Lattice(lattice) => lattice.particles(),
            Self::Mapped(mapped, _) => mapped.particles(),
            Self::Ring(ring, (amount, seed)) => {
                let mut noise = Noise::new(seed);
                ring.particles(amount, || noise.next())
            }
            Self::Filled(filled) => return *filled,
        };
        Filled { particles, spacing, groups: BTreeMap::new(), record: None }
    }
}
