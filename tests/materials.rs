//! One table of laws, and what must hold for every one of them in one, two and three dimensions: the stress is the
//! derivative of the energy, the tangent that of the stress, both are objective, small strains follow linear
//! elasticity, a step's discrete stress does exactly the work of the energy, and a collapsed particle is an error.

use approx::assert_relative_eq;
use nicolson::material::*;
use nicolson::model::Noise;
use nicolson::tensor::{CofactorSecant, Tensor, Tensor4, apply4, contract, determinant};

const LAMBDA: f64 = 3e6;
const MU: f64 = 1e6;

fn laws() -> Vec<(&'static str, SolidLaw)> {
    let neo = |volumetric| SolidLaw::NeoHookean(NeoHookean { lambda: LAMBDA, shear_modulus: MU, volumetric });
    let bulk_modulus = LAMBDA + 2.0 / 3.0 * MU;
    let mooney =
        |first, second, volumetric| SolidLaw::MooneyRivlin(MooneyRivlin { first, second, bulk_modulus, volumetric });
    use VolumetricForm::{Logarithmic, Quadratic};
    vec![
        ("linear elastic", SolidLaw::LinearElastic(LinearElastic { lambda: LAMBDA, shear_modulus: MU })),
        ("St Venant–Kirchhoff", SolidLaw::StVenantKirchhoff(StVenantKirchhoff { lambda: LAMBDA, shear_modulus: MU })),
        ("neo-Hookean, ln J", neo(Logarithmic)),
        ("neo-Hookean, J − 1", neo(Quadratic)),
        ("isochoric neo-Hookean", mooney(0.5 * MU, 0.0, Quadratic)),
        ("Mooney–Rivlin, ln J", mooney(0.3 * MU, 0.2 * MU, Logarithmic)),
        ("Mooney–Rivlin, J − 1", mooney(0.1 * MU, 0.4 * MU, Quadratic)),
    ]
}

fn random<const D: usize>(noise: &mut Noise, amount: f64) -> Tensor<D> {
    Tensor::identity() + Tensor::from_fn(|_, _| amount * noise.next())
}

fn rotation<const D: usize>(angle: f64) -> Tensor<D> {
    let (s, c) = angle.sin_cos();
    match D {
        1 => Tensor::identity(),
        2 => Tensor::from_fn(|i, j| [[c, -s], [s, c]][i][j]),
        // About z, then about x.
        _ => Tensor::from_fn(|i, j| [[c, -s * c, s * s], [s, c * c, -c * s], [0.0, s, c]][i][j]),
    }
}

fn solids<const D: usize>() -> Vec<(String, Solid)> {
    let transverse: &[Transverse] =
        if D == 3 { &[Transverse::Strain] } else { &[Transverse::Strain, Transverse::Stress] };
    let mut list = Vec::new();
    for (name, law) in laws() {
        for &transverse in transverse {
            list.push((format!("{name}, {D}D, {transverse:?}"), Solid { law, transverse }));
        }
    }
    list
}

fn largest<const D: usize>(t: &Tensor4<D>) -> f64 {
    t.iter().flatten().flat_map(|a| a.iter()).fold(0.0, |m: f64, v| m.max(v.abs()))
}

fn derivatives<const D: usize>() {
    let mut noise = Noise::new(3);
    for (what, solid) in solids::<D>() {
        for amount in [0.0, 0.05, 0.25] {
            let (f, direction) = (random::<D>(&mut noise, amount), random::<D>(&mut noise, 1.0));
            let h = 1e-5;
            let energy = |f: Tensor<D>| solid.energy(&f);
            let slope = (energy(f + direction * h) - energy(f - direction * h)) / (2.0 * h);
            let stress = solid.stress(&f).expect("inside the domain");
            assert_relative_eq!(contract(&stress, &direction), slope, epsilon = 1e-8 * LAMBDA);
            let at = |f: Tensor<D>| solid.stress(&f).expect("inside the domain");
            let numeric = (at(f + direction * h) - at(f - direction * h)) / (2.0 * h);
            let tangent = solid.tangent(&f).expect("inside the domain");
            let error = (apply4(&tangent, &direction) - numeric).norm();
            assert!(error < 2e-7 * largest(&tangent), "{what}: {error:e}");
            // Major symmetry, without which the tangent matrix would not be symmetric.
            let other = random::<D>(&mut noise, 1.0);
            assert_relative_eq!(
                contract(&apply4(&tangent, &direction), &other),
                contract(&apply4(&tangent, &other), &direction),
                epsilon = 1e-12 * largest(&tangent)
            );
        }
    }
}

#[test]
fn stress_and_tangent_are_derivatives_of_the_energy() {
    derivatives::<1>();
    derivatives::<2>();
    derivatives::<3>();
}

