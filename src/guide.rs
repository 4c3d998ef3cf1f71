//! A guided tour of the library, in six steps that are tested with the documentation.
//!
//! The command line does what most users need; this is for programs that use the crate.
//!
//! # 1. A scene from text
//!
//! [`Scene::parse`] takes the text, a name for messages, the folder that files are sought from, and overrides as after
//! `--set`. [`run`] goes from there to the end. Without a directory nothing is written; with one, the same files come out
//! as from `nicolson run`.
//!
//! ```
//! use std::path::Path;
//! use std::sync::atomic::AtomicBool;
//!
//! use nicolson::output::Report;
//! use nicolson::scene::Scene;
//! use nicolson::simulation::{RunError, RunOptions, Silent, run};
//!
//! const BAR: &str = r#"
//!     dimension = 1
//!
//!     [[body]]
//!     spacing = 1.0
//!     shape.box = { lower = [0], upper = [10] }
//!     smoothing = 1.0
//!     material.linear_volumetric = { density = 1000, bulk_modulus = 1e6 }
//!
//!     [initial]
//!     velocity = ["sin(pi*X/20)"]
//!
//!     [[boundary]]
//!     select.face = "lower_x"
//!     fix = ["x"]
//!
//!     [time]
//!     step = 0.01
//!     end = 0.3
//!
//!     [exact]    # ω = πc/2L with c = √(κ/ρ)
//!     displacement = ["sin(pi*X/20) * sin(pi*sqrt(1000)/20*t) / (pi*sqrt(1000)/20)"]
//! "#;
//!
//! fn bar(spacing: f64, step: f64) -> Result<Report, RunError> {
//!     let overrides = [
//!         ("body.0.spacing".to_owned(), spacing.to_string()),
//!         ("time.step".to_owned(), step.to_string()),
//!     ];
//!     let scene = Scene::parse(BAR, "bar", Path::new(""), &overrides)?;
//!     Ok(run(&scene, &RunOptions::default(), &mut Silent, &AtomicBool::new(false))?.report)
//! }
//!
//! // Half the spacing and half the step: a quarter of the error.
//! let coarse = bar(0.5, 0.01)?.errors["displacement"].l2;
//! let fine = bar(0.25, 0.005)?.errors["displacement"].l2;
//! let order = (coarse / fine).log2();
//! assert!((order - 2.0).abs() < 0.1, "{order}");
//! # Ok::<(), RunError>(())
//! ```
//!
//! Mistakes come back as text with their place and a remedy:
//!
//! ```
//! # use std::path::Path;
//! # use nicolson::scene::Scene;
//! let errors = Scene::parse("dimension = 4", "wrong.toml", Path::new(""), &[]).unwrap_err();
//! assert!(errors.to_string().contains("wrong.toml:1:"));
//! ```
//!
//! # 2. Step by step
//!
//! [`prepare`] stops before the first step, with a [`Model`], a [`Stepper`] and the state in the hands of the caller. The
//! state of D dimensions is `[u, v, J]`, the components of a particle side by side.
//!
//! ```
//! use std::path::Path;
//!
//! use nicolson::scene::Scene;
//! use nicolson::simulation::{Prepared, prepare};
//!
//! let text = r#"
//!     dimension = 2
//!     [[body]]
//!     counts = [7, 7]
//!     smoothing = 1.0
//!     shape.box = { lower = [-0.5, -0.5], upper = [0.5, 0.5] }
//!     material.neo_hookean = { density = 1100, youngs_modulus = 17e6, poissons_ratio = 0.45 }
//!     [initial]
//!     velocity = ["-50*Y", "50*X"]
//!     [time]
//!     scheme = "energy_momentum"
//!     step = 0.005
//!     end = 0.1
//! "#;
//! let scene = Scene::parse(text, "spin", Path::new(""), &[])?;
//! let Prepared { mut model, mut stepper, mut state, end, explicit_step_limit, .. } = prepare::<2>(&scene)?;
//!
//! let energy = model.energies(&state.values).total();
//! let [_, _, spin] = model.angular_momentum(&state.values);
//! while state.time < end {
//!     // Lands on `end`, and cuts a step that fails.
//!     let step = stepper.advance(&mut model, &mut state, end)?;
//!     assert!(step.step > 10.0 * explicit_step_limit);
//! }
//! assert!((model.energies(&state.values).total() / energy - 1.0).abs() < 1e-12);
//! assert!((model.angular_momentum(&state.values)[2] / spin - 1.0).abs() < 1e-12);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # 3. The rate, for one's own integrator
//!
//! [`Model`] is a [`System`]: `rate` writes `dy/dt`. A step of the explicit mid-point rule by hand:
//!
//! ```
//! # use std::path::Path;
//! # use nicolson::scene::Scene;
//! # use nicolson::simulation::{Prepared, prepare};
//! use nicolson_solvers::time::System;
//!
//! # let text = "dimension = 1\n[[body]]\nspacing = 1.0\nshape.box = { lower = [0], upper = [10] }\n\
//! #     material.linear_volumetric = { density = 1000, bulk_modulus = 1e6 }\n[initial]\nvelocity = [\"sin(pi*X/20)\"]\n\
//! #     [[boundary]]\nselect.face = \"lower_x\"\nfix = [\"x\"]\n[time]\nstep = 0.01\nend = 0.1\n";
//! # let scene = Scene::parse(text, "bar", Path::new(""), &[])?;
//! let Prepared { mut model, state, explicit_step_limit: step, .. } = prepare::<1>(&scene)?;
//! let mut y = state.values;
//! let (mut first, mut second) = (vec![0.0; y.len()], vec![0.0; y.len()]);
//! let energy = model.energies(&y).total();
//! for i in 0..100 {
//!     let t = i as f64 * step;
//!     model.rate(t, &y, &mut first)?;
//!     let middle: Vec<f64> = y.iter().zip(&first).map(|(y, f)| y + 0.5 * step * f).collect();
//!     model.rate(t + 0.5 * step, &middle, &mut second)?;
//!     y.iter_mut().zip(&second).for_each(|(y, f)| *y += step * f);
//! }
//! // Of second order: the energy drifts, slowly.
//! assert!((model.energies(&y).total() / energy - 1.0).abs() < 1e-3);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # 4. Residual and tangent
//!
//! An implicit scheme solves stages `y = ỹ + s f(t, y)`. [`StageSystem::begin_stage`] poses one; the model then is a
//! [`NonlinearProblem`] with a residual and a tangent, as an action on vectors and as a sparse matrix. That the tangent is
//! the derivative shows in the Taylor remainder, which must fall with the square of the perturbation:
//!
//! ```
//! # use std::path::Path;
//! # use nicolson::scene::Scene;
//! # use nicolson::simulation::{Prepared, prepare};
//! use nicolson_solvers::nonlinear::NonlinearProblem;
//! use nicolson_solvers::time::StageSystem;
//!
//! # let text = "dimension = 2\n[[body]]\ncounts = [5, 5]\nsmoothing = 1.0\nshape.box = { lower = [0, 0], upper = [1, 1] }\n\
//! #     material.neo_hookean = { density = 1100, youngs_modulus = 17e6, poissons_ratio = 0.45 }\n\
//! #     [initial]\nvelocity = [\"-50*Y\", \"50*X\"]\n[time]\nscheme = \"crank_nicolson\"\nstep = 0.005\nend = 0.1\n";
//! # let scene = Scene::parse(text, "plate", Path::new(""), &[])?;
//! let Prepared { mut model, state, .. } = prepare::<2>(&scene)?;
//! model.begin_stage(0.0, 0.0025, &state.values);
//! let n = NonlinearProblem::unknowns(&model);
//! let mut v = vec![0.0; n];
//! model.start_from(&state.values, &mut v);
//!
//! let (mut start, mut trial, mut action) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
//! model.residual(&v, &mut start)?;
//! model.linearise(&v)?;
//! let direction: Vec<f64> = (0..n).map(|i| (i as f64).sin()).collect();
//! model.tangent().apply(&direction, &mut action);
//! let mut remainder = |epsilon: f64| {
//!     let point: Vec<f64> = v.iter().zip(&direction).map(|(v, d)| v + epsilon * d).collect();
//!     model.residual(&point, &mut trial)?;
//!     let rest = trial.iter().zip(&start).zip(&action).map(|((t, s), a)| (t - s - epsilon * a).powi(2));
//!     Ok::<f64, nicolson_solvers::EvaluationError>(rest.sum::<f64>().sqrt())
//! };
//! let ratio = remainder(0.2)? / remainder(0.1)?;
//! assert!((ratio - 4.0).abs() < 0.1, "{ratio}");
//!
//! // The same by entries, in rows.
//! model.linearise(&v)?;
//! let matrix = model.tangent_matrix();
//! let mut product = vec![0.0; n];
//! matrix.apply(&direction, &mut product);
//! let largest = product.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
//! assert!(product.iter().zip(&action).all(|(p, a)| (p - a).abs() < 1e-12 * largest));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! `nicolson jacobian SCENE.toml` does this for every term and block, and `--export-tangent` writes the matrix.
//!
//! # 5. A problem without a scene
//!
//! [`Setup`] is what a scene becomes: plain data. A program may change one, or fill its own: particles from anywhere, and a
//! material whose constants follow from something else. The laws are closed enums, so that the loops over particles are
//! compiled for each; a new law is a file in `src/material`, by the recipe in `CONTRIBUTING.md`.
//!
//! ```
//! # use std::path::Path;
//! # use nicolson::scene::Scene;
//! use nicolson::material::{Material, MooneyRivlin, SolidLaw, Transverse, VolumetricForm};
//! use nicolson::model::Model;
//! use nicolson::setup::Setup;
//!
//! # let text = "dimension = 2\n[[body]]\ncounts = [5, 5]\nsmoothing = 1.0\nshape.box = { lower = [0, 0], upper = [1, 1] }\n\
//! #     material.neo_hookean = { density = 1100, youngs_modulus = 17e6, poissons_ratio = 0.45 }\n\
//! #     [initial]\nvelocity = [\"-50*Y\", \"50*X\"]\n[time]\nscheme = \"crank_nicolson\"\nstep = 0.005\nend = 0.1\n";
//! # let scene = Scene::parse(text, "plate", Path::new(""), &[])?;
//! let (mut setup, _warnings): (Setup<2>, _) = scene.setup()?;
//!
//! // A rubber whose constants depend on the temperature.
//! let rubber = |kelvin: f64| MooneyRivlin {
//!     first: 2e6 * kelvin / 293.0,
//!     second: 1e6 * kelvin / 293.0,
//!     bulk_modulus: 5e7,
//!     volumetric: VolumetricForm::Logarithmic,
//! };
//! let warm = Material::solid(1100.0, SolidLaw::MooneyRivlin(rubber(340.0)), Transverse::Strain);
//! let cold = Material::solid(1100.0, SolidLaw::MooneyRivlin(rubber(260.0)), Transverse::Strain);
//! assert!(warm.shear_wave_speed() > cold.shear_wave_speed());
//!
//! setup.bodies[0].material = warm;
//! let mut model = Model::new(setup, None, None)?;
//! let state = model.initial_state()?;
//! assert_eq!(model.material(0), &warm);
//! assert_eq!(state.len(), 25 * (2 + 2 + 1));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # 6. Solvers without particles
//!
//! The package [`nicolson_solvers`] takes any [`NonlinearProblem`] or [`System`] on `&[f64]`:
//!
//! ```
//! use nicolson_solvers::EvaluationError;
//! use nicolson_solvers::time::{Scheme, StepControl, Stepper, System, TimeState};
//!
//! /// u″ = −u, as (u, u′).
//! struct Spring;
//!
//! impl System for Spring {
//!     fn len(&self) -> usize {
//!         2
//!     }
//!
//!     fn rate(&mut self, _t: f64, u: &[f64], out: &mut [f64]) -> Result<(), EvaluationError> {
//!         out.copy_from_slice(&[u[1], -u[0]]);
//!         Ok(())
//!     }
//! }
//!
//! let mut stepper = Stepper::new(Scheme::Rk4, StepControl::Fixed { step: 0.01 }, None)?;
//! let mut state = TimeState::new(0.0, vec![1.0, 0.0]);
//! while state.time < 1.0 {
//!     stepper.advance(&mut Spring, &mut state, 1.0)?;
//! }
//! assert!((state.values[0] - 1.0_f64.cos()).abs() < 1e-9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! [`Scene::parse`]: crate::scene::Scene::parse
//! [`run`]: crate::simulation::run
//! [`prepare`]: crate::simulation::prepare()
//! [`Model`]: crate::model::Model
//! [`Setup`]: crate::setup::Setup
//! [`Stepper`]: nicolson_solvers::time::Stepper
//! [`System`]: nicolson_solvers::time::System
//! [`StageSystem::begin_stage`]: nicolson_solvers::time::StageSystem::begin_stage
//! [`NonlinearProblem`]: nicolson_solvers::nonlinear::NonlinearProblem
