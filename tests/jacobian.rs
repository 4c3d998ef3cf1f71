//! The analytic Jacobian of every term: Taylor remainders as in Table 6.1 of document 004, a
//! comparison of every entry with differences, and entries against the matrix-free action.

mod support;

use nicolson::material::*;
use nicolson::model::{CheckPoint, Model, Noise, Unknowns};
use nicolson::setup::*;
use nicolson_solvers::nonlinear::NonlinearProblem;
use support::{fluid, linear, particles, setup};

const EPSILONS: [f64; 5] = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6];

fn stabilised(tau_v: f64, tau_p: f64) -> Stabilisation {
    Stabilisation {
        tau_v,
        tau_p,
        deformed_wave_speed: true,
        corrected_gradient: false,
        interface: InterfaceChoice::Constant,
        stress_jump: false,
        transverse_shear: true,
    }
}

/// Every combination of law, cofactor and stabilisation that changes a derivative.
fn variants() -> Vec<(String, Material, CofactorChoice, Option<Stabilisation>)> {
    let mut list = Vec::new();
    for (law_name, law) in [("linear", linear()), ("hyperelastic", fluid())] {
        for cofactor in [CofactorChoice::Geometric, CofactorChoice::Evolved] {
            let base = stabilised(0.5, 0.7);
            for (name, stabilisation) in [
                ("plain", None),
                ("D_v", Some(stabilised(0.5, 0.0))),
                ("D_v, constant c", Some(Stabilisation { deformed_wave_speed: false, ..stabilised(0.5, 0.0) })),
                (
                    "D_v reconstructed",
                    Some(Stabilisation { interface: InterfaceChoice::Reconstructed, ..stabilised(0.5, 0.0) }),
                ),
                ("D_p", Some(stabilised(0.0, 0.7))),
                ("both", Some(base)),
                ("both, as printed", Some(Stabilisation { stress_jump: true, corrected_gradient: true, ..base })),
                ("both, reconstructed", Some(Stabilisation { interface: InterfaceChoice::Reconstructed, ..base })),
                ("D_v limited", Some(Stabilisation { interface: InterfaceChoice::Limited, ..stabilised(0.5, 0.0) })),
                ("both, limited", Some(Stabilisation { interface: InterfaceChoice::Limited, ..base })),
                (
                    "both, limited stress",
                    Some(Stabilisation { interface: InterfaceChoice::Limited, stress_jump: true, ..base }),
                ),
                (
                    "both, reconstructed stress",
                    Some(Stabilisation { interface: InterfaceChoice::Reconstructed, stress_jump: true, ..base }),
                ),
            ] {
                list.push((format!("{law_name}, {cofactor:?}, {name}"), law, cofactor, stabilisation));
            }
        }
    }
    let steel = |law| Material::solid(1000.0, law, Transverse::Strain);
    let (lambda, shear_modulus) = (1.5e5, 1e5);
    let viscosity = KelvinVoigt { shear: 300.0, bulk: 500.0 };
    let volumetric = VolumetricForm::Logarithmic;
    let mooney = |bulk_modulus| MooneyRivlin { first: 3e4, second: 2e4, bulk_modulus, volumetric };
    let nearly_incompressible = Material { solid: steel(SolidLaw::MooneyRivlin(mooney(0.0))).solid, ..fluid() };
    let neo = steel(SolidLaw::NeoHookean(NeoHookean { lambda, shear_modulus, volumetric }));
    for (name, law, stabilisation) in [
        ("linear elastic", steel(SolidLaw::LinearElastic(LinearElastic { lambda, shear_modulus })), None),
        ("St Venant–Kirchhoff", steel(SolidLaw::StVenantKirchhoff(StVenantKirchhoff { lambda, shear_modulus })), None),
        ("neo-Hookean, D_v", neo, Some(stabilised(0.5, 0.0))),
        (
            "neo-Hookean, D_v limited",
            neo,
            Some(Stabilisation { interface: InterfaceChoice::Limited, ..stabilised(0.5, 0.0) }),
        ),
        ("neo-Hookean, viscous", neo.with_viscosity(viscosity), None),
        ("Mooney–Rivlin", steel(SolidLaw::MooneyRivlin(mooney(2e5))), None),
        ("nearly incompressible", nearly_incompressible, Some(stabilised(0.5, 0.7))),
        ("nearly incompressible, viscous", nearly_incompressible.with_viscosity(viscosity), None),
    ] {
        list.push((name.into(), law, CofactorChoice::Geometric, stabilisation));
    }
    list
}

fn model<const D: usize>(
    counts: [usize; D],
    law: Material,
    cofactor: CofactorChoice,
    stabilisation: Option<Stabilisation>,
    unknowns: Option<Unknowns>,
    volume_ratio: VolumeRatioChoice,
) -> Model<D> {
    let spacing = 0.25;
    let mut setup = setup(particles(counts, spacing, 0.1), spacing, law);
    setup.bodies[0].cofactor = cofactor;
    setup.bodies[0].volume_ratio = volume_ratio;
    if volume_ratio == VolumeRatioChoice::Determinant {
        // J then differs from det F.
        setup.initial.pressure = Some(vec![500.0; setup.particles.positions.len()]);
    }
    setup.stabilisation = stabilisation;
    // A roller and a clamp, so that constrained components are part of the check.
    for (constraint, x) in setup.constraints.iter_mut().zip(&setup.particles.positions) {
        if x[D - 1] == 0.0 {
            constraint[D - 1] = Constraint::Fixed;
        }
    }
    setup.constraints[0] = [Constraint::Fixed; D];
    Model::new(setup, unknowns, None).expect("model")
}