fn small_strains<const D: usize>() {
    for (what, solid) in solids::<D>() {
        let rest = Tensor::<D>::identity();
        assert!(solid.energy(&rest).abs() < 1e-9, "{what}: energy at rest");
        assert!(solid.stress(&rest).expect("rest").norm() < 1e-9 * MU, "{what}: stress at rest");
        let lambda = match (&solid.law, solid.transverse, D) {
            (SolidLaw::LinearElastic(_), _, _) | (_, Transverse::Strain, _) | (_, _, 3) => LAMBDA,
            (_, Transverse::Stress, 2) => 2.0 * LAMBDA * MU / (LAMBDA + 2.0 * MU),
            (_, Transverse::Stress, _) => LAMBDA * MU / (LAMBDA + MU),
        };
        let linear = LinearElastic { lambda, shear_modulus: MU };
        let (tangent, expected) = (solid.tangent(&rest).expect("rest"), linear.tangent::<D>());
        let mut noise = Noise::new(5);
        let direction = random::<D>(&mut noise, 1.0);
        let error = (apply4(&tangent, &direction) - apply4(&expected, &direction)).norm();
        assert!(error < 1e-9 * LAMBDA, "{what}: {error:e}");
        // Speeds of waves follow from the same moduli.
        let material = Material::solid(1000.0, solid.law, solid.transverse);
        assert_relative_eq!(material.wave_speed(), ((LAMBDA + 2.0 * MU) / 1000.0_f64).sqrt(), max_relative = 1e-12);
        assert_relative_eq!(material.shear_wave_speed(), (MU / 1000.0_f64).sqrt(), max_relative = 1e-12);
    }
}

#[test]
fn small_strains_follow_linear_elasticity() {
    small_strains::<1>();
    small_strains::<2>();
    small_strains::<3>();
}

fn objectivity<const D: usize>() {
    let mut noise = Noise::new(9);
    for (what, solid) in solids::<D>() {
        if solid.is_linear() {
            continue;
        }
        let (f, q) = (random::<D>(&mut noise, 0.2), rotation::<D>(2.0));
        let (plain, turned) = (solid.stress(&f).expect("inside"), solid.stress(&(q * f)).expect("inside"));
        assert!((q * plain - turned).norm() < 1e-12 * LAMBDA, "{what}");
        assert_relative_eq!(solid.energy(&f), solid.energy(&(q * f)), epsilon = 1e-12 * LAMBDA);
        // Kirchhoff stress is symmetric: no torque.
        let torque = plain * f.transpose();
        assert!((torque - torque.transpose()).norm() < 1e-12 * LAMBDA, "{what}");
    }
}

#[test]
fn laws_are_objective() {
    objectivity::<2>();
    objectivity::<3>();
}

fn chords<const D: usize>() {
    let mut noise = Noise::new(13);
    for (what, solid) in solids::<D>() {
        if !solid.has_conserving_stress::<D>() {
            continue;
        }
        // Down to steps so small that a quotient of energies would be noise.
        for step in [0.3, 1e-2, 1e-6, 0.0] {
            let (start, direction) = (random::<D>(&mut noise, 0.2), random::<D>(&mut noise, 1.0));
            let mean = start + direction * (0.5 * step);
            let secant = |mean: Tensor<D>| CofactorSecant::new(start, mean).expect("positive volume");
            let stress = solid.conserving_stress(&secant(mean));
            let end = secant(mean).end;
            let work = contract(&stress, &(end - start));
            let change = solid.energy(&end) - solid.energy(&start);
            let scale = LAMBDA * (1.0 + end.norm().powi(4));
            assert!((work - change).abs() < 1e-14 * scale, "{what}, {step}: {work:e} {change:e}");
            let middle = solid.stress(&mean).expect("inside");
            assert!((stress - middle).norm() < scale * (2.0 * step * step + 1e-14), "{what}, {step}");
            if !solid.is_linear() {
                let torque = stress * mean.transpose();
                assert!((torque - torque.transpose()).norm() < 1e-13 * scale, "{what}, {step}");
            }
            let (h, vary) = (1e-6, random::<D>(&mut noise, 1.0));
            let at = |h: f64| solid.conserving_stress(&secant(mean + vary * h));
            let numeric = (at(h) - at(-h)) / (2.0 * h);
            let error = (apply4(&solid.conserving_tangent(&secant(mean)), &vary) - numeric).norm();
            assert!(error < 1e-7 * scale, "{what}, {step}: {error:e}");
        }
    }
}

#[test]
fn the_discrete_stress_of_a_step_does_exactly_the_work_of_the_energy() {
    chords::<1>();
    chords::<2>();
    chords::<3>();
}

#[test]
fn a_collapsed_particle_is_outside_the_domain() {
    for (what, law) in laws() {
        let material = Material::solid(1000.0, law, Transverse::Strain);
        assert_eq!(material.needs_positive_determinant(), !matches!(law, SolidLaw::LinearElastic(_)), "{what}");
    }
}

