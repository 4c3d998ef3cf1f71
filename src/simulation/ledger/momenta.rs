//! Linear and angular momentum of a free body: how far they drift from where they were.

use nicolson_solvers::{RestoreError, Snapshot};

use crate::model::Model;
use crate::tensor::vector_at;

/// The momenta at the start, and their largest drifts so far.
#[derive(Debug)]
pub(super) struct Momenta {
    linear: Vec<f64>,
    angular: [f64; 3],
    /// Largest drift of linear and of angular momentum.
    drift: (f64, f64),
    /// Largest sum of magnitudes: the total itself may be zero.
    scale: (f64, f64),
}

impl Momenta {
    pub(super) fn open<const D: usize>(model: &Model<D>, state: &[f64]) -> Self {
        let linear: Vec<f64> = model.linear_momentum(state).iter().copied().collect();
        let mut momenta = Self { linear, angular: model.angular_momentum(state), drift: (0.0, 0.0), scale: (0.0, 0.0) };
        momenta.follow(model, state);
        momenta
    }

    pub(super) fn save(&self, saved: &mut Snapshot) {
        let Self { linear, angular, drift, scale } = self;
        saved.put_reals("linear_momentum", &linear[..]);
        saved.put_reals("angular_momentum", &angular[..]);
        saved.put_reals("momentum", [drift.0, drift.1, scale.0, scale.1]);
    }

    /// Those that were saved, if any.
    pub(super) fn restored<const D: usize>(saved: &Snapshot) -> Result<Option<Self>, RestoreError> {
        if !saved.has("momentum") {
            return Ok(None);
        }
        let [linear_drift, angular_drift, linear_scale, angular_scale] = saved.some_reals("momentum")?;
        Ok(Some(Self {
            linear: saved.reals_of("linear_momentum", D)?.to_vec(),
            angular: saved.some_reals("angular_momentum")?,
            drift: (linear_drift, angular_drift),
            scale: (linear_scale, angular_scale),
        }))
    }

    pub(super) fn follow<const D: usize>(&mut self, model: &Model<D>, state: &[f64]) {
        let linear = model.linear_momentum(state);
        let change = linear.iter().zip(&self.linear).map(|(p, p0)| (p - p0).powi(2)).sum::<f64>().sqrt();
        let angular = model.angular_momentum(state);
        let turn = angular.iter().zip(&self.angular).map(|(l, l0)| (l - l0).powi(2)).sum::<f64>().sqrt();
        self.drift = (self.drift.0.max(change), self.drift.1.max(turn));
        let (mut p, mut l) = (0.0, 0.0);
        for (a, mass) in model.masses().iter().enumerate() {
            let v = vector_at::<D>(model.velocities_of(state), a);
            p += mass * v.norm();
            l += mass * v.norm() * model.position(state, a).norm();
        }
        self.scale = (self.scale.0.max(p), self.scale.1.max(l));
    }

    /// Largest drift of linear momentum over its scale.
    pub(super) fn linear_drift(&self) -> f64 {
        relative(self.drift.0, self.scale.0)
    }

    /// The same of angular momentum, which a line does not have.
    pub(super) fn angular_drift(&self) -> Option<f64> {
        (self.linear.len() > 1).then(|| relative(self.drift.1, self.scale.1))
    }
}

fn relative(drift: f64, scale: f64) -> f64 {
    if drift == 0.0 { 0.0 } else { drift / scale.max(f64::MIN_POSITIVE) }
}
