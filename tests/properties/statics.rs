//! Properties of a single state.

use nalgebra::Rotation2;
use nalgebra::Rotation3;
use nicolson::model::{CheckPoint, Model, Noise, Problem, Unknowns};
use nicolson::tensor::{Tensor, Vector, vector_at};
use nicolson_solvers::linear::Symmetry;
use nicolson_solvers::nonlinear::NonlinearProblem;
use nicolson_solvers::time::{ConservingSystem, StageSystem};

use super::Verdict;
use super::case::{Case, Random};

/// Calls the check of the case's dimension with its model and state.
macro_rules! in_dimension {
    ($case:expr, $check:ident) => {
        match $case.dimension {
            1 => with::<1>($case, $check::<1>),
            2 => with::<2>($case, $check::<2>),
            _ => with::<3>($case, $check::<3>),
        }
    };
}

fn with<const D: usize>(
    case: &Case,
    check: impl FnOnce(&Case, &mut Model<D>, &[f64]) -> Result<f64, String>,
) -> Verdict {
    let built = case.scene().and_then(|scene| {
        let (setup, _) = scene.setup::<D>().map_err(|errors| errors.to_string())?;
        let mut model = Model::new(setup, None, None).map_err(|error| error.to_string())?;
        let state = model.initial_state().map_err(|error| error.to_string())?;
        Ok((model, state))
    });
    match built {
        Err(why) => Verdict::Impossible(why),
        Ok((mut model, state)) => match check(case, &mut model, &state) {
            Ok(figure) => Verdict::Holds(figure),
            Err(why) => Verdict::Fails(why),
        },
    }
}

fn forces<const D: usize>(model: &mut Model<D>, state: &[f64]) -> Result<Vec<f64>, String> {
    let mut forces = Vec::new();
    model.forces_at(0.0, state, &mut forces).map_err(|error| error.to_string())?;
    Ok(forces)
}

fn no_worse(figure: f64, most: f64, what: &str) -> Result<f64, String> {
    if figure <= most { Ok(figure) } else { Err(format!("{what}: {figure:e}, at most {most:e}")) }
}

/// Sum and moment of the internal forces vanish to rounding. Linear elasticity has no moment about the places at rest.
pub fn momenta(case: &Case) -> Verdict {
    in_dimension!(case, momenta_of)
}

fn momenta_of<const D: usize>(case: &Case, model: &mut Model<D>, state: &[f64]) -> Result<f64, String> {
    let forces = forces(model, state)?;
    let n = model.particles();
    let at_rest = case.law.name == "linear_elastic";
    let place = |a: usize| if at_rest { model.setup().particles.positions[a] } else { model.position(state, a) };
    let middle = (0..n).map(place).sum::<Vector<D>>() / n as f64;
    let (mut sum, mut moment) = (Vector::<D>::zeros(), Tensor::<D>::zeros());
    // Rounding is that of the summands, which are larger than the forces.
    let (mut size, mut arm) = (0.0_f64, 0.0_f64);
    for a in 0..n {
        let (force, place) = (vector_at::<D>(&forces, a), place(a) - middle);
        sum += force;
        moment += force * place.transpose() - place * force.transpose();
        size += force.norm();
        arm = arm.max(place.norm());
    }
    let size = size.max(summands(case, model));
    let linear = no_worse(sum.norm() / size, 1e-13, "resultant of the internal forces over their sizes")?;
    if at_rest && (case.tau[0] != 0.0 || case.law.viscosity > 0.0) {
        // D_v and viscosity have no moment about the places of now.
        return Ok(linear);
    }
    let angular = moment.norm() / (size * arm);
    // As exact as the gradients of linear fields, which balancing solves for.
    Ok(linear.max(no_worse(angular, 1e-11, "moment of the internal forces over their sizes")?))
}

/// Size of the summands of all forces, N: what rounding is relative to.
fn summands<const D: usize>(case: &Case, model: &Model<D>) -> f64 {
    let volumes = &model.setup().particles.volumes;
    let gradient = model.gradient();
    let weights = |a: usize| gradient.weights_of(a).iter().map(|weight| weight.norm()).sum::<f64>();
    let law = model.material(0);
    let modulus = law.density * law.wave_speed().powi(2);
    (case.strain + case.rate).max(1e-3) * modulus * (0..volumes.len()).map(|a| volumes[a] * weights(a)).sum::<f64>()
}