/// Plane stress against the three-dimensional law with the outer stretch that frees the outer face.
#[test]
fn plane_stress_leaves_no_stress_across() {
    let mut noise = Noise::new(17);
    for (what, law) in laws() {
        if matches!(law, SolidLaw::LinearElastic(_)) {
            continue;
        }
        let plane = Solid { law, transverse: Transverse::Stress };
        let whole = Solid { law, transverse: Transverse::Strain };
        let f = random::<2>(&mut noise, 0.25);
        let (ratio, pressure) = plane.pressure(&f);
        let outer = ratio / determinant(&f);
        let embedded = Tensor::<3>::from_fn(|i, j| match (i, j) {
            (2, 2) => outer,
            (2, _) | (_, 2) => 0.0,
            _ => f[(i, j)],
        });
        let stress = whole.stress(&embedded).expect("inside");
        assert!(stress[(2, 2)].abs() < 1e-9 * LAMBDA, "{what}: {:e}", stress[(2, 2)]);
        let in_plane = plane.stress(&f).expect("inside");
        for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            assert_relative_eq!(in_plane[(i, j)], stress[(i, j)], epsilon = 1e-9 * LAMBDA);
        }
        assert_relative_eq!(pressure, whole.pressure(&embedded).1, epsilon = 1e-9 * LAMBDA);
        // Uniaxial stress: the same in both directions across.
        let stretch = Tensor::<1>::from_element(1.3);
        let (ratio, _) = plane.pressure(&stretch);
        let across = (ratio / 1.3).sqrt();
        let embedded = Tensor::<3>::from_diagonal(&nalgebra::Vector3::new(1.3, across, across));
        let stress = whole.stress(&embedded).expect("inside");
        assert!(stress[(1, 1)].abs() < 1e-9 * LAMBDA && stress[(2, 2)].abs() < 1e-9 * LAMBDA, "{what}");
        let uniaxial = plane.stress(&stretch).expect("inside")[(0, 0)];
        assert_relative_eq!(uniaxial, stress[(0, 0)], epsilon = 1e-9 * LAMBDA);
    }
}

/// Plane strain against the three-dimensional law, pressure included.
#[test]
fn plane_strain_is_the_three_dimensional_law() {
    let mut noise = Noise::new(19);
    for (what, law) in laws() {
        let solid = Solid { law, transverse: Transverse::Strain };
        let f = random::<2>(&mut noise, 0.25);
        let embedded = Tensor::<3>::from_fn(|i, j| match (i, j) {
            (2, 2) => 1.0,
            (2, _) | (_, 2) => 0.0,
            _ => f[(i, j)],
        });
        let (plane, whole) = (solid.stress(&f).expect("inside"), solid.stress(&embedded).expect("inside"));
        let difference = plane - Tensor::<2>::from_fn(|i, j| whole[(i, j)]);
        assert!(difference.norm() < 1e-12 * LAMBDA, "{what}");
        assert_relative_eq!(solid.pressure(&f).1, solid.pressure(&embedded).1, epsilon = 1e-12 * LAMBDA);
        assert_relative_eq!(solid.energy(&f), solid.energy(&embedded), epsilon = 1e-12 * LAMBDA);
    }
}

fn viscosity<const D: usize>() {
    let mut noise = Noise::new(23);
    let law = KelvinVoigt { shear: 30.0, bulk: 50.0 };
    let (f, l) = (random::<D>(&mut noise, 0.2), random::<D>(&mut noise, 3.0));
    assert_relative_eq!(contract(&law.stress(&f, &l), &l), law.dissipation(&f, &l), max_relative = 1e-12);
    assert!(law.dissipation(&f, &l) > 0.0);
    // A turning body feels nothing: L = Ω F with antisymmetric Ω.
    let spin = random::<D>(&mut noise, 1.0);
    let spin = (spin - spin.transpose()) * f;
    assert!(law.stress(&f, &spin).norm() < 1e-11);
    let (by_deformation, by_rate) = law.tangents(&f, &l);
    let (h, direction) = (1e-6, random::<D>(&mut noise, 1.0));
    let numeric = (law.stress(&(f + direction * h), &l) - law.stress(&(f - direction * h), &l)) / (2.0 * h);
    assert!((apply4(&by_deformation, &direction) - numeric).norm() < 1e-6);
    let numeric = (law.stress(&f, &(l + direction * h)) - law.stress(&f, &(l - direction * h))) / (2.0 * h);
    assert!((apply4(&by_rate, &direction) - numeric).norm() < 1e-6);
}

#[test]
fn viscosity_dissipates_and_does_not_resist_rotation() {
    viscosity::<1>();
    viscosity::<2>();
    viscosity::<3>();
}
