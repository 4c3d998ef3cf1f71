//! What the matrix-free path offers to preconditioners, against the entries that it does without.

mod support;

use nicolson::material::*;
use nicolson::model::{CheckPoint, Model, Unknowns};
use nicolson::scene::Scene;
use nicolson::setup::*;
use nicolson::simulation::prepare;
use nicolson_solvers::linear::{
    AutomaticOptions, CoarseMatrix, Effort, Geometry, KrylovOptions, LinearError, LinearSolverChoice, LinearSolverInfo,
    MultigridOptions, Operator, Places, Preconditioner, SparseMatrix, Symmetry, Tangent, Tents,
};
use nicolson_solvers::nonlinear::NonlinearProblem;
use nicolson_solvers::time::StageSystem;
use support::{fluid, particles, setup};

const NEO: SolidLaw =
    SolidLaw::NeoHookean(NeoHookean { lambda: 1.5e5, shear_modulus: 1e5, volumetric: VolumetricForm::Logarithmic });

/// A model of a block with a roller, a clamped particle and hourglass control, linearised at a deformed point.
fn linearised<const D: usize>(counts: [usize; D], law: Material, shift: f64) -> Model<D> {
    let spacing = 0.25;
    let mut setup = setup(particles(counts, spacing, 0.1), spacing, law);
    setup.bodies[0].hourglass = Some(0.7);
    for (constraint, x) in setup.constraints.iter_mut().zip(&setup.particles.positions) {
        if x[D - 1] == 0.0 {
            constraint[D - 1] = Constraint::Fixed;
        }
    }
    setup.constraints[0] = [Constraint::Fixed; D];
    let mut model = Model::new(setup, Some(Unknowns::Velocity), None).expect("model");
    let state = model.initial_state().expect("state");
    let CheckPoint { time, shift, base, unknowns, .. } =
        model.check_point(0.0, shift, &state, 0.04, 3).expect("check point");
    model.begin_stage(time, shift, &base);
    model.linearise(&unknowns).expect("linearised");
    model
}

fn laws() -> Vec<(&'static str, Material)> {
    let steel = Material::solid(1000.0, NEO, Transverse::Strain);
    vec![
        ("volumetric", fluid()),
        ("neo-Hookean", steel),
        ("viscous", steel.with_viscosity(KelvinVoigt { shear: 300.0, bulk: 500.0 })),
    ]
}

/// Largest difference of two lists, in units of the largest of the second.
fn deviation(found: &[f64], expected: &[f64]) -> f64 {
    let largest = expected.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    found.iter().zip(expected).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs())) / largest
}

fn diagonal_is_that_of_the_entries<const D: usize>(counts: [usize; D]) {
    for (name, law) in laws() {
        let model = linearised(counts, law, 0.02);
        let starts = model.blocks().to_vec();
        let mut found = vec![0.0; starts.windows(2).map(|b| (b[1] - b[0]).pow(2)).sum()];
        model.diagonal_blocks(&mut found);
        assert!(!model.has_pattern(), "{name}");
        let matrix: SparseMatrix = model.tangent_matrix();
        let expected: Vec<f64> = starts
            .windows(2)
            .flat_map(|b| (b[0]..b[1]).flat_map(move |i| (b[0]..b[1]).map(move |j| (i, j))))
            .map(|(i, j)| matrix.get(i, j))
            .collect();
        let deviation = deviation(&found, &expected);
        assert!(deviation < 1e-12, "{D}D {name}: {deviation:e}");
    }
}

#[test]
fn diagonal_blocks_are_those_of_the_entries() {
    diagonal_is_that_of_the_entries([7]);
    diagonal_is_that_of_the_entries([6, 5]);
    diagonal_is_that_of_the_entries([4, 4, 4]);
}

