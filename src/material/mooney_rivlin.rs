//! Mooney–Rivlin with the volume split off: `ψ = c₁(J^{−2/3} I₁ − 3) + c₂(J^{−4/3} I₂ − 3) + κ U(J)`. With `c₂ = 0`
//! and `c₁ = μ/2` it is the isochoric neo-Hookean law; with `κ = 0` the part of F of a nearly incompressible law
//! whose pressure comes from the evolved volume ratio.
//!
//! `I₁ = 3 + 2e₁` and `I₂ = 3 + 4e₁ + 2e₁² − 2e₂`, both with exact chords.

use super::isotropic::{Invariants, IsotropicEnergy, Response};
use super::{VolumetricForm, chord};

/// Mooney–Rivlin law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MooneyRivlin {
    /// c₁, Pa; the shear modulus is `2(c₁ + c₂)`.
    pub first: f64,
    /// c₂, Pa.
    pub second: f64,
    /// Bulk modulus κ, Pa.
    pub bulk_modulus: f64,
    /// U.
    pub volumetric: VolumetricForm,
}

const THIRD: f64 = 1.0 / 3.0;

impl IsotropicEnergy for MooneyRivlin {
    fn energy(&self, at: &Invariants) -> f64 {
        // J^{−2/3} I₁ − 3 = J^{−2/3} (I₁ − 3) + 3 (J^{−2/3} − 1), without the cancellation at small strains.
        let log = at.dilation.ln_1p();
        let (a, b) = (-2.0 * THIRD * log, -4.0 * THIRD * log);
        let first = a.exp() * 2.0 * at.trace + 3.0 * a.exp_m1();
        let second = b.exp() * (4.0 * at.trace + 2.0 * at.trace * at.trace - 2.0 * at.square) + 3.0 * b.exp_m1();
        self.first * first + self.second * second + self.bulk_modulus * self.volumetric.energy(at)
    }

    fn response(&self, at: &Invariants) -> Response {
        let (c1, c2, j) = (self.first, self.second, at.ratio);
        let (i1, i2) = invariants(at);
        let (a, b) = (j.powf(-2.0 * THIRD), j.powf(-4.0 * THIRD));
        let (da, db) = (-2.0 * THIRD * a / j, -4.0 * THIRD * b / j);
        let (dda, ddb) = (10.0 / 9.0 * a / (j * j), 28.0 / 9.0 * b / (j * j));
        let (volumetric, volumetric_slope) = self.volumetric.slopes(at);
        let spread = 4.0 + 4.0 * at.trace;
        let mixed = [2.0 * c1 * da + c2 * db * spread, -2.0 * c2 * db];
        Response {
            slope: [
                2.0 * c1 * a + c2 * b * spread,
                -2.0 * c2 * b,
                c1 * da * i1 + c2 * db * i2 + self.bulk_modulus * volumetric,
            ],
            curvature: [
                [4.0 * c2 * b, 0.0, mixed[0]],
                [0.0, 0.0, mixed[1]],
                [mixed[0], mixed[1], c1 * dda * i1 + c2 * ddb * i2 + self.bulk_modulus * volumetric_slope],
            ],
        }
    }

    fn chord(&self, start: &Invariants, end: &Invariants) -> Response {
        let (c1, c2) = (self.first, self.second);
        let (start_i, end_i) = (invariants(start), invariants(end));
        let (i1, i2) = (0.5 * (start_i.0 + end_i.0), 0.5 * (start_i.1 + end_i.1));
        // Chord of J^p is p times that of (J^p − 1)/p; a product changes by mean × change, twice.
        let chord_of = |p: f64| {
            let (slope, by_end) = chord::power(p, start.ratio, end.ratio);
            (p * slope, p * by_end)
        };
        let (p, q) = (-2.0 * THIRD, -4.0 * THIRD);
        let ((sa, sa_end), (sb, sb_end)) = (chord_of(p), chord_of(q));
        let mean = |p: f64| 0.5 * (start.ratio.powf(p) + end.ratio.powf(p));
        let (a, b) = (mean(p), mean(q));
        let (a_end, b_end) = (0.5 * p * end.ratio.powf(p - 1.0), 0.5 * q * end.ratio.powf(q - 1.0));
        let spread = 4.0 + 2.0 * (start.trace + end.trace);
        let volumetric = self.volumetric.chord(start, end);
        Response {
            slope: [
                2.0 * c1 * a + c2 * b * spread,
                -2.0 * c2 * b,
                c1 * sa * i1 + c2 * sb * i2 + self.bulk_modulus * volumetric.0,
            ],
            curvature: [
                [2.0 * c2 * b, 0.0, 2.0 * c1 * a_end + c2 * b_end * spread],
                [0.0, 0.0, -2.0 * c2 * b_end],
                [
                    c1 * sa + c2 * sb * (2.0 + 2.0 * end.trace),
                    -c2 * sb,
                    c1 * sa_end * i1 + c2 * sb_end * i2 + self.bulk_modulus * volumetric.1,
                ],
            ],
        }
    }
}

fn invariants(at: &Invariants) -> (f64, f64) {
    let e = at.trace;
    (3.0 + 2.0 * e, 3.0 + 4.0 * e + 2.0 * e * e - 2.0 * at.square)
}
