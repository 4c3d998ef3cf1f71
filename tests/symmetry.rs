//! Symmetry of the tangent is declared term by term, not found by inspection. Here every declaration is held against
//! the assembled matrix: what is declared symmetric is so to rounding, what is declared general is not, and where the
//! symmetric part is said to stand for the whole, a few iterations with its factor solve the system.
#![allow(clippy::print_stdout, reason = "the measured table is a result, shown by --nocapture")]

mod support;

use nicolson::material::*;
use nicolson::model::{Model, Noise, Problem, Unknowns};
use nicolson::setup::*;
use nicolson_solvers::linear::{
    EliminationOrder, KrylovOptions, LinearSolverChoice, Preconditioner, PreconditionerMatrix, SparseMatrix, Symmetry,
};
use nicolson_solvers::nonlinear::NonlinearProblem;
use nicolson_solvers::time::{ConservingSystem, EquilibriumSystem, StageSystem};
use support::{fluid, linear, particles, setup};

fn stabilised(tau_v: f64, tau_p: f64, interface: InterfaceChoice) -> Option<Stabilisation> {
    Some(Stabilisation {
        tau_v,
        tau_p,
        deformed_wave_speed: true,
        corrected_gradient: false,
        interface,
        stress_jump: false,
        transverse_shear: false,
    })
}

fn laws() -> Vec<(&'static str, Material)> {
    let steel = |law| Material::solid(1000.0, law, Transverse::Strain);
    let (lambda, shear_modulus) = (1.5e5, 1e5);
    let volumetric = VolumetricForm::Logarithmic;
    let mooney = |bulk_modulus| MooneyRivlin { first: 3e4, second: 2e4, bulk_modulus, volumetric };
    let neo = steel(SolidLaw::NeoHookean(NeoHookean { lambda, shear_modulus, volumetric }));
    vec![
        ("linear volumetric", linear()),
        ("hyperelastic volumetric", fluid()),
        ("linear elastic", steel(SolidLaw::LinearElastic(LinearElastic { lambda, shear_modulus }))),
        ("St Venant–Kirchhoff", steel(SolidLaw::StVenantKirchhoff(StVenantKirchhoff { lambda, shear_modulus }))),
        ("neo-Hookean", neo),
        ("neo-Hookean, viscous", neo.with_viscosity(KelvinVoigt { shear: 300.0, bulk: 500.0 })),
        ("Mooney–Rivlin", steel(SolidLaw::MooneyRivlin(mooney(2e5)))),
        ("nearly incompressible", Material { solid: steel(SolidLaw::MooneyRivlin(mooney(0.0))).solid, ..fluid() }),
    ]
}

/// Largest `|A_ij − A_ji|` over the largest `|A_ij|`.
fn asymmetry(matrix: &SparseMatrix, model_pattern: impl Fn(usize) -> Vec<usize>) -> f64 {
    let (mut largest, mut difference) = (0.0_f64, 0.0_f64);
    for i in 0..matrix.size() {
        for j in model_pattern(i) {
            let (one, other) = (matrix.get(i, j), matrix.get(j, i));
            largest = largest.max(one.abs());
            difference = difference.max((one - other).abs());
        }
    }
    difference / largest
}

/// Poses a problem in general position and linearises it.
fn linearise<const D: usize>(model: &mut Model<D>, problem: Problem) {
    let state = model.initial_state().expect("state");
    let at = model.check_point(0.0, 0.01, &state, 0.03, 3).expect("check point");
    let mut unknowns = at.unknowns;
    match problem {
        Problem::Stage => model.begin_stage(at.time, at.shift, &at.base),
        Problem::Conserving => model.begin_conserving(at.time, 2.0 * at.shift, &at.base),
        Problem::Equilibrium => {
            model.begin_equilibrium(0.0, &state, &mut unknowns);
            let mut noise = Noise::new(5);
            unknowns.iter_mut().for_each(|u| *u += 0.01 * noise.next());
        }
    }
    model.linearise(&unknowns).expect("linearise");
}

/// Iterations of GMRES with the factor of the symmetric part, to 1e-8.
fn iterations<const D: usize>(model: &Model<D>) -> usize {
    let krylov = KrylovOptions {
        preconditioner: Preconditioner::Ldlt { order: EliminationOrder::default() },
        preconditioner_matrix: PreconditionerMatrix::SymmetricPart,
        ..KrylovOptions::default()
    };
    let mut solver = LinearSolverChoice::Gmres { restart: 50, krylov }.build();
    solver.prepare(model.tangent()).expect("factor");
    let mut noise = Noise::new(9);
    let right: Vec<f64> = (0..model.unknown_count()).map(|_| noise.next()).collect();
    let mut solution = vec![0.0; right.len()];
    solver.solve(model.tangent(), &right, &mut solution, 1e-8).expect("solve").iterations
}

