//! Implicit-first Total Lagrangian SPH: a scene file in, a verified simulation out.
//!
//! Smoothed particle hydrodynamics discretises a continuum by particles and a kernel. In the *Total
//! Lagrangian* description everything refers to the configuration at the start, so neighbours, kernel and
//! correction are found once per run, and what is left is a system of ordinary differential equations with
//! constant gradient weights. That makes *implicit* time integration practical: the Jacobian has a pattern that
//! never changes and entries that can be written down. This crate does so, after M. Pilotto, *Smoothed Particle
//! Hydrodynamics (SPH): towards implicit time integration* (Università di Padova and Universitat Politècnica de
//! Catalunya, 2025), which the sources call *document 004* and whose equation numbers they quote; where they
//! differ from it, they say why.
//!
//! # The equations
//!
//! Unknowns of particle a: displacement `u = x − X`, velocity `v`, volume ratio `J`. Reference volume `V`, density
//! `ρ`, mass `m = ρV`, pressure `p` (positive in compression), neighbours b, `D` = 1, 2 (plane strain) or 3:
//!
//! ```text
//! gradient     g_ab = w_b B_a ∇W̃_b(X_a),   B_a = (Σ_b w_b ∇W̃_b ⊗ (X_b − X_a))⁻¹    exact for linear fields
//! deformation  F_a = I + Σ_b u_b ⊗ g_ab,   L_a = Σ_b v_b ⊗ g_ab,   H = cof F           (or H = J F⁻ᵀ)
//! momentum     m_a v̇_a = −Σ_b V_b P_b g_ba + A_a t_a + m_a b_a + V_a D_v,a,   P = −p(J) H
//! volume       J̇_a = H_a : L_a + D_p,a
//! motion       u̇_a = v_a
//! upwinding    V_a D_v,a = τ_v Σ_b V_a V_b ρ c (n⊗n)(v⁺ − v⁻)(N·g)                     D_p likewise, for p
//! laws         p = −κ(J − 1)          or   p = κ(J^−γ − 1),  γ ≥ 1                     fluids
//!              P = ∂ψ/∂F: St Venant–Kirchhoff, neo-Hookean, Mooney–Rivlin, linear elastic; a nearly incompressible
//!              law with p from J and its deviator from F; Kelvin–Voigt viscosity            solids
//! hourglass    Π = ¼ Σ_a Σ_b k_ab |F_a X_ab − x_ab|²                                         solids
//! ```
//!
//! The force uses the transposed weights `g_ba`: that conserves linear momentum, and makes the force the gradient
//! of the energy `Σ V ψ` and the tangent symmetric. A time scheme then either evaluates this rate (explicit), or solves
//! stages `y = ỹ + s f(t, y)` (implicit), with `u` and, without D_p, also `J` eliminated (without D_p, J is det F up to a
//! constant, unless a body wants [otherwise](setup::VolumeRatioChoice)):
//!
//! ```text
//! residual     R(v) = m (v − ṽ) − s f(ũ + s v, v, J(v))
//! Newton       (m − s ∂f/∂v − s² ∂f/∂u − …) δv = −R        analytic, sparse, two rings of neighbours
//! ```
//!
//! or, for the energy–momentum scheme, a step in which `(ψ₁ − ψ₀)/(J₁ − J₀)` takes the place of `−p`: total energy
//! then is constant whatever the step.
//!
//! ```text
//! conserving   x₁ − x₀ = Δt v̄,   P* = (ψ₁ − ψ₀)/(J₁ − J₀) H*,   H* : (F₁ − F₀) = J₁ − J₀
//! ```
//!
//! # The layers
//!
//! Each sees those above it in this table, and none below.
//!
//! | module | what it does | what it does not know |
//! |---|---|---|
//! | [`nicolson_solvers`] | linear, nonlinear and time solvers on `&[f64]` | particles |
//! | [`tensor`], [`expression`] | small matrices; fields of `X, Y, Z, t` as text | anything else |
//! | [`setup`] | the seam: a problem with every selector applied, as plain data | files, solvers |
//! | [`kernel`], [`geometry`] | W and W′; particle clouds, volumes, faces | scenes |
//! | [`scene`] | TOML to a [`setup::Setup`], all mistakes located | what is computed from it |
//! | [`discretisation`] | neighbours and gradient weights, once per run | laws, time |
//! | [`material`] | laws: ψ, p, p′ | particles |
//! | [`stabilisation`] | D_v, D_p and hourglass control; built only where asked for | time |
//! | [`model`] | the semi-discrete system, its Jacobian, its energies | files, time schemes |
//! | [`output`] | VTU, CSV, plots and the report, from plain slices | what the numbers mean |
//! | [`simulation`] | the run: prepare, step, keep the books, write | the terminal |
//! | [`study`] | many runs of one scene: sweeps, orders of convergence | the terminal |
//! | [`cli`] | the `nicolson` command; the only place that prints | |
//!
//! # An example
//!
//! The [guide] goes on from here: steps by hand, rates, tangents, problems without a scene.
//!
//! A bar, clamped at `X = 0`, starts in its lowest mode, whose exact motion is known. Nothing is written.
//!
//! ```
//! use std::path::Path;
//! use std::sync::atomic::AtomicBool;
//!
//! use nicolson::output::Status;
//! use nicolson::scene::Scene;
//! use nicolson::simulation::{RunOptions, Silent, run};
//!
//! let text = r#"
//!     dimension = 1
//!
//!     [[body]]
//!     counts = [21]
//!     shape.box = { lower = [0], upper = [10] }
//!     smoothing = 1.0
//!     material.linear_volumetric = { density = 1000, bulk_modulus = 1e6 }
//!
//!     [initial]
//!     velocity = ["sin(pi*X/20)"]
//!
//!     [[boundary]]
//!     select.where = "X < 1e-9"
//!     fix = ["x"]
//!
//!     [time]
//!     scheme = "crank_nicolson"
//!     step = 0.01
//!     end = 0.3
//!
//!     [exact]    # ω = πc/2L with c = √(κ/ρ)
//!     displacement = ["sin(pi*X/20) * sin(pi*sqrt(1000)/20*t) / (pi*sqrt(1000)/20)"]
//! "#;
//! let scene = Scene::parse(text, "bar", Path::new(""), &[])?;
//! let report = run(&scene, &RunOptions::default(), &mut Silent, &AtomicBool::new(false))?.report;
//!
//! assert_eq!(report.status, Status::Completed);
//! // The problem is linear: one iteration per step, one factorisation in all, energy to rounding.
//! assert_eq!(report.newton.iterations, report.steps.accepted);
//! assert_eq!(report.linear.factorisations, 1);
//! assert!(report.energy.max_relative_drift.unwrap() < 1e-12);
//! // The amplitude is 0.2 m.
//! assert!(report.errors["displacement"].l2 < 3e-4);
//! # Ok::<(), nicolson::simulation::RunError>(())
//! ```
//!
//! # Choosing a discretisation
//!
//! `cargo run --release --example discretisation_study` measures errors of static loads and frequencies, spurious modes
//! and costs for kernels, smoothing lengths (0.9 to 2.0 spacings), layouts, weights, hourglass control and clouds; `examples/discretisation.md`
//! has a table. For solids: cubic spline, `smoothing = 1.0` (the default 1.2 costs 4.5 times as much and is no more accurate;
//! 0.9 loses balanced rings), balanced weights, `volumes = "stencil"` for `cell` layouts, and the default of the
//! [hourglass control](stabilisation::default_hourglass), which follows from the weights.
//!
//! # Limits
//!
//! - Bodies do not interact, with each other or with themselves: there is no contact.
//! - Integration at particles leaves modes with almost no energy, the worse the wider the kernel: keep `smoothing` at
//!   1.2 or below. Upwinding damps them, [hourglass control](stabilisation::Hourglass) removes them; fluids have none
//!   unless asked, because it resists the bending of what should flow.
//! - [Balanced](setup::WeightChoice::Balanced) weights, the default where a body allows them, converge with second
//!   order; the others do in one dimension at `smoothing = 1` only, and with 0.5 on the elastic piston. What could
//!   not be balanced is in the report.
//! - Crank–Nicolson, the mid-point rule and their kin are unconditionally stable for linear equations, and for
//!   those only.
//! - Neighbours are those of the reference configuration: matter does not separate or mix.

pub mod cli;
pub mod discretisation;
pub mod expression;
mod files;
pub mod geometry;
pub mod guide;
pub mod kernel;
pub mod machine;
pub mod material;
pub mod model;
pub mod output;
pub mod scene;
pub mod setup;
pub mod simulation;
pub mod stabilisation;
pub mod study;
pub mod tensor;
