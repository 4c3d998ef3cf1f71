//! Forces that do not depend on the state: gravity, body forces, tractions.

use nicolson_solvers::EvaluationError;

use crate::discretisation::{DiscretisationError, Neighbourhood, face_shares};
use crate::setup::{Setup, Traction};
use crate::tensor::{Vector, coordinates};

/// External forces on all particles.
#[derive(Debug, Clone)]
pub struct Loads<const D: usize> {
    /// Forces that never change, N; empty if there are none.
    constant: Vec<Vector<D>>,
    /// Forces at `time`, N; empty if nothing varies.
    varying: Vec<Vector<D>>,
    /// Who carries each traction.
    carriers: Vec<Vec<Carrier<D>>>,
    time: Option<f64>,
    ramp: Option<Ramp>,
    /// What the ramp multiplies all loads with at `time`.
    factor: f64,
}

/// A particle's share of a piece of boundary.
#[derive(Debug, Clone, Copy)]
struct Carrier<const D: usize> {
    particle: usize,
    /// m^(D−1).
    area: f64,
    /// Where the piece is, m.
    point: Vector<D>,
}

/// Loads that grow in proportion to the time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ramp {
    /// Time at which they are complete, s.
    pub end: f64,
    /// Time for which loads that vary are taken, s; `None`: as it goes on.
    pub frozen: Option<f64>,
}

impl<const D: usize> Loads<D> {
    /// Collects the loads of a set-up; what does not depend on time is evaluated once, here.
    ///
    /// # Errors
    /// If a traction acts off the particles and those around it cannot share it.
    pub fn new(setup: &Setup<D>, neighbourhood: &Neighbourhood, masses: &[f64]) -> Result<Self, DiscretisationError> {
        let varies = varying_parts(setup).next().is_some();
        let carriers = setup
            .tractions
            .iter()
            .map(|traction| carriers(setup, neighbourhood, traction))
            .collect::<Result<_, _>>()?;
        let mut loads = Self {
            constant: Vec::new(),
            varying: if varies { vec![Vector::zeros(); masses.len()] } else { Vec::new() },
            carriers,
            time: None,
            ramp: None,
            factor: 1.0,
        };
        let steady_body = setup.body_force.as_ref().filter(|f| !f.iter().any(|e| e.depends_on_time()));
        let steady_tractions = setup.tractions.iter().any(|t| !t.value.iter().any(|e| e.depends_on_time()));
        if setup.gravity.iter().any(|g| *g != 0.0) || steady_body.is_some() || steady_tractions {
            loads.constant = vec![Vector::zeros(); masses.len()];
            for (force, mass) in loads.constant.iter_mut().zip(masses) {
                *force += setup.gravity * *mass;
            }
            add(setup, &loads.carriers, masses, 0.0, false, &mut loads.constant);
        }
        Ok(loads)
    }

    /// Whether there is any load.
    pub fn any(&self) -> bool {
        !self.constant.is_empty() || !self.varying.is_empty()
    }

    /// Lets all loads grow from zero, or no longer.
    pub fn set_ramp(&mut self, ramp: Option<Ramp>) {
        self.ramp = ramp;
        self.factor = 1.0;
        self.time = None;
    }

    /// Brings the forces to time `t`.
    ///
    /// # Errors
    /// If an expression gives a value that is not finite.
    pub fn update(&mut self, setup: &Setup<D>, masses: &[f64], t: f64) -> Result<(), EvaluationError> {
        if let Some(ramp) = self.ramp {
            self.factor = (t / ramp.end).clamp(0.0, 1.0);
        }
        let t = self.ramp.and_then(|ramp| ramp.frozen).unwrap_or(t);
        if !self.varying.is_empty() && self.time != Some(t) {
            self.time = None;
            self.varying.fill(Vector::zeros());
            add(setup, &self.carriers, masses, t, true, &mut self.varying);
        }
        if self.time.is_none() {
            for (a, force) in self.constant.iter().chain(&self.varying).enumerate() {
                if let Some(bad) = force.iter().find(|f| !f.is_finite()) {
                    return Err(EvaluationError::not_finite("load", a % masses.len(), *bad));
                }
            }
            self.time = Some(t);
        }
        Ok(())
    }

    /// Force on a particle at the time of the last update, N.
    #[inline]
    pub fn on(&self, particle: usize) -> Vector<D> {
        let mut force = Vector::zeros();
        if let Some(f) = self.constant.get(particle) {
            force += f;
        }
        if let Some(f) = self.varying.get(particle) {
            force += f;
        }
        if self.ramp.is_some() { force * self.factor } else { force }
    }
}

/// Expressions that mention time.
fn varying_parts<const D: usize>(setup: &Setup<D>) -> impl Iterator<Item = &crate::expression::Expression> {
    setup
        .body_force
        .iter()
        .chain(setup.tractions.iter().map(|t| &t.value))
        .flatten()
        .filter(|expression| expression.depends_on_time())
}

/// Adds the loads whose dependence on time is as asked.
fn add<const D: usize>(
    setup: &Setup<D>,
    carriers: &[Vec<Carrier<D>>],
    masses: &[f64],
    t: f64,
    varying: bool,
    out: &mut [Vector<D>],
) {
    let positions = &setup.particles.positions;
    let wanted = |value: &[crate::expression::Expression; D]| value.iter().any(|e| e.depends_on_time()) == varying;
    if let Some(field) = setup.body_force.as_ref().filter(|f| wanted(f)) {
        for (a, force) in out.iter_mut().enumerate() {
            let at = coordinates(&positions[a]);
            *force += Vector::<D>::from_fn(|i, _| field[i].value(at, t)) * masses[a];
        }
    }
    for (traction, carriers) in setup.tractions.iter().zip(carriers).filter(|(traction, _)| wanted(&traction.value)) {
        for carrier in carriers {
            let at = coordinates(&carrier.point);
            out[carrier.particle] += Vector::<D>::from_fn(|i, _| traction.value[i].value(at, t)) * carrier.area;
        }
    }
}

/// The particles that share the pieces of a traction.
fn carriers<const D: usize>(
    setup: &Setup<D>,
    neighbourhood: &Neighbourhood,
    traction: &Traction<D>,
) -> Result<Vec<Carrier<D>>, DiscretisationError> {
    let mut carriers = Vec::with_capacity(traction.areas.len());
    for (&(a, area), point) in traction.areas.iter().zip(&traction.points) {
        let Some(body) = setup.bodies.iter().find(|body| body.particles.contains(&a)) else { continue };
        let shares = face_shares(body, &setup.particles, neighbourhood, a, point)?;
        carriers.extend(shares.into_iter().map(|(particle, share)| Carrier {
            particle,
            area: area * share,
            point: *point,
        }));
    }
    Ok(carriers)
}
