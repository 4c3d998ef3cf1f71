//! The energy and momentum ledger of a run.
//!
//! ```text
//! total(t) = kinetic + internal + hourglass − external work        ledger error = total(t) + dissipated(t) − total(0)
//! ```
//!
//! Works of loads are integrated by the trapezoidal rule along the path, `½(f₀ + f₁)·Δu`, exact for
//! dead loads; dissipation is taken at the mean of the two states of a step, which is exactly what an
//! energy–momentum step takes out, and Crank–Nicolson on linear equations. The work of a moving constraint is the
//! change of kinetic energy of what it moves, less the work of the other forces on it.

mod momenta;

use nicolson_solvers::snapshot::unfit;
use nicolson_solvers::{EvaluationError, RestoreError, Snapshot};

use crate::model::{Energies, Model};
use crate::setup::Constraint;
use momenta::Momenta;

/// One row of the ledger.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Entry {
    /// Kinetic energy, J.
    pub kinetic: f64,
    /// Internal energy, J.
    pub internal: f64,
    /// Work of loads and moving constraints since the start, J.
    pub external: f64,
    /// Energy dissipated by upwinding and viscosity since the start, J.
    pub dissipated: f64,
    /// `kinetic + internal + hourglass − external`, J.
    pub total: f64,
    /// Energy of the hourglass control, J.
    pub hourglass: f64,
}

/// What the ledger says about a whole run.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Summary {
    /// Total energy at the start and at the end, J.
    pub totals: (f64, f64),
    /// Largest `|total(t) − total(0)|` over the energy scale.
    pub drift: f64,
    /// Largest `|total(t) + dissipated(t) − total(0)|` over the energy scale.
    pub ledger_error: f64,
    /// Energy dissipated, J.
    pub dissipated: f64,
    /// Largest energy of the hourglass control over the largest internal energy; `None` without control.
    pub hourglass_fraction: Option<f64>,
    /// Largest drift of linear momentum over its scale; `None` for a body that is held or loaded.
    pub linear_momentum: Option<f64>,
    /// Largest drift of angular momentum over its scale; `None` as above, and in 1D.
    pub angular_momentum: Option<f64>,
}

/// Keeps the books step by step.
#[derive(Debug, Default)]
pub struct Ledger {
    entry: Entry,
    initial: f64,
    largest_drift: f64,
    largest_error: f64,
    /// Largest kinetic energy and largest change of internal energy: the scale if the total is zero.
    exchange: f64,
    /// Largest internal energy and largest energy of the hourglass control so far; the latter only with control.
    internal: f64,
    hourglass: Option<f64>,
    time: f64,
    /// State at the last entry, and the mean state of a step.
    state: Vec<f64>,
    mean: Vec<f64>,
    /// Forces whose work counts, at the last entry: loads, and all forces on moving constraints.
    loads: Vec<f64>,
    forces: Vec<f64>,
    moving: Vec<usize>,
    constraint_kinetic: f64,
    momentum: Option<Momenta>,
}

impl Ledger {
    /// Opens the books at the initial state.
    ///
    /// # Errors
    /// If the state is outside the domain of the law.
    pub fn open<const D: usize>(model: &mut Model<D>, time: f64, state: &[f64]) -> Result<Self, EvaluationError> {
        let mut ledger = Self { time, moving: moving(model), ..Self::default() };
        if model.has_loads() {
            model.loads_at(time, &mut ledger.loads)?;
        }
        if !ledger.moving.is_empty() {
            model.forces_at(time, state, &mut ledger.forces)?;
            ledger.constraint_kinetic = ledger.kinetic_of_moving(model, state);
        }
        ledger.state.extend_from_slice(state);
        ledger.momentum = model.is_free().then(|| Momenta::open(model, state));
        ledger.hourglass = model.hourglass().map(|_| 0.0);
        ledger.write(model.energies(state));
        ledger.initial = ledger.entry.total;
        ledger.exchange = ledger.entry.kinetic;
        Ok(ledger)
    }

