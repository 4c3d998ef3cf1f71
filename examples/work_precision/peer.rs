//! diffsol's implicit integrators on the same discrete system: the same rates, and the same derivatives in a sparse matrix.
//!
//! The unknowns are all of the first-order system, free displacements, velocities and, where a law reads them, volume
//! ratios: `y′ = f(t, y)`. With the full set of unknowns and a shift of 1 s our tangent is `m (1 − ∂f/∂y)`, row by row, in
//! unknowns that are the state itself (volume ratios times the wave speed), so that its entries are theirs.

use std::cell::RefCell;

use diffsol::{
    ConstantOp, FaerContext, FaerSparseMat, FaerVec, Matrix, NonLinearOp, NonLinearOpJacobian, OdeEquations,
    OdeEquationsRef, Op, UnitCallable, Vector, matrix::sparsity::MatrixSparsity,
};
use nicolson::model::Model;
use nicolson::setup::Constraint;
use nicolson::simulation::Prepared;
use nicolson_solvers::linear::Tangent;
use nicolson_solvers::nonlinear::NonlinearProblem;
use nicolson_solvers::time::{StageSystem, System};

/// Sparse matrices of diffsol.
pub type Entries = FaerSparseMat<f64>;
type Values = FaerVec<f64>;

/// Where a number of the peer's state stands in ours.
#[derive(Debug, Clone, Copy)]
struct Place {
    /// Entry of the full state `[u | v | J]`.
    entry: usize,
    /// Unknown of the full set.
    unknown: usize,
    /// Unknown over entry: the wave speed for a volume ratio.
    scale: f64,
    mass: f64,
}

/// Buffers of the evaluation, and the model itself.
struct Inside<const D: usize> {
    model: Model<D>,
    state: Vec<f64>,
    rate: Vec<f64>,
    unknowns: Vec<f64>,
    values: Vec<f64>,
    /// Where the linearisation stands.
    point: Vec<f64>,
    pub rates: usize,
    pub matrices: usize,
}

/// The system as diffsol sees it.
pub struct Peer<const D: usize> {
    inside: RefCell<Inside<D>>,
    places: Vec<Place>,
    start: Vec<f64>,
    /// For every entry in the peer's order: our entry, the mass of its row, and whether it is on the diagonal.
    entries: Vec<(usize, f64, bool)>,
    pattern: Vec<(usize, usize)>,
    context: FaerContext,
}

impl<const D: usize> Peer<D> {
    /// A system before its first step; its scene must ask for the full set of unknowns.
    pub fn new(prepared: Prepared<D>) -> Self {
        let Prepared { mut model, state, .. } = prepared;
        let mut state = state.values;
        model.impose(0.0, &mut state);
        let n = model.particles();
        let mut places = Vec::new();
        let mut unknown = 0;
        let mut place_of = Vec::new();
        for a in 0..n {
            let free: Vec<usize> = (0..D).filter(|i| model.setup().constraints[a][*i] == Constraint::Free).collect();
            let mass = model.masses()[a];
            let speed = model.material(a).wave_speed();
            let evolves = model.material(a).evolves_volume();
            // Velocities, the volume ratio, displacements: the order of the unknowns.
            let own = free.iter().map(|i| ((n + a) * D + i, 1.0, true));
            let own = own.chain([(2 * n * D + a, speed, evolves)]);
            for (entry, scale, kept) in own.chain(free.iter().map(|i| (a * D + i, 1.0, true))) {
                place_of.push(kept.then_some(places.len()));
                if kept {
                    places.push(Place { entry, unknown, scale, mass });
                }
                unknown += 1;
            }
        }
        let pattern = model.pattern().cloned();
        let mut triplets = Vec::new();
        if let Some(pattern) = &pattern {
            for row in 0..unknown {
                let Some(i) = place_of[row] else { continue };
                for (column, entry) in pattern.row(row).iter().zip(pattern.stored(row)) {
                    let column: usize = *column;
                    if let Some(j) = place_of[column] {
                        triplets.push((j, i, entry, places[i].mass));
                    }
                }
            }
        }
        // Column by column, as diffsol keeps them.
        triplets.sort_unstable_by_key(|(column, row, ..)| (*column, *row));
        let entries = triplets.iter().map(|(j, i, entry, mass)| (*entry, *mass, i == j)).collect();
        let indices = triplets.iter().map(|(j, i, ..)| (*i, *j)).collect();
        let start = places.iter().map(|place| place.scale * state[place.entry]).collect();
        let values = vec![0.0; pattern.map_or(0, |pattern| pattern.entries())];
        let (rate, point) = (vec![0.0; state.len()], Vec::new());
        let unknowns = vec![0.0; unknown];
        let inside = Inside { model, state, rate, unknowns, values, point, rates: 0, matrices: 0 };
        Self { inside: RefCell::new(inside), places, start, entries, pattern: indices, context: FaerContext::default() }
    }

    /// Tolerances of every entry, relative to the size of its field.
    pub fn absolute(&self, tolerance: f64, displacement: f64, velocity: f64) -> Vec<f64> {
        let n = self.inside.borrow().model.particles() * D;
        let size = |place: &Place| match place.entry / n {
            0 => displacement,
            1 => velocity,
            _ => place.scale,
        };
        self.places.iter().map(|place| tolerance * size(place)).collect()
    }

    /// Displacements of all particles.
    pub fn displacements(&self, values: &[f64]) -> Vec<f64> {
        let inside = self.inside.borrow();
        let mut state = inside.state.clone();
        self.write(values, &mut state);
        inside.model.displacements(&state).to_vec()
    }

    /// Evaluations of the rate and of the derivatives so far.
    pub fn counts(&self) -> (usize, usize) {
        let inside = self.inside.borrow();
        (inside.rates, inside.matrices)
    }

