//! Operations on flat vectors whose results do not depend on the number of threads.
//!
//! Sums run over chunks of a fixed length, each summed in order, and the chunk sums are added in
//! order: the same bits come out for 1, 2 or N threads.

use rayon::prelude::*;

/// Entries summed as one piece. Short enough to share work, long enough to pay for it.
const CHUNK: usize = 4096;

/// Scalar product `a · b`.
///
/// # Panics
/// If the lengths differ (a programming error of the caller).
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len(), "dot: vectors of different length");
    let piece = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    if a.len() <= CHUNK {
        return piece(a, b);
    }
    let sums: Vec<f64> = a.par_chunks(CHUNK).zip(b.par_chunks(CHUNK)).map(|(a, b)| piece(a, b)).collect();
    sums.iter().sum()
}

/// Euclidean norm, protected against overflow and underflow of the squares.
///
/// NaN or infinity in the vector gives a result that is not finite.
pub fn norm(a: &[f64]) -> f64 {
    let plain = dot(a, a).sqrt();
    if plain.is_finite() && plain > 1e-140 {
        return plain;
    }
    let largest = max_norm(a);
    if largest == 0.0 || !largest.is_finite() {
        return largest;
    }
    let scaled: f64 = a.iter().map(|x| (x / largest) * (x / largest)).sum();
    largest * scaled.sqrt()
}

/// Largest magnitude; NaN if any entry is NaN.
pub fn max_norm(a: &[f64]) -> f64 {
    a.iter().fold(0.0_f64, |m, x| if x.is_nan() || m.is_nan() { f64::NAN } else { m.max(x.abs()) })
}

/// `y += alpha x`.
///
/// # Panics
/// If the lengths differ.
pub fn axpy(alpha: f64, x: &[f64], y: &mut [f64]) {
    assert_eq!(x.len(), y.len(), "axpy: vectors of different length");
    for (y, x) in y.iter_mut().zip(x) {
        *y += alpha * x;
    }
}

/// Entries handled as one piece where nothing is summed.
const PIECE: usize = 1 << 14;

/// Index of the first entry that is NaN or infinite.
pub fn first_not_finite(a: &[f64]) -> Option<usize> {
    // The exponent of what is not finite has all its bits set: a test without branches, for many at a time.
    const EXPONENT: u64 = 0x7FF0_0000_0000_0000;
    let bad = |x: &f64| u64::from(x.to_bits() & EXPONENT == EXPONENT);
    let sound = |piece: &[f64]| piece.iter().map(bad).fold(0, |any, bad| any | bad) == 0;
    let all_sound = if a.len() <= PIECE { sound(a) } else { a.par_chunks(PIECE).all(sound) };
    if all_sound { None } else { a.iter().position(|x| !x.is_finite()) }
}

/// `out = f(out, a, b)`, entry by entry, long vectors by all threads.
///
/// # Panics
/// If the lengths differ.
pub fn combine(out: &mut [f64], a: &[f64], b: &[f64], f: impl Fn(f64, f64, f64) -> f64 + Sync) {
    assert!(out.len() == a.len() && out.len() == b.len(), "combine: vectors of different length");
    let piece = |out: &mut [f64], a: &[f64], b: &[f64]| {
        for ((out, a), b) in out.iter_mut().zip(a).zip(b) {
            *out = f(*out, *a, *b);
        }
    };
    if out.len() <= PIECE {
        return piece(out, a, b);
    }
    let pieces = out.par_chunks_mut(PIECE).zip(a.par_chunks(PIECE)).zip(b.par_chunks(PIECE));
    pieces.for_each(|((out, a), b)| piece(out, a, b));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dot_has_the_same_bits_for_any_number_of_threads() {
        let a: Vec<f64> = (0..50_000).map(|i| (f64::from(i) * 0.37).sin()).collect();
        let b: Vec<f64> = (0..50_000).map(|i| (f64::from(i) * 0.11).cos() * 1e3).collect();
        let reference = dot(&a, &b).to_bits();
        for threads in [1, 2, 3, 5] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("thread pool");
            assert_eq!(pool.install(|| dot(&a, &b)).to_bits(), reference);
        }
    }

    #[test]
    fn norm_survives_extreme_magnitudes() {
        assert!((norm(&[3e-200, 4e-200]) / 5e-200 - 1.0).abs() < 1e-14);
        assert!((norm(&[3e200, 4e200]) / 5e200 - 1.0).abs() < 1e-14);
        assert_eq!(norm(&[0.0, 0.0]), 0.0);
        assert!(!norm(&[1.0, f64::NAN]).is_finite());
        assert!(!norm(&[1.0, f64::INFINITY]).is_finite());
    }
}
