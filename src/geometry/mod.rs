//! Particle clouds: where the particles are, how much volume each stands for, and which pieces of the
//! boundary it carries.
//!
//! [`BoxLattice`] fills a box in one, two or three dimensions, [`MappedLattice`] the image of one;
//! [`read_points`] takes a list from a file.
//! Neither knows of scenes: limits and mistakes come back as values, and the scene says where they are from.

mod lattice;
mod mapped;
mod points;

pub use lattice::{BoxLattice, LatticeError, Layout, Layouts};
pub use mapped::{MapError, MappedLattice};
pub use points::{PointError, read_points};