    fn write(&self, values: &[f64], state: &mut [f64]) {
        for (place, value) in self.places.iter().zip(values) {
            state[place.entry] = value / place.scale;
        }
    }

    fn rate(&self, t: f64, values: &[f64], out: &mut [f64]) {
        let inside = &mut *self.inside.borrow_mut();
        inside.rates += 1;
        self.write(values, &mut inside.state);
        let done = inside.model.rate(t, &inside.state, &mut inside.rate);
        for (place, out) in self.places.iter().zip(out) {
            // The peer has no other way to hear of a state that cannot be: it shortens its step.
            *out = if done.is_ok() { place.scale * inside.rate[place.entry] } else { f64::NAN };
        }
    }

    /// Linearises at a state, unless it stands there.
    fn linearise(&self, t: f64, values: &[f64]) {
        let inside = &mut *self.inside.borrow_mut();
        if inside.point == values {
            return;
        }
        self.write(values, &mut inside.state);
        inside.model.begin_stage(t, 1.0, &inside.state);
        inside.unknowns.fill(0.0);
        // Volume ratios that no law reads may be anything.
        for place in &self.places {
            inside.unknowns[place.unknown] = place.scale * inside.state[place.entry];
        }
        let done = inside.model.linearise(&inside.unknowns);
        inside.point.clear();
        if done.is_ok() {
            inside.point.extend_from_slice(values);
        }
    }

    fn derivatives(&self, t: f64, values: &[f64], out: &mut [f64]) {
        self.linearise(t, values);
        let inside = &mut *self.inside.borrow_mut();
        inside.matrices += 1;
        inside.model.fill(&mut inside.values);
        for ((entry, mass, diagonal), out) in self.entries.iter().zip(out) {
            *out = f64::from(u8::from(*diagonal)) - inside.values[*entry] / mass;
        }
    }

    fn product(&self, t: f64, values: &[f64], direction: &[f64], out: &mut [f64]) {
        self.linearise(t, values);
        let inside = &mut *self.inside.borrow_mut();
        let mut vector = vec![0.0; inside.unknowns.len()];
        let mut image = vector.clone();
        self.places.iter().zip(direction).for_each(|(place, value)| vector[place.unknown] = *value);
        inside.model.tangent().apply(&vector, &mut image);
        for ((place, value), out) in self.places.iter().zip(direction).zip(out) {
            *out = value - image[place.unknown] / place.mass;
        }
    }
}

macro_rules! operator {
    ($name:ty) => {
        impl<const D: usize> Op for $name {
            type T = f64;
            type V = Values;
            type M = Entries;
            type C = FaerContext;
            fn context(&self) -> &FaerContext {
                &self.peer().context
            }
            fn nstates(&self) -> usize {
                self.peer().places.len()
            }
            fn nout(&self) -> usize {
                self.peer().places.len()
            }
            fn nparams(&self) -> usize {
                0
            }
        }
    };
}

/// The rate as an operator.
pub struct Rate<'a, const D: usize>(&'a Peer<D>);
/// The initial state as an operator.
pub struct Start<'a, const D: usize>(&'a Peer<D>);

impl<const D: usize> Peer<D> {
    fn peer(&self) -> &Self {
        self
    }
}

impl<const D: usize> Rate<'_, D> {
    fn peer(&self) -> &Peer<D> {
        self.0
    }
}

impl<const D: usize> Start<'_, D> {
    fn peer(&self) -> &Peer<D> {
        self.0
    }
}

operator!(Peer<D>);
operator!(Rate<'_, D>);
operator!(Start<'_, D>);

impl<const D: usize> NonLinearOp for Rate<'_, D> {
    fn call_inplace(&self, x: &Values, t: f64, y: &mut Values) {
        y.for_each_batch_host([x], |y, [x], _| self.0.rate(t, x, y));
    }
}

impl<const D: usize> NonLinearOpJacobian for Rate<'_, D> {
    fn jac_mul_inplace(&self, x: &Values, t: f64, v: &Values, y: &mut Values) {
        y.for_each_batch_host([x, v], |y, [x, v], _| self.0.product(t, x, v, y));
    }

    fn jacobian_inplace(&self, x: &Values, t: f64, y: &mut Entries) {
        let values = x.clone_as_vec();
        if let Some(matrix) = y.inner_mut().first_mut() {
            self.0.derivatives(t, &values, matrix.val_mut());
        }
    }

    fn jacobian_sparsity(&self) -> Option<<Entries as Matrix>::Sparsity> {
        let size = self.0.places.len();
        <<Entries as Matrix>::Sparsity as MatrixSparsity<Entries>>::try_from_indices(size, size, self.0.pattern.clone())
            .ok()
    }
}

impl<const D: usize> ConstantOp for Start<'_, D> {
    fn call_inplace(&self, _: f64, y: &mut Values) {
        y.for_each_batch_host([], |y, [], _| y.copy_from_slice(&self.0.start));
    }
}

impl<'a, const D: usize> OdeEquationsRef<'a> for Peer<D> {
    type Mass = UnitCallable<Entries>;
    type Rhs = Rate<'a, D>;
    type Root = UnitCallable<Entries>;
    type Init = Start<'a, D>;
    type Out = UnitCallable<Entries>;
    type Reset = UnitCallable<Entries>;
}

impl<const D: usize> OdeEquations for Peer<D> {
    fn rhs(&self) -> Rate<'_, D> {
        Rate(self)
    }
    fn mass(&self) -> Option<UnitCallable<Entries>> {
        None
    }
    fn init(&self) -> Start<'_, D> {
        Start(self)
    }
    fn set_params(&mut self, _: &Values) {}
    fn get_params(&self, _: &mut Values) {}
}