fn projection_is_that_of_the_action<const D: usize>(counts: [usize; D]) {
    for (name, law) in laws() {
        let model = linearised(counts, law, 0.02);
        let geometry = model.geometry().expect("velocities only");
        let unknowns = geometry.unknowns.clone();
        let tents = Tents::new(geometry, 2.5).expect("finite");
        let mut coarse = CoarseMatrix::zeros(D, tents.nodes());
        assert!(model.project(&tents, &mut coarse));
        let (n, size) = (model.size(), tents.nodes() * D);
        let mut columns = vec![vec![0.0; n]; size];
        for (point, unknowns) in unknowns.iter().enumerate() {
            for (node, value) in tents.at(point).iter() {
                for i in (0..D).filter(|&i| unknowns[i] != u32::MAX) {
                    columns[node * D + i][unknowns[i] as usize] = value;
                }
            }
        }
        let (mut expected, mut found) = (vec![0.0; size * size], vec![0.0; size * size]);
        let mut product = vec![0.0; n];
        for (j, column) in columns.iter().enumerate() {
            model.apply(column, &mut product);
            for (i, row) in columns.iter().enumerate() {
                let value: f64 = row.iter().zip(&product).map(|(r, p)| r * p).sum();
                expected[i * size + j] += 0.5 * value;
                expected[j * size + i] += 0.5 * value;
            }
        }
        for i in 0..tents.nodes() {
            for (j, block) in coarse.row(i) {
                for k in 0..D * D {
                    found[(i * D + k / D) * size + j * D + k % D] = block[k];
                }
            }
        }
        let deviation = deviation(&found, &expected);
        assert!(deviation < 1e-12, "{D}D {name}: {deviation:e}");
        assert!(!model.has_pattern());
    }
}

#[test]
fn the_coarse_matrix_is_that_of_the_action() {
    projection_is_that_of_the_action([9]);
    projection_is_that_of_the_action([7, 6]);
    projection_is_that_of_the_action([5, 4, 4]);
}

#[test]
fn matrix_free_solvers_build_no_pattern_and_agree_with_the_direct_one() {
    let steel = Material::solid(1000.0, NEO, Transverse::Strain);
    let model = linearised([12, 9], steel, 0.2);
    let b: Vec<f64> = (0..model.size()).map(|i| (i as f64 * 0.7).sin()).collect();
    let solve = |choice: LinearSolverChoice| {
        let mut solver = choice.build();
        let mut x = vec![0.0; b.len()];
        solver.prepare(&model).unwrap_or_else(|e| panic!("{choice:?}: {e}"));
        let report = solver.solve(&model, &b, &mut x, 1e-10).unwrap_or_else(|e| panic!("{choice:?}: {e}"));
        (x, report.iterations)
    };
    let mut found = Vec::new();
    for preconditioner in [
        Preconditioner::None,
        Preconditioner::Jacobi,
        Preconditioner::BlockJacobi,
        Preconditioner::Multigrid(MultigridOptions { smoothing: 0, ..Default::default() }),
        Preconditioner::Multigrid(MultigridOptions::default()),
        Preconditioner::Multigrid(MultigridOptions { smoothing: 2, coarsest: 8, ..Default::default() }),
    ] {
        let krylov = KrylovOptions { preconditioner, operator: Operator::MatrixFree, ..Default::default() };
        for choice in [
            LinearSolverChoice::Cg { krylov: krylov.clone() },
            LinearSolverChoice::Minres { krylov: krylov.clone() },
            LinearSolverChoice::Gmres { restart: 50, krylov: krylov.clone() },
            LinearSolverChoice::BiCgStab { krylov: krylov.clone() },
        ] {
            found.push((format!("{choice:?}"), solve(choice)));
        }
    }
    assert!(!model.has_pattern());
    let (reference, _) = solve(LinearSolverChoice::ldlt());
    assert!(model.has_pattern());
    for (name, (x, iterations)) in found {
        let deviation = deviation(&x, &reference);
        assert!(deviation < 1e-7, "{name}: {deviation:e}");
        let limit = if name.contains("Multigrid") { 45 } else { 400 };
        assert!(iterations <= limit, "{name}: {iterations}");
    }
}