/// `f = −dE/du`: central differences leave third order, and nothing else.
pub fn energy(case: &Case) -> Verdict {
    in_dimension!(case, energy_of)
}

fn energy_of<const D: usize>(case: &Case, model: &mut Model<D>, state: &[f64]) -> Result<f64, String> {
    let forces = forces(model, state)?;
    let n = model.particles() * D;
    let mut noise = Noise::new(case.state);
    let direction: Vec<f64> = (0..n).map(|_| noise.next() * model.smallest_distance()).collect();
    let (mut power, mut size) = (0.0, 0.0);
    for (force, way) in forces.iter().zip(&direction) {
        power += force * way;
        size += (force * way).abs();
    }
    let size = size.max(1e-2 * summands(case, model) * model.smallest_distance());
    let stored = |epsilon: f64| {
        let moved: Vec<f64> =
            state.iter().enumerate().map(|(i, y)| y + epsilon * direction.get(i).unwrap_or(&0.0)).collect();
        let energies = model.energies(&moved);
        energies.internal + energies.hourglass
    };
    let scale = stored(0.0).abs();
    let error = |epsilon: f64| {
        let change = stored(epsilon) - stored(-epsilon);
        ((change / (2.0 * epsilon) + power).abs() / size, 1e-14 * scale / (epsilon * size))
    };
    let (coarse, _) = error(4e-3);
    let (middle, noise) = error(1e-3);
    if !(coarse.is_finite() && middle.is_finite()) {
        return Err(format!("energies are not finite: {coarse}, {middle}"));
    }
    // Order 2 is a factor of 16; a coefficient that happens to vanish leaves more of the next order.
    no_worse(middle, (coarse / 8.0).max(1e-7) + noise, "error of the force at a quarter of a perturbation")?;
    let (fine, noise) = error(1e-4);
    no_worse(fine, 1e-5 + noise, "force and gradient of the energy differ")
}

/// Forces turn with the state, and do not feel a shift; spinning at constant rate adds no force. Linear elasticity is not
/// objective, and not asked.
pub fn objectivity(case: &Case) -> Verdict {
    in_dimension!(case, objectivity_of)
}

fn objectivity_of<const D: usize>(case: &Case, model: &mut Model<D>, state: &[f64]) -> Result<f64, String> {
    if case.law.name == "linear_elastic" {
        return Ok(0.0);
    }
    let random = &mut Random::new(case.state ^ 0x55);
    let (turn, spin) = rotation::<D>(random);
    // Reconstruction is exact for velocities that are linear in the places at rest; a spin of a deformed body is not.
    let spin = if case.tau[0] == 0.0 || case.interface == "constant" { spin } else { Tensor::zeros() };
    let shift = Vector::<D>::from_fn(|_, _| random.between(-1.0, 1.0) * case.size());
    let n = model.particles();
    let mut turned = state.to_vec();
    for a in 0..n {
        let rest = model.setup().particles.positions[a];
        let place = turn * (rest + vector_at::<D>(state, a));
        let velocity = turn * vector_at::<D>(&state[n * D..], a) + spin * place * (0.1 * case.speed() / case.size());
        for i in 0..D {
            turned[a * D + i] = place[i] - rest[i] + shift[i];
            turned[(n + a) * D + i] = velocity[i] + shift[i] / case.size() * case.speed();
        }
    }
    let (before, after) = (forces(model, state)?, forces(model, &turned)?);
    let (mut largest, mut size) = (0.0_f64, summands(case, model) / n as f64);
    for a in 0..n {
        largest = largest.max((turn * vector_at::<D>(&before, a) - vector_at::<D>(&after, a)).norm());
        size = size.max(vector_at::<D>(&before, a).norm());
    }
    no_worse(largest / size, 1e-9, "forces of the turned state against turned forces")
}

