//! How long work takes, for benches.

use std::time::Instant;

/// Below this the count of the system is too coarse, s.
const COARSE: f64 = 0.03;

/// Seconds that this thread has computed, where the system tells: other programs then disturb less.
fn computed() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(text.split_whitespace().next()?.parse::<f64>().ok()? * 1e-9)
}

/// What some work takes, s: processor time where there is one thread and the clock of the system is fine enough.
pub fn spent(work: impl FnOnce()) -> f64 {
    let (start, before) = (Instant::now(), computed());
    work();
    let elapsed = start.elapsed().as_secs_f64();
    match (before, computed()) {
        (Some(before), Some(after)) if elapsed > COARSE && rayon::current_num_threads() == 1 => {
            (after - before).min(elapsed)
        }
        _ => elapsed,
    }
}

/// Smallest time of several repetitions, s.
pub fn smallest(repetitions: usize, mut work: impl FnMut()) -> f64 {
    (0..repetitions).map(|_| spent(&mut work)).fold(f64::INFINITY, f64::min)
}