    /// Everything that the books hold, but the state at the last row where that is the present state anyway.
    pub(super) fn save(&self) -> Snapshot {
        let Entry { kinetic, internal, external, dissipated, total, hourglass } = self.entry;
        let mut saved = Snapshot::new();
        saved.put_reals("entry", [kinetic, internal, external, dissipated, total, hourglass]);
        saved.put_reals("initial", [self.initial]);
        saved.put_reals("largest", [self.largest_drift, self.largest_error, self.exchange, self.internal]);
        saved.put_reals("hourglass", self.hourglass.into_iter().collect::<Vec<_>>());
        saved.put_real("time", self.time);
        saved.put_reals("loads", &self.loads[..]);
        saved.put_reals("forces", &self.forces[..]);
        saved.put_real("constraint_kinetic", self.constraint_kinetic);
        if let Some(momenta) = &self.momentum {
            momenta.save(&mut saved);
        }
        saved
    }

    /// The books that were saved when `state` was the last row.
    pub(super) fn restored<const D: usize>(
        model: &Model<D>,
        state: &[f64],
        saved: &Snapshot,
    ) -> Result<Self, RestoreError> {
        let [kinetic, internal, external, dissipated, total, hourglass] = saved.some_reals("entry")?;
        let [largest_drift, largest_error, exchange, largest_internal] = saved.some_reals("largest")?;
        let vector = |name: &str| -> Result<Vec<f64>, RestoreError> {
            let found = saved.reals(name)?;
            let length = if found.is_empty() { 0 } else { model.displacements(state).len() };
            Ok(saved.reals_of(name, length)?.to_vec())
        };
        let ledger = Self {
            entry: Entry { kinetic, internal, external, dissipated, total, hourglass },
            initial: saved.real("initial")?,
            largest_drift,
            largest_error,
            exchange,
            internal: largest_internal,
            hourglass: saved.reals("hourglass")?.first().copied(),
            time: saved.real("time")?,
            state: state.to_vec(),
            mean: Vec::new(),
            loads: vector("loads")?,
            forces: vector("forces")?,
            moving: moving(model),
            constraint_kinetic: saved.real("constraint_kinetic")?,
            momentum: Momenta::restored::<D>(saved)?,
        };
        if ledger.forces.is_empty() != ledger.moving.is_empty() {
            return Err(unfit("forces", "what the moving constraints of the scene need"));
        }
        Ok(ledger)
    }

    /// Whether there is hourglass control.
    pub(super) fn has_hourglass(&self) -> bool {
        self.hourglass.is_some()
    }

    /// The last row.
    pub fn entry(&self) -> Entry {
        self.entry
    }

    /// Time and state of the last row.
    pub fn last_state(&self) -> (f64, &[f64]) {
        (self.time, &self.state)
    }

