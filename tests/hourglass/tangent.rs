//! The tangent is exact, assembled and as an action, with every kind of unknowns.

use nicolson::model::{CheckPoint, Model, Noise, Unknowns};
use nicolson::setup::*;
use nicolson_solvers::nonlinear::NonlinearProblem;

use super::SPACING;
use super::support::scenes::distance;
use super::support::{fluid, linear, particles, setup};

fn tangent_is_exact<const D: usize>(counts: [usize; D]) {
    let stabilisation = Stabilisation {
        tau_v: 0.5,
        tau_p: 0.7,
        deformed_wave_speed: true,
        corrected_gradient: false,
        interface: InterfaceChoice::Constant,
        stress_jump: false,
        transverse_shear: true,
    };
    for (law, stabilisation) in [(linear(), None), (fluid(), None), (fluid(), Some(stabilisation))] {
        for unknowns in [None, Some(Unknowns::VelocityJacobian), Some(Unknowns::Full)] {
            let mut setup = setup(particles(counts, SPACING, 0.1), SPACING, law);
            setup.bodies[0].hourglass = Some(1.7);
            setup.stabilisation = stabilisation;
            for (constraint, x) in setup.constraints.iter_mut().zip(&setup.particles.positions) {
                if x[D - 1] == 0.0 {
                    constraint[D - 1] = Constraint::Fixed;
                }
            }
            setup.constraints[0] = [Constraint::Fixed; D];
            let mut model = Model::<D>::new(setup, unknowns, None).expect("model");
            let what = format!("{D}D {law:?} {stabilisation:?} {:?}", model.unknowns());
            let state = model.initial_state().expect("state");
            let at = model.check_point(0.0, 0.02, &state, 0.04, 3).expect("check point");
            let selections = model.term_selections();
            assert!(selections.iter().any(|(name, _)| *name == "hourglass"));
            for selection in selections {
                let report = model.taylor(&at, selection, &[1e-2, 1e-3, 1e-4, 1e-5], 11).expect("Taylor");
                for block in &report.blocks {
                    assert!(block.deviation(200.0) < 0.01, "{what}, {}: {block:?}", selection.0);
                    assert!(selection.0 != "hourglass" || block.is_linear(), "{what}: {block:?}");
                }
            }
            let mut points = vec![at.clone()];
            if model.unknowns() == Unknowns::Velocity {
                points.push(CheckPoint { conserving: true, ..at });
            }
            for at in points {
                let differences = model.compare_with_differences(&at).expect("differences");
                assert!(differences.largest_error < 2e-6, "{what}: {differences:?}");
                assert!(differences.outside_pattern < 1e-9, "{what}: {differences:?}");
                model.linearise(&at.unknowns).expect("linearise");
                let matrix = model.tangent_matrix();
                let mut noise = Noise::new(5);
                let v: Vec<f64> = at.unknowns.iter().map(|_| noise.next()).collect();
                let (mut action, mut product) = (vec![0.0; v.len()], vec![0.0; v.len()]);
                model.tangent().apply(&v, &mut action);
                matrix.apply(&v, &mut product);
                let error = distance(&product, &action);
                assert!(error < 1e-12, "{what}: action and entries differ by {error:e}");
            }
        }
    }
}

#[test]
fn the_tangent_is_exact_in_one_dimension() {
    tangent_is_exact([12]);
}

#[test]
fn the_tangent_is_exact_in_two_dimensions() {
    tangent_is_exact([6, 5]);
}

#[test]
fn the_tangent_is_exact_in_three_dimensions() {
    tangent_is_exact([4, 3, 3]);
}