fn check<const D: usize>(counts: [usize; D]) {
    let (mut symmetric, mut general) = (0, 0);
    for (name, law) in laws() {
        for (pairs, stabilisation) in [
            ("", None),
            (", D_v", stabilised(0.5, 0.0, InterfaceChoice::Constant)),
            (", D_v limited", stabilised(0.5, 0.0, InterfaceChoice::Limited)),
            (", D_p", stabilised(0.0, 0.5, InterfaceChoice::Constant)),
        ] {
            let coupled = stabilisation.is_some_and(|s| s.tau_p != 0.0);
            if coupled && !law.evolves_volume() {
                continue;
            }
            for volume_ratio in [VolumeRatioChoice::Determinant, VolumeRatioChoice::Evolved] {
                if volume_ratio == VolumeRatioChoice::Determinant && (coupled || !law.evolves_volume()) {
                    continue;
                }
                for problem in [Problem::Stage, Problem::Conserving, Problem::Equilibrium] {
                    let mut setup = setup(particles(counts, 0.25, 0.1), 0.25, law);
                    setup.bodies[0].volume_ratio = volume_ratio;
                    setup.bodies[0].hourglass = Some(1.0);
                    setup.stabilisation = stabilisation;
                    setup.constraints[0] = [Constraint::Fixed; D];
                    setup.constraints[1][0] = Constraint::Fixed;
                    let mut model = Model::new(setup, None, None).expect("model");
                    if problem != Problem::Stage && model.unknowns() != Unknowns::Velocity {
                        continue;
                    }
                    linearise(&mut model, problem);
                    let declared = model.declared(problem);
                    let matrix = model.tangent_matrix();
                    let tangent = model.tangent();
                    assert_eq!(tangent.symmetry(), declared.symmetry);
                    let pattern = tangent.pattern().expect("pattern");
                    let found = asymmetry(&matrix, |row| pattern.row(row).to_vec());
                    let what = format!("{D}D {name}{pairs}, {volume_ratio:?}, {problem:?}");
                    if declared.symmetry == Symmetry::General {
                        general += 1;
                        let iterations = if declared.nearly { iterations(&model) } else { 0 };
                        println!("{what}: general, asymmetry {found:.1e}, {iterations} iterations");
                        assert!(found > 1e-9, "{what}: declared general, but {found:e}");
                        assert!(iterations <= 12, "{what}: {iterations} iterations");
                        assert_eq!(declared.nearly, !coupled, "{what}");
                    } else {
                        symmetric += 1;
                        println!("{what}: {:?}, asymmetry {found:.1e}", declared.symmetry);
                        assert!(found < 1e-13, "{what}: declared symmetric, but {found:e}");
                        assert!(declared.nearly, "{what}");
                    }
                }
            }
        }
    }
    assert!(symmetric > 30 && general > 30, "{symmetric} and {general}");
}

#[test]
fn declared_symmetry_is_that_of_the_matrix_in_the_plane() {
    check([6, 5]);
}

#[test]
fn declared_symmetry_is_that_of_the_matrix_in_space() {
    check([4, 4, 3]);
}

#[test]
fn every_implicit_scheme_solves_a_fluid_without_upwinding_by_ldlt() {
    for scheme in ["crank_nicolson", "backward_euler", "midpoint", "tr_bdf2", "sdirk3", "generalised_alpha"] {
        let overrides = [("stabilisation.tau_v", "0"), ("time.scheme", scheme), ("time.end", "0.1")];
        let symmetry = |volume_ratio| {
            let own = [&overrides[..], &[("body.0.volume_ratio", volume_ratio)]].concat();
            let prepared = support::scenes::prepared::<2>("impact-hyperelastic", &own);
            (prepared.model.declared(Problem::Stage).symmetry, support::scenes::report("impact-hyperelastic", &own))
        };
        let (declared, report) = symmetry("auto");
        assert_eq!(declared, Symmetry::Symmetric, "{scheme}");
        assert!(report.linear.solver.starts_with("sparse LDLT"), "{scheme}: {}", report.linear.solver);
        assert_eq!(symmetry("evolved").0, Symmetry::General, "{scheme}");
    }
}
