//! A validated problem: what a scene file describes once every selector has been applied and every
//! expression evaluated that can be. The seam between reading scenes and computing with them.
//!
//! Particles are numbered through all bodies, body after body. SI units; `D = 2` is plane strain per
//! unit thickness, `D = 1` uniaxial strain per unit cross-section.

use std::ops::Range;

use nalgebra::SVector;

use crate::expression::Expression;
use crate::material::Material;

/// A problem ready to be discretised.
#[derive(Debug, Clone)]
pub struct Setup<const D: usize> {
    /// Title of the scene.
    pub title: String,
    /// Bodies, in order of their particles. Bodies do not interact.
    pub bodies: Vec<Body>,
    /// The particles of all bodies.
    pub particles: Particles<D>,
    /// Kind of motion of every component of every particle.
    pub constraints: Vec<[Constraint; D]>,
    /// Prescribed displacements that [`Constraint::Moving`] refers to, m.
    pub motions: Vec<Expression>,
    /// Loads on boundary areas.
    pub tractions: Vec<Traction<D>>,
    /// Uniform acceleration, m/s².
    pub gravity: SVector<f64, D>,
    /// Further acceleration as a field of `X, Y, Z, t`, m/s²; absent if zero.
    pub body_force: Option<[Expression; D]>,
    /// State at `t = 0`.
    pub initial: InitialState<D>,
    /// Upwind stabilisation; absent if every coefficient is zero.
    pub stabilisation: Option<Stabilisation>,
    /// Places whose motion is recorded.
    pub probes: Vec<Probe<D>>,
    /// Exact solution to compare with at the end.
    pub exact: Option<ExactSolution<D>>,
    /// What filling came to, of bodies that were cut out of a lattice or came from a file.
    pub geometry: Vec<GeometryRecord>,
}

/// What filling a shape or reading a file came to.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GeometryRecord {
    /// Name of the body.
    pub body: String,
    /// File, or `shape`.
    pub source: String,
    /// Number of particles.
    pub particles: usize,
    /// Volume of the particles, m^D.
    pub volume: f64,
    /// Their mass, kg.
    pub mass: f64,
    /// Volume by a formula, or that the triangles enclose, m^D, if known.
    pub exact_volume: Option<f64>,
    /// Relative error of the volume that the cells hold, before it was scaled to the exact one.
    pub volume_error: Option<f64>,
    /// Relative error of the mass.
    pub mass_error: Option<f64>,
    /// Triangles of the file.
    pub triangles: Option<usize>,
    /// Edges of triangles without a counterpart.
    pub open_edges: Option<usize>,
    /// Cells where the body is thinner than the spacing.
    pub thin_cells: usize,
    /// Whether pieces of the boundary are known: without them, weights are not balanced.
    pub has_faces: bool,
}

impl GeometryRecord {
    /// Enters what follows from the volumes of the particles.
    pub fn complete(&mut self, volumes: &[f64], density: f64) {
        self.particles = volumes.len();
        self.volume = volumes.iter().sum();
        self.mass = self.volume * density;
        self.mass_error = self.exact_volume.map(|exact| self.volume / exact - 1.0);
    }
}

/// One body: a range of particles with one material and one kernel.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// Name from the scene, or `body 1`.
    pub name: String,
    /// Its particles.
    pub particles: Range<usize>,
    /// Distance of neighbouring particles, m (the nominal one for a point list).
    pub spacing: f64,
    /// Kernel.
    pub kernel: KernelChoice,
    /// Smoothing length divided by spacing.
    pub smoothing: f64,
    /// Which weights the gradient sums use.
    pub weights: WeightChoice,
    /// Constitutive law.
    pub material: Material,
    /// Which cofactor the volumetric laws use.
    pub cofactor: CofactorChoice,
    /// Where the volume ratio J comes from.
    pub volume_ratio: VolumeRatioChoice,
    /// Coefficient α of the hourglass control; 0 switches it off. `None`: what suits the law and the weights that the
    /// body gets, see [`crate::stabilisation::default_hourglass`].
    pub hourglass: Option<f64>,
}

/// Reference configuration of the particles.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Particles<const D: usize> {
    /// Reference positions, m.
    pub positions: Vec<SVector<f64, D>>,
    /// Quadrature volumes of the weak form, m^D: they add up to the volume of the body and carry
    /// mass, energy and force.
    pub volumes: Vec<f64>,
    /// Weights inside the kernel sums of the gradient, m^D: the local particle spacing, without the
    /// halving at boundaries (equal on a lattice).
    pub kernel_volumes: Vec<f64>,
    /// Pieces of the boundary, each attributed to one particle.
    pub faces: Vec<Face<D>>,
    /// Cells with a particle at every corner, `2^D` particles each; bit `i` of the place in a cell says which end of
    /// direction `i`. Either they share out the volumes as `V_a = ∫ φ_a dV` of their multilinear shape functions, or
    /// there are none.
    pub cells: Vec<u32>,
}

/// A piece of boundary.
#[derive(Debug, Clone, PartialEq)]
pub struct Face<const D: usize> {
    /// The particle that carries it.
    pub particle: usize,
    /// Outward unit normal.
    pub normal: SVector<f64, D>,
    /// Area, m^(D−1) (1 in one dimension).
    pub area: f64,
    /// Where it acts, m: the particle itself if that lies on the boundary.
    pub point: SVector<f64, D>,
    /// The side of the shape that it belongs to; none for a list of points.
    pub side: Option<Side>,
}

/// A side of a shape, in the coordinates of its lattice.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Side {
    /// Direction that the side is across of.
    pub axis: usize,
    /// Whether it is the upper one of the two.
    pub upper: bool,
}

