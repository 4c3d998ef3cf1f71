//! Particle clouds: where the particles are, how much volume each stands for, and which pieces of the
//! boundary it carries.
//!
//! [`BoxLattice`] fills a box in one, two or three dimensions, [`MappedLattice`] the image of one,
//! [`RingLattice`] rings and discs; [`CutLattice`] fills any [`Region`], which may be the inside of a [`Surface`] of
//! triangles; [`mesh_particles`] takes the cells or the nodes of a mesh, [`read_points`], [`read_vtu`] and [`read_faces`]
//! lists from files.
//! Neither knows of scenes: limits and mistakes come back as values, and the scene says where they are from.

mod assemble;
mod clip;
mod curve;
mod cut;
mod faces;
mod lattice;
mod mapped;
mod meshed;
mod msh;
mod multilinear;
mod points;
mod region;
mod ring;
mod simplex;
mod stencil;
mod stl;
mod surface;
mod volumes;
mod vtu;

pub use assemble::CutReport;
pub use curve::number_along_curve;
pub use cut::{CutError, CutLattice};
pub use faces::read_faces;
pub use lattice::{BoxLattice, LatticeError, Layout, Layouts};
pub use mapped::{MapError, MappedLattice};
pub use meshed::{Group, MeshPoints, Meshed, MeshedError, mesh_particles};
pub use msh::{Element, Form, Mesh, read_msh};
pub(crate) use multilinear::gradient_products;
pub use points::{PointError, read_points, repeated_points};
pub use region::{Region, polygon_area};
pub use ring::{RingError, RingLattice};
pub use stencil::stencil_volumes;
pub use stl::{read_stl, write_stl};
pub use surface::{Surface, Triangle};
pub use volumes::{adapt_volumes, enclosed};
pub use vtu::{VtuPoints, read_vtu};
