//! The part of a particle in a cell: where it sits, and its share of every place.

use crate::tensor::Vector;

/// Where a particle sits in a cell, along one direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Member {
    Lower,
    Middle,
    Upper,
}

/// Place in the unit cube: the ends in vertex directions; in cell directions that of `free`, or the middle.
pub(super) fn anchor<const D: usize>(member: &[Member; D], free: Option<&Vector<D>>) -> Vector<D> {
    Vector::from_fn(|axis, _| match member[axis] {
        Member::Lower => 0.0,
        Member::Upper => 1.0,
        Member::Middle => free.map_or(0.5, |place| place[axis]),
    })
}

/// A place of the unit cube moved to the middle of the slices, in cell directions.
pub(super) fn sliced<const D: usize>(member: &[Member; D], place: &Vector<D>) -> Vector<D> {
    Vector::from_fn(|axis, _| if member[axis] == Member::Middle { 0.5 } else { place[axis] })
}

/// Share of a particle in a place of the unit cube.
pub(super) fn shape<const D: usize>(member: &[Member; D], place: &Vector<D>) -> f64 {
    shape_across(member, D, place)
}

/// [`shape`] without one direction.
pub(super) fn shape_across<const D: usize>(member: &[Member; D], without: usize, place: &Vector<D>) -> f64 {
    (0..D)
        .filter(|axis| *axis != without)
        .map(|axis| match member[axis] {
            Member::Lower => 1.0 - place[axis],
            Member::Upper => place[axis],
            Member::Middle => 1.0,
        })
        .product()
}