/// Kind of motion of one component of one particle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Constraint {
    /// Follows from the equations of motion.
    #[default]
    Free,
    /// Keeps its initial position.
    Fixed,
    /// Displacement prescribed by [`Setup::motions`] at this index.
    Moving(usize),
}

/// A load per area, on pieces of boundary.
#[derive(Debug, Clone)]
pub struct Traction<const D: usize> {
    /// Name for messages.
    pub name: String,
    /// Particles and areas, m^(D−1).
    pub areas: Vec<(usize, f64)>,
    /// Where each of them acts, m: the particle itself if that lies on the boundary; else the particles around it share
    /// the load such that its resultant and its moment are those of that place.
    pub points: Vec<SVector<f64, D>>,
    /// Components as fields of `X, Y, Z, t`, Pa (per reference area, fixed direction).
    pub value: [Expression; D],
}

/// State at `t = 0`.
#[derive(Debug, Clone, PartialEq)]
pub struct InitialState<const D: usize> {
    /// Displacement, m.
    pub displacement: Vec<SVector<f64, D>>,
    /// Velocity, m/s.
    pub velocity: Vec<SVector<f64, D>>,
    /// Pressure, Pa (positive in compression); `None`: the volume ratio starts as `det F`.
    pub pressure: Option<Vec<f64>>,
    /// Whether the displacement is only where the search for the equilibrium under the loads at `t = 0` begins.
    pub equilibrium: bool,
}

/// Smoothing kernel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum KernelChoice {
    /// Cubic spline, support 2h.
    CubicSpline,
    /// Wendland C2, support 2h.
    WendlandC2,
    /// Quintic spline, support 3h.
    QuinticSpline,
}

/// Origin of the gradient weights (formulation, section 2).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WeightChoice {
    /// Equal weights in the kernel sums, quadrature volumes in the weak form: second order in 1D with a
    /// smoothing of 1 spacing, first order at 1.2.
    Separate,
    /// One array for both, as in document 004: first order.
    Single,
    /// Corrected so that constant stress is balanced by its boundary traction.
    Balanced,
    /// Balanced, too, but by the cells whose corners the particles are, `∫ φ_a ∇φ_b dV`: no equations, for any size.
    Cells,
    /// By cells where the kernel reaches next neighbours only, otherwise balanced if that is cheap, otherwise by cells;
    /// separate where none of this is possible. The report says which.
    Auto,
}

/// Cofactor in the volumetric laws and in the rate of J.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CofactorChoice {
    /// `H = cof F`.
    Geometric,
    /// `H = J F⁻ᵀ` with the evolved J, as printed in document 004.
    Evolved,
}

/// Where the volume ratio J of a body comes from.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum VolumeRatioChoice {
    /// The determinant, unless J has an equation that the determinant does not solve (D_p), is an unknown, or is part
    /// of the cofactor.
    #[default]
    Auto,
    /// `det F`, with what sets it apart from J at the start: what its rate equation integrates to.
    Determinant,
    /// Its rate equation is integrated with the others, as in document 004.
    Evolved,
}

/// Upwind stabilisation (formulation, section 4).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stabilisation {
    /// Coefficient of D_v; 0 switches the term off.
    pub tau_v: f64,
    /// Coefficient of D_p; 0 switches the term off.
    pub tau_p: f64,
    /// Wave speed: `c⁰/√λ_min(FᵀF)` if true, `c⁰` if false.
    pub deformed_wave_speed: bool,
    /// Corrected average gradient (as the source) instead of the plain kernel gradient, which alone
    /// is provably dissipative.
    pub corrected_gradient: bool,
    /// States at the interface of a pair.
    pub interface: InterfaceChoice,
    /// Jump of the full stress `P⁺ − P⁻` (as the source) in D_p instead of the pressure jump with the
    /// average cofactor, which alone is provably dissipative.
    pub stress_jump: bool,
    /// Speed of shear waves across the line between two particles (as the source's Riemann states) instead of nothing:
    /// no central force, so that angular momentum is lost, and constant interface states resist rotation.
    pub transverse_shear: bool,
}

/// States at the interface of a pair, whose jump the upwinding works on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InterfaceChoice {
    /// Those of the two particles, as document 004 by default: dissipation proportional to the wave speed times the
    /// spacing, which overdamps slow flows of fast media.
    Constant,
    /// Linear reconstruction (3.50)–(3.53): two orders less, but a pair may feed energy.
    Reconstructed,
    /// Linear reconstruction, limited so that every pair dissipates.
    Limited,
}

impl InterfaceChoice {
    /// Whether gradients of the states are needed.
    pub fn reconstructs(self) -> bool {
        self != Self::Constant
    }
}

/// A place whose motion is recorded.
#[derive(Debug, Clone, PartialEq)]
pub struct Probe<const D: usize> {
    /// Name, used in column titles.
    pub name: String,
    /// Reference position, m.
    pub position: SVector<f64, D>,
    /// The body it belongs to.
    pub body: usize,
    /// `Some(particle)`: record this particle; `None`: interpolate at the position with the kernel.
    pub particle: Option<usize>,
}

/// Exact solution as fields of `X, Y, Z, t`.
#[derive(Debug, Clone, Default)]
pub struct ExactSolution<const D: usize> {
    /// Displacement, m.
    pub displacement: Option<[Expression; D]>,
    /// Velocity, m/s.
    pub velocity: Option<[Expression; D]>,
    /// Pressure, Pa.
    pub pressure: Option<Expression>,
}
