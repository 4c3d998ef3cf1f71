//! Particle clouds: where the particles are, how much volume each stands for, and which pieces of the
//! boundary it carries.
//!
//! [`BoxLattice`] fills a box in one, two or three dimensions, [`MappedLattice`] the image of one,
//! [`RingLattice`] rings and discs; [`read_points`] and [`read_faces`] take lists from files.
//! Neither knows of scenes: limits and mistakes come back as values, and the scene says where they are from.

mod faces;
mod lattice;
mod mapped;
mod multilinear;
mod points;
mod ring;
mod stencil;
mod volumes;

pub use faces::read_faces;
pub use lattice::{BoxLattice, LatticeError, Layout, Layouts};
pub use mapped::{MapError, MappedLattice};
pub(crate) use multilinear::gradient_products;
pub use points::{PointError, read_points};
pub use ring::{RingError, RingLattice};
pub use stencil::stencil_volumes;
pub use volumes::{adapt_volumes, enclosed};
