//! Distance of a state from the exact solution of a scene.

use std::collections::BTreeMap;

use crate::model::Model;
use crate::output::ErrorNorms;
use crate::setup::ExactSolution;
use crate::tensor::coordinates;

/// Volume-weighted error norms of every field that the scene knows exactly, at time `t`:
///
/// ```text
/// L1 = Σ V |e| / Σ V      L2 = √(Σ V |e|² / Σ V)      L∞ = max |e|
/// ```
pub fn errors<const D: usize>(model: &Model<D>, t: f64, state: &[f64]) -> BTreeMap<String, ErrorNorms> {
    let mut out = BTreeMap::new();
    let Some(exact) = &model.setup().exact else { return out };
    let ExactSolution { displacement, velocity, pressure } = exact;
    let positions = &model.setup().particles.positions;
    let vector_error = |field: &[crate::expression::Expression; D], values: &[f64], a: usize| -> f64 {
        let at = coordinates(&positions[a]);
        (0..D).map(|i| (values[a * D + i] - field[i].value(at, t)).powi(2)).sum::<f64>().sqrt()
    };
    if let Some(field) = displacement {
        let values = model.displacements(state);
        out.insert("displacement".into(), norms(model, |a| vector_error(field, values, a)));
    }
    if let Some(field) = velocity {
        let values = model.velocities_of(state);
        out.insert("velocity".into(), norms(model, |a| vector_error(field, values, a)));
    }
    if let Some(field) = pressure {
        let values = model.pressures(state);
        out.insert("pressure".into(), norms(model, |a| (values[a] - field.value(coordinates(&positions[a]), t)).abs()));
    }
    out
}

fn norms<const D: usize>(model: &Model<D>, error: impl Fn(usize) -> f64) -> ErrorNorms {
    let volumes = &model.setup().particles.volumes;
    let total: f64 = volumes.iter().sum();
    let (mut l1, mut l2, mut linf) = (0.0, 0.0, 0.0_f64);
    for (a, volume) in volumes.iter().enumerate() {
        let e = error(a);
        l1 += volume * e;
        l2 += volume * e * e;
        // `max` would drop a NaN.
        linf = if e > linf || e.is_nan() { e } else { linf };
    }
    ErrorNorms { l1: l1 / total, l2: (l2 / total).sqrt(), linf }
}
