//! The state of an integration: time, values, and what a step leaves for the next one.

/// Time and values, with the memory that makes a continued run identical to an uninterrupted one.
///
/// Everything is plain data, so that it can be written to a checkpoint and read back bit by bit.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TimeState {
    /// Present time.
    pub time: f64,
    /// Values at this time.
    pub values: Vec<f64>,
    /// What the steps so far leave for the next one.
    pub memory: Memory,
}

/// What a step leaves for the next one. An empty vector means "not known".
///
/// The vectors belong to one exact state: [`fingerprint`](Self::fingerprint) tells which, and a stepper
/// forgets them by itself if time or values were changed from outside.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Memory {
    /// `f(t, u)` at the present state.
    pub rate: Vec<f64>,
    /// `f` at the start of the last step.
    pub previous_rate: Vec<f64>,
    /// Length of the last step.
    pub previous_step: f64,
    /// The algorithmic rate of generalised-α.
    pub algorithmic_rate: Vec<f64>,
    /// Rate of the velocities that velocity Verlet keeps (zero elsewhere).
    pub velocity_rate: Vec<f64>,
    /// Direction of the dominant eigenvector (power iteration of Runge–Kutta–Chebyshev).
    pub dominant_direction: Vec<f64>,
    /// Spectral radius found with it; 0 if unknown.
    pub spectral_radius: f64,
    /// Damping ratio `−Re λ / |λ|` of the dominant eigenvalue; 1 is real and negative, 0 undamped.
    pub dominant_damping: f64,
    /// Accepted steps since that estimate.
    pub steps_since_estimate: usize,
    /// Time that does not fit into [`TimeState::time`] (compensated summation of the steps).
    pub time_remainder: f64,
    /// The control's part.
    pub control: ControlMemory,
    /// Mark of the time and values that the vectors belong to; see [`TimeState::fingerprint`].
    pub fingerprint: u64,
}

/// What the step control remembers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ControlMemory {
    /// Present fraction of the nominal step, at most 1 (fixed and CFL steps).
    pub scale: f64,
    /// Proposed length of the next step; 0 if there is none yet (adaptive and effort control).
    pub step: f64,
    /// Weighted error of the last accepted step; 0 if there is none yet.
    pub error: f64,
    /// Cheap steps in a row (effort control).
    pub cheap_steps: usize,
}

impl Default for ControlMemory {
    fn default() -> Self {
        Self { scale: 1.0, step: 0.0, error: 0.0, cheap_steps: 0 }
    }
}

impl TimeState {
    /// A state without memory.
    pub fn new(time: f64, values: Vec<f64>) -> Self {
        Self { time, values, memory: Memory::default() }
    }

    /// Forgets every kept rate and eigenvector; the step control keeps its place.
    ///
    /// For a caller that changes the *system* (a load, a material) between two steps. Changing
    /// `time` or `values` is noticed without it.
    pub fn forget_rates(&mut self) {
        self.memory.forget_rates();
        self.memory.dominant_direction.clear();
        self.memory.spectral_radius = 0.0;
    }

    /// Mark of `time` and `values`: different bits give a different mark (but for one chance in 2⁶⁴).
    pub fn fingerprint(&self) -> u64 {
        // Four independent lanes of rotate–xor–multiply, so that the latency of the product is hidden.
        const FACTOR: u64 = 0x9E37_79B9_7F4A_7C15;
        let mix = |hash: u64, value: f64| (hash.rotate_left(23) ^ value.to_bits()).wrapping_mul(FACTOR);
        let mut lanes = [1_u64, 2, 3, 4];
        let chunks = self.values.chunks_exact(4);
        let rest = chunks.remainder();
        for chunk in chunks {
            for (lane, value) in lanes.iter_mut().zip(chunk) {
                *lane = mix(*lane, *value);
            }
        }
        let mut hash = mix(self.values.len() as u64, self.time);
        for value in rest {
            hash = mix(hash, *value);
        }
        for lane in lanes {
            hash = (hash.rotate_left(29) ^ lane).wrapping_mul(FACTOR);
            hash ^= hash >> 32;
        }
        hash
    }

    /// Takes over another state without giving up the own buffers.
    pub(super) fn copy_from(&mut self, other: &Self) {
        self.time = other.time;
        self.values.clone_from(&other.values);
        self.memory.copy_from(&other.memory);
    }

    /// Whether the vectors of the memory belong to the present time and values.
    pub(super) fn memory_is_current(&self) -> bool {
        self.memory.fingerprint == self.fingerprint()
    }
}

impl Memory {
    pub(super) fn forget_rates(&mut self) {
        self.rate.clear();
        self.previous_rate.clear();
        self.algorithmic_rate.clear();
        self.velocity_rate.clear();
    }

    fn copy_from(&mut self, other: &Self) {
        let Self {
            rate,
            previous_rate,
            previous_step,
            algorithmic_rate,
            velocity_rate,
            dominant_direction,
            spectral_radius,
            dominant_damping,
            steps_since_estimate,
            time_remainder,
            control,
            fingerprint,
        } = other;
        self.rate.clone_from(rate);
        self.previous_rate.clone_from(previous_rate);
        self.previous_step = *previous_step;
        self.algorithmic_rate.clone_from(algorithmic_rate);
        self.velocity_rate.clone_from(velocity_rate);
        self.dominant_direction.clone_from(dominant_direction);
        self.spectral_radius = *spectral_radius;
        self.dominant_damping = *dominant_damping;
        self.steps_since_estimate = *steps_since_estimate;
        self.time_remainder = *time_remainder;
        self.control = *control;
        self.fingerprint = *fingerprint;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fingerprint_tells_single_bits_and_positions_apart() {
        let state = TimeState::new(1.0, (0..11).map(f64::from).collect());
        let mark = state.fingerprint();
        assert_eq!(mark, state.clone().fingerprint());
        for i in 0..11 {
            let mut other = state.clone();
            other.values[i] = f64::from_bits(other.values[i].to_bits() ^ 1);
            assert_ne!(mark, other.fingerprint(), "entry {i}");
        }
        let mut swapped = state.clone();
        swapped.values.swap(1, 5);
        assert_ne!(mark, swapped.fingerprint());
        assert_ne!(mark, TimeState::new(2.0, state.values.clone()).fingerprint());
    }
}