fn check<const D: usize>(counts: [usize; D]) {
    let shift = 0.02;
    for (name, law, cofactor, stabilisation) in variants() {
        let follows = law.evolves_volume() && stabilisation.is_none_or(|s| s.tau_p == 0.0);
        let kinds = [None, Some(Unknowns::VelocityJacobian), Some(Unknowns::Full)];
        let determinant = follows.then_some((None, VolumeRatioChoice::Determinant));
        let cases = kinds.map(|kind| (kind, VolumeRatioChoice::Evolved)).into_iter().chain(determinant);
        for (unknowns, volume_ratio) in cases {
            let mut model = model(counts, law, cofactor, stabilisation, unknowns, volume_ratio);
            let what = format!("{D}D {name}, {:?}, {volume_ratio:?}", model.unknowns());
            // Small enough for the cubic remainder to stay below a hundredth of the quadratic one in every law.
            let epsilons = &[3e-3, 1e-3, 3e-4, 1e-4, 1e-5].map(|epsilon| epsilon * model.taylor_scale());
            let state = model.initial_state().expect("state");
            let at = model.check_point(0.0, shift, &state, 0.04, 3).expect("check point");
            for selection in model.term_selections() {
                let report = model.taylor(&at, selection, epsilons, 11).expect("Taylor");
                for block in &report.blocks {
                    // A ratio is only as good as the remainder's distance from rounding.
                    let deviation = block.deviation(200.0);
                    assert!(deviation < 0.01, "{what}, {}, block {}: {block:?}", selection.0, block.block);
                }
                if selection.0 == "all" && law == fluid() && D > 1 {
                    let v = &report.blocks[0];
                    assert!(!v.is_linear(), "{what}: the check must bite: {v:?}");
                }
            }
            let mut points = vec![at.clone()];
            if model.unknowns() == Unknowns::Velocity {
                points.push(CheckPoint { conserving: true, ..at });
            }
            for at in points {
                let what = format!("{what}, conserving: {}", at.conserving);
                let report = model.taylor(&at, model.term_selections()[0], epsilons, 11).expect("Taylor");
                assert!(report.blocks[0].deviation(200.0) < 0.01, "{what}: {report:?}");
                let differences = model.compare_with_differences(&at).expect("differences");
                assert!(differences.largest_error < 2e-6, "{what}: {differences:?}");
                assert!(differences.outside_pattern < 1e-9, "{what}: {differences:?}");
                action_agrees_with_entries(&mut model, &at.unknowns, &what);
            }
        }
    }
}

fn action_agrees_with_entries<const D: usize>(model: &mut Model<D>, y: &[f64], what: &str) {
    model.linearise(y).expect("linearise");
    let matrix = model.tangent_matrix();
    let mut noise = Noise::new(5);
    let v: Vec<f64> = y.iter().map(|_| noise.next()).collect();
    let (mut action, mut product) = (vec![0.0; v.len()], vec![0.0; v.len()]);
    model.tangent().apply(&v, &mut action);
    matrix.apply(&v, &mut product);
    let scale = product.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    // The one-ring part holds some of the same entries, and no others.
    let sparser = model.tangent().sparser().expect("one-ring part");
    let pattern = sparser.pattern().expect("entries").clone();
    let mut near = vec![0.0; pattern.entries()];
    sparser.fill(&mut near);
    for row in 0..pattern.size() {
        for (entry, column) in pattern.row(row).iter().enumerate() {
            assert_eq!(near[pattern.offsets()[row] + entry], matrix.get(row, *column), "{what}");
        }
    }
    for (a, p) in action.iter().zip(&product) {
        assert!((a - p).abs() < 1e-12 * scale, "{what}: action {a} against entries {p}");
    }
}

#[test]
fn jacobian_1d_every_law_and_term() {
    check::<1>([12]);
}

#[test]
fn jacobian_2d_every_law_and_term() {
    check::<2>([6, 5]);
}

#[test]
fn jacobian_3d_every_law_and_term() {
    check::<3>([4, 4, 3]);
}

#[test]
fn table_6_1_ratio_is_constant_over_five_decades() {
    // As printed: 30 particles in a square domain, ε from 1e-2 to 1e-6, ratio constant to its digits.
    let mut model = model(
        [6, 5],
        fluid(),
        CofactorChoice::Geometric,
        Some(stabilised(1.0, 0.0)),
        Some(Unknowns::Full),
        VolumeRatioChoice::Auto,
    );
    let state = model.initial_state().expect("state");
    let at = model.check_point(0.0, 0.05, &state, 0.04, 1).expect("check point");
    let selection = model.term_selections()[0];
    let report = model.taylor(&at, selection, &EPSILONS, 2).expect("Taylor");
    let v = &report.blocks[0];
    for row in &v.rows {
        assert!((row.ratio / v.rows[2].ratio - 1.0).abs() < 0.01, "{v:?}");
    }
    // The displacement equation is linear: nothing but rounding.
    assert!(report.blocks[2].is_linear(), "{report:?}");
}