#[test]
fn a_scene_runs_without_entries_and_agrees_with_the_direct_solver() {
    let scene = |linear: &str| {
        let text = format!(
            "title = \"t\"\ndimension = 2\ngravity = [0.0, -5.0]\n[[body]]\ncounts = [25, 7]\nlayout = \"vertex\"\n\
             smoothing = 1.2\nweights = \"separate\"\nshape.box = {{ lower = [0.0, 0.0], upper = [4.0, 1.0] }}\n\
             material.neo_hookean = {{ density = 1000.0, youngs_modulus = 1e6, poissons_ratio = 0.3 }}\n[[boundary]]\n\
             select.face = \"lower_x\"\nfix = [\"x\", \"y\"]\n[time]\nstep = 0.05\nend = 0.25\n[linear]\n{linear}\n"
        );
        Scene::parse(&text, "t", std::path::Path::new("."), &[]).unwrap_or_else(|e| panic!("{e}"))
    };
    let run = |linear: &str| {
        let scene = scene(linear);
        let mut run = prepare::<2>(&scene).unwrap_or_else(|e| panic!("{linear}: {e}"));
        let entries = run.forecast(&scene).entries;
        while run.state.time < run.end {
            run.stepper.advance(&mut run.model, &mut run.state, run.end).unwrap_or_else(|e| panic!("{linear}: {e}"));
        }
        let counts = run.stepper.newton().expect("implicit").linear().counts();
        (run.state.values, run.model.has_pattern(), entries, counts)
    };
    let (reference, pattern, entries, _) = run("solver = \"ldlt\"");
    assert!(pattern && entries > 0);
    for solver in ["cg", "minres", "gmres"] {
        for preconditioner in ["block_jacobi", "multigrid"] {
            let text = format!(
                "solver = \"{solver}\"\npreconditioner = \"{preconditioner}\"\noperator = \"matrix_free\"\ntolerance = 1e-8"
            );
            let (values, pattern, entries, counts) = run(&text);
            assert!(!pattern && entries == 0, "{text}");
            let deviation = deviation(&values, &reference);
            assert!(deviation < 1e-8, "{text}: {deviation:e}");
            if preconditioner == "multigrid" {
                // The coarse matrices of the first Newton iteration serve the whole run.
                assert_eq!((counts.analyses, counts.factorisations), (1, 1), "{text}");
            }
        }
    }
}

/// A model whose entries would cost too much to be asked for, as those of far larger ones do.
struct Dear<'a>(&'a Model<3>);

impl Tangent for Dear<'_> {
    fn size(&self) -> usize {
        self.0.size()
    }

    fn symmetry(&self) -> Symmetry {
        self.0.symmetry()
    }

    fn apply(&self, v: &[f64], out: &mut [f64]) {
        self.0.apply(v, out);
    }

    fn blocks(&self) -> &[usize] {
        self.0.blocks()
    }

    fn offers_diagonal_blocks(&self) -> bool {
        self.0.offers_diagonal_blocks()
    }

    fn diagonal_blocks(&self, values: &mut [f64]) {
        self.0.diagonal_blocks(values);
    }

    fn geometry(&self) -> Option<Geometry> {
        self.0.geometry()
    }

    fn project(&self, tents: &Tents, coarse: &mut CoarseMatrix) -> bool {
        self.0.project(tents, coarse)
    }

    fn places(&self) -> Option<Places> {
        self.0.places()
    }

    fn effort(&self) -> Option<Effort> {
        self.0.effort().map(|effort| Effort { assembly: 1e5 * effort.action, ..effort })
    }
}

/// Some loads one after the other, as in steps of a run; the solver and its number of iterations in each.
fn solve_automatically(model: &Model<3>, options: AutomaticOptions) -> (LinearSolverInfo, Vec<usize>) {
    let mut solver = LinearSolverChoice::Automatic(options).build();
    let dear = Dear(model);
    let iterations = (0..6).map(|load| {
        let b: Vec<f64> = (0..model.size()).map(|i| ((i + 7 * load) as f64 * 0.7).sin()).collect();
        let mut x = vec![0.0; b.len()];
        solver.prepare(&dear).unwrap_or_else(|e| panic!("{e}"));
        let report = solver.solve(&dear, &b, &mut x, 1e-8).unwrap_or_else(|e| panic!("{e}"));
        let mut product = vec![0.0; b.len()];
        model.apply(&x, &mut product);
        assert!(deviation(&product, &b) < 1e-6);
        report.iterations
    });
    let iterations = iterations.collect();
    assert!(!model.has_pattern());
    (solver.info(), iterations)
}