/// A turn by any angle, and the spin `dR/dt Rᵀ` of a unit rate.
fn rotation<const D: usize>(random: &mut Random) -> (Tensor<D>, Tensor<D>) {
    let mut turn = Tensor::<D>::identity();
    let mut spin = Tensor::<D>::zeros();
    let axis: [f64; 3] = std::array::from_fn(|_| random.between(-3.0, 3.0));
    if D == 2 {
        let matrix = Rotation2::new(axis[0]);
        (0..4).for_each(|i| turn[(i / 2 % D, i % 2 % D)] = matrix[(i / 2, i % 2)]);
        (spin[(0, 1 % D)], spin[(1 % D, 0)]) = (-1.0, 1.0);
    } else if D == 3 {
        let matrix = Rotation3::from_scaled_axis(axis.into());
        let cross = nalgebra::Vector3::from(axis).cross_matrix();
        for i in 0..9 {
            turn[(i / 3 % D, i % 3 % D)] = matrix[(i / 3, i % 3)];
            spin[(i / 3 % D, i % 3 % D)] = cross[(i / 3, i % 3)];
        }
    }
    (turn, spin)
}

/// Entries are derivatives, the pattern misses nothing, and declared symmetry is there.
pub fn tangent(case: &Case) -> Verdict {
    in_dimension!(case, tangent_of)
}

fn tangent_of<const D: usize>(case: &Case, model: &mut Model<D>, state: &[f64]) -> Result<f64, String> {
    let shift =
        Random::new(case.state ^ 0x77).between(0.1, 2.0) * model.smallest_distance() / model.material(0).wave_speed();
    let at = model.check_point(0.0, shift, state, 0.02, case.state).map_err(|error| error.to_string())?;
    let mut points = vec![(at.clone(), Problem::Stage)];
    let conserving = case.is_solid() && !case.law.plane_stress || !case.is_solid();
    if model.unknowns() == Unknowns::Velocity && conserving {
        points.push((CheckPoint { conserving: true, ..at }, Problem::Conserving));
    }
    let mut worst = 0.0_f64;
    for (at, problem) in points {
        let what = if at.conserving { "conserving step" } else { "stage" };
        let report = model.compare_with_differences(&at).map_err(|error| error.to_string())?;
        // Kinks of the limiter and of reconstructed jumps are smooth only on a small scale.
        let most = if case.tau == [0.0; 2] { 2e-6 } else { 2e-5 };
        let details = format!("{what}: error of an entry, {:?}", report.worst);
        worst = worst.max(no_worse(report.largest_error, most, &details)?);
        no_worse(report.outside_pattern, 1e-8, &format!("{what}: coupling outside the pattern"))?;
        if at.conserving {
            model.begin_conserving(at.time, 2.0 * at.shift, &at.base);
        } else {
            model.begin_stage(at.time, at.shift, &at.base);
        }
        model.linearise(&at.unknowns).map_err(|error| error.to_string())?;
        symmetry(model, model.declared(problem).symmetry, what)?;
    }
    Ok(worst)
}

fn symmetry<const D: usize>(model: &Model<D>, declared: Symmetry, what: &str) -> Result<(), String> {
    if declared == Symmetry::General {
        return Ok(());
    }
    let matrix = model.tangent_matrix();
    let (mut largest, mut unequal) = (0.0_f64, 0.0_f64);
    for row in 0..matrix.size() {
        for column in 0..row + 1 {
            let (one, other) = (matrix.get(row, column), matrix.get(column, row));
            largest = largest.max(one.abs());
            unequal = unequal.max((one - other).abs());
        }
    }
    no_worse(unequal / largest, 1e-12, &format!("{what}: declared {declared:?}, but entries differ"))?;
    if declared == Symmetry::PositiveDefinite {
        let (mut noise, mut product) = (Noise::new(3), vec![0.0; matrix.size()]);
        for _ in 0..10 {
            let way: Vec<f64> = product.iter().map(|_| noise.next()).collect();
            matrix.apply(&way, &mut product);
            let work: f64 = way.iter().zip(&product).map(|(x, y)| x * y).sum();
            if work <= 0.0 {
                return Err(format!("{what}: declared positive definite, but a direction has work {work:e}"));
            }
        }
    }
    Ok(())
}