    /// Adds the row of an accepted step.
    ///
    /// # Errors
    /// If the state is outside the domain of the law.
    pub fn follow<const D: usize>(
        &mut self,
        model: &mut Model<D>,
        time: f64,
        state: &[f64],
    ) -> Result<Entry, EvaluationError> {
        // All that can fail comes first: after an error the books are as they were.
        let mut entry = self.entry;
        if model.dissipates() {
            self.mean.clear();
            self.mean.extend(self.state.iter().zip(state).map(|(a, b)| 0.5 * (a + b)));
            let middle = 0.5 * (self.time + time);
            // Between two admissible states of a long step the mean may not be one. That matters to D_p; the end
            // then stands in.
            let power = match model.dissipation(middle, &self.mean) {
                Ok(power) => power,
                Err(_) => model.dissipation(time, state)?,
            };
            entry.dissipated += power * (time - self.time);
        }
        let (mut forces, mut loads) = (Vec::new(), Vec::new());
        let mut constraint_kinetic = self.constraint_kinetic;
        if !self.moving.is_empty() {
            model.forces_at(time, state, &mut forces)?;
            let before = &self.forces;
            let moved = model.displacements(state);
            let work: f64 =
                self.moving.iter().map(|&i| 0.5 * (before[i] + forces[i]) * (moved[i] - self.state[i])).sum();
            let kinetic = self.kinetic_of_moving(model, state);
            entry.external += kinetic - self.constraint_kinetic - work;
            constraint_kinetic = kinetic;
        }
        if !self.loads.is_empty() {
            model.loads_at(time, &mut loads)?;
            let moved = model.displacements(state);
            entry.external += self
                .loads
                .iter()
                .zip(&loads)
                .zip(moved.iter().zip(&self.state))
                .map(|((f0, f1), (u1, u0))| 0.5 * (f0 + f1) * (u1 - u0))
                .sum::<f64>();
        }
        self.entry = entry;
        (self.forces, self.loads, self.constraint_kinetic) = (forces, loads, constraint_kinetic);
        self.state.copy_from_slice(state);
        self.time = time;
        self.write(model.energies(state));
        self.exchange = self.exchange.max(self.entry.kinetic);
        self.largest_drift = self.largest_drift.max((self.entry.total - self.initial).abs());
        let error = self.entry.total + self.entry.dissipated - self.initial;
        self.largest_error = self.largest_error.max(error.abs());
        if let Some(momenta) = &mut self.momentum {
            momenta.follow(model, state);
        }
        Ok(self.entry)
    }

    fn write(&mut self, energies: Energies) {
        self.entry.kinetic = energies.kinetic;
        self.entry.internal = energies.internal;
        self.entry.hourglass = energies.hourglass;
        self.entry.total = energies.total() - self.entry.external;
        self.internal = self.internal.max(energies.internal);
        self.hourglass = self.hourglass.map(|largest| largest.max(energies.hourglass));
    }

    fn kinetic_of_moving<const D: usize>(&self, model: &Model<D>, state: &[f64]) -> f64 {
        let velocity = model.velocities_of(state);
        self.moving.iter().map(|&i| 0.5 * model.masses()[i / D] * velocity[i] * velocity[i]).sum()
    }

    /// Largest energy of the hourglass control so far over the largest internal energy so far.
    pub fn hourglass_fraction(&self) -> Option<f64> {
        // Where nothing has been deformed both are rounding.
        let noise = 1e-12 * self.exchange.max(self.entry.kinetic);
        self.hourglass.map(|largest| if largest > noise { largest / self.internal.max(noise) } else { 0.0 })
    }

    /// Whether the internal energy is past a maximum. Before the first, parts of it say little: a motion that
    /// has hardly begun has deformed next to nothing.
    pub fn past_maximum(&self) -> bool {
        self.entry.internal < 0.9 * self.internal
    }

    /// Closes the books.
    pub fn summary(&self) -> Summary {
        // Where nothing moves, as in a static computation, what is stored is the scale.
        let exchange = if self.exchange > 0.0 { self.exchange } else { self.internal };
        let scale = self.initial.abs().max(exchange).max(f64::MIN_POSITIVE);
        let momentum = self.momentum.as_ref();
        Summary {
            totals: (self.initial, self.entry.total),
            drift: self.largest_drift / scale,
            ledger_error: self.largest_error / scale,
            dissipated: self.entry.dissipated,
            hourglass_fraction: self.hourglass_fraction(),
            linear_momentum: momentum.map(Momenta::linear_drift),
            angular_momentum: momentum.and_then(Momenta::angular_drift),
        }
    }
}

/// Components of displacement whose motion is prescribed.
fn moving<const D: usize>(model: &Model<D>) -> Vec<usize> {
    let all = model.setup().constraints.iter().flatten().enumerate();
    all.filter(|(_, constraint)| matches!(constraint, Constraint::Moving(_))).map(|(i, _)| i).collect()
}