#[test]
fn auto_turns_to_multigrid_for_long_steps_and_stays_with_block_jacobi_for_short_ones() {
    let column = |shift| linearised([6, 6, 24], Material::solid(1000.0, NEO, Transverse::Strain), shift);
    let (short, long) = (column(0.004), column(0.2));
    let (info, iterations) = solve_automatically(&short, AutomaticOptions::default());
    assert_eq!(info.name, "CG + block Jacobi", "{info:?} {iterations:?}");
    assert!(iterations.iter().all(|&k| k < 40), "{iterations:?}");

    let (info, iterations) = solve_automatically(&long, AutomaticOptions::default());
    assert_eq!(info.name, "CG + additive multigrid", "{info:?} {iterations:?}");
    assert!(info.reason.contains("iterations with block Jacobi were not enough"), "{info:?}");
    let krylov = KrylovOptions { operator: Operator::MatrixFree, ..Default::default() };
    let mut jacobi = LinearSolverChoice::Cg { krylov }.build();
    let b: Vec<f64> = (0..long.size()).map(|i| ((i + 35) as f64 * 0.7).sin()).collect();
    jacobi.prepare(&long).expect("prepared");
    let alone = jacobi.solve(&long, &b, &mut vec![0.0; b.len()], 1e-8).expect("solved").iterations;
    assert!(2 * alone > 3 * iterations[5], "{alone} {iterations:?}");

    // An equilibrium takes multigrid at once.
    let (info, first) = solve_automatically(&long, AutomaticOptions { direct: true, ..AutomaticOptions::default() });
    assert_eq!(info.name, "CG + additive multigrid", "{info:?}");
    assert!(info.reason.contains("ill-conditioned"), "{info:?}");
    assert_eq!(first[0].cmp(&alone), std::cmp::Ordering::Less, "{first:?}");
}

#[test]
fn multigrid_says_what_it_needs() {
    let setup = setup(particles([5, 5], 0.25, 0.0), 0.25, fluid());
    let mut model = Model::new(setup, Some(Unknowns::VelocityJacobian), None).expect("model");
    let state = model.initial_state().expect("state");
    model.begin_stage(0.0, 0.01, &state);
    let mut y = vec![0.0; model.unknown_count()];
    model.start_from(&state, &mut y);
    model.linearise(&y).expect("linearised");
    let preconditioner = Preconditioner::Multigrid(MultigridOptions::default());
    let krylov = KrylovOptions { preconditioner, operator: Operator::MatrixFree, ..Default::default() };
    let error = LinearSolverChoice::Gmres { restart: 20, krylov }.build().prepare(&model);
    assert_eq!(error, Err(LinearError::NeedsGeometry));
}

#[test]
fn the_same_bits_for_any_number_of_threads() {
    let model = linearised([24, 18], Material::solid(1000.0, NEO, Transverse::Strain), 0.2);
    let b: Vec<f64> = (0..model.size()).map(|i| (i as f64 * 0.7).sin()).collect();
    for smoothing in [0, 1] {
        let preconditioner = Preconditioner::Multigrid(MultigridOptions { smoothing, spacing: 2.0, coarsest: 50 });
        let krylov = KrylovOptions { preconditioner, operator: Operator::MatrixFree, ..Default::default() };
        let solve = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| {
                let mut solver = LinearSolverChoice::Cg { krylov: krylov.clone() }.build();
                let mut x = vec![0.0; b.len()];
                solver.prepare(&model).expect("regular");
                solver.solve(&model, &b, &mut x, 1e-8).expect("solved");
                x
            })
        };
        let reference = solve(1);
        for threads in [2, 3] {
            assert!(solve(threads).iter().zip(&reference).all(|(x, r)| x.to_bits() == r.to_bits()), "{threads}");
        }
    }
}
