//! Runge–Kutta–Chebyshev: coefficients, stability, and the number of stages from the operator itself.

mod time_common;

use approx::assert_abs_diff_eq;
use nicolson_solvers::time::{
    RkcCoefficients, RkcOptions, RkcStages, Scheme, StepCause, StepControl, StepperError, TimeState, rkc_growth,
    rkc_stability_limit, rkc_stages, rkc_stages_by_courant,
};
use time_common::{Equations, Full, run, stepper};

/// Rows `k, bₖ, μₖ, νₖ, μ̃ₖ, γ̃ₖ, cₖ` from k = 2, to 13 digits.
const TABLE: [(usize, &[[f64; 6]]); 5] = [
    (2, &[[0.2318244170096, 0.5, -1.0, 0.5, 0.0, 1.0]]),
    (
        3,
        &[
            [0.2416672551373, 0.5, -1.0, 0.1895831862157, 0.0, 0.3791663724313],
            [0.2754519379176, 2.318564158754, -0.2801605180529, 0.8791215613239, -0.6520156753191, 1.0],
        ],
    ),
    (
        4,
        &[
            [0.2452607709751, 0.5, -1.0, 0.1015108251708, 0.0, 0.2030216503416],
            [0.2843066529474, 2.340695331121, -0.2870403707642, 0.475211829071, -0.3541567341099, 0.5379915142449],
            [0.2907756284741, 2.06517536565, -1.185577405299, 0.4192753109789, -0.2896242516946, 1.0],
        ],
    ),
    (
        5,
        &[
            [0.2469512480244, 0.5, -1.0, 0.06356115767346, 0.0, 0.1271223153469],
            [0.2885422329536, 2.351216118863, -0.2903178774641, 0.2988920369108, -0.2232577799951, 0.3376204130567],
            [0.2983472424432, 2.080688309652, -1.208122027445, 0.2645019154382, -0.1839202359396, 0.6294852566949],
            [0.2978779057699, 2.009142086384, -1.032354614854, 0.255406793882, -0.171588124378, 1.0],
        ],
    ),
    (
        6,
        &[
            [0.2478768673608, 0.5, -1.0, 0.04362856250597, 0.0, 0.08725712501194],
            [0.2908806570564, 2.35700684697, -0.2921237367874, 0.2056656411, -0.1538125753896, 0.2320288293906],
            [0.3025754281118, 2.089300048837, -1.220668275073, 0.1823063155488, -0.1272257049658, 0.4333464508843],
            [0.3044078332882, 2.020710824883, -1.046504213682, 0.1763214170598, -0.1192838827718, 0.6898862508618],
            [0.3017384901596, 1.990934120279, -0.9972339526796, 0.1737231874237, -0.1150934692808, 1.0],
        ],
    ),
];

/// Half a unit of the last digit printed, and rounding.
fn printed(value: f64) -> f64 {
    let digits = format!("{value}").trim_start_matches(['-', '0', '.']).replace('.', "").len() as i32;
    let magnitude = if value == 0.0 { 0 } else { value.abs().log10().floor() as i32 + 1 };
    0.51 * 10.0_f64.powi(magnitude - digits).max(1e-13)
}

#[test]
fn coefficients_are_those_of_the_table() {
    let heads = [
        (2, 1.03846153846154, 1.03846153846154, 0.962962962963, 1.0),
        (3, 1.01709401709402, 0.385647848883143, 0.9831932773109, 0.3791663724313),
        (4, 1.00961538461538, 0.204973781594846, 0.9904761904762, 0.2030216503416),
        (5, 1.00615384615385, 0.12790460651828, 0.9938837920489, 0.1271223153469),
        (6, 1.0042735042735, 0.0876300187085709, 0.9957446808511, 0.08725712501194),
    ];
    for ((stages, rows), (_, q0, q1, b1, mu1)) in TABLE.iter().zip(heads) {
        let found = RkcCoefficients::new(*stages);
        let mut pairs = vec![(found.q0, q0), (found.q1, q1), (found.b[1], b1), (found.mu_rate[1], mu1)];
        pairs.push((found.c[1], mu1));
        for (k, row) in rows.iter().enumerate() {
            let k = k + 2;
            let here = [found.b[k], found.mu[k], found.nu[k], found.mu_rate[k], found.gamma_rate[k], found.c[k]];
            pairs.extend(here.into_iter().zip(*row));
        }
        for (found, expected) in pairs {
            let error = (found - expected).abs();
            assert!(error <= printed(expected), "s = {stages}: {found} for {expected}");
        }
    }
}

#[test]
fn coefficients_satisfy_their_identities() {
    for stages in [2, 3, 5, 8, 20, 100] {
        let c = RkcCoefficients::new(stages);
        assert_eq!((c.c[0], c.c[stages], c.c[1]), (0.0, 1.0, c.c[2]));
        // b₁ = 1/q₀ makes the first stage consistent: μ̃₁ = c₁.
        assert_abs_diff_eq!(c.mu_rate[1], c.c[1], epsilon = 1e-13);
        for k in 2..=stages {
            // Every stage is consistent: its node follows from the recursion.
            let node = c.mu[k] * c.c[k - 1] + c.nu[k] * c.c[k - 2] + c.mu_rate[k] + c.gamma_rate[k];
            // c₁ is c₂ by definition, and the printed recursion uses the node of Y₀ as 0.
            assert_abs_diff_eq!(node, c.c[k], epsilon = 1e-13 * (stages * stages) as f64);
        }
    }
}

#[test]
fn the_stability_polynomial_begins_as_the_exponential() {
    for stages in [2, 3, 4, 5, 6, 8, 12] {
        let c = RkcCoefficients::new(stages);
        assert_abs_diff_eq!(c.stability(0.0, 0.0).0, 1.0, epsilon = 1e-13);
        // Derivatives along the imaginary axis: no cancellation between even and odd terms.
        let h = 1e-3;
        let (even, odd) = c.stability(0.0, h);
        assert_abs_diff_eq!(odd / h, 1.0, epsilon = 1e-6);
        assert_abs_diff_eq!((1.0 - even) / (h * h), 0.5, epsilon = 1e-6);
    }
}

#[test]
fn real_limits_are_the_measured_ones_and_follow_the_square_of_the_stages() {
    let measured = [2.0, 6.1802, 9.8512, 16.6028, 22.9208, 32.2756, 41.2162];
    for (stages, expected) in (2..=8).zip(measured) {
        let limit = rkc_stability_limit(stages);
        assert!((limit - expected).abs() < 1e-4, "β({stages}) = {limit}");
        assert!(limit >= 0.653 * ((stages * stages - 1) as f64));
        let c = RkcCoefficients::new(stages);
        for k in 0..=2000 {
            let x = -limit * f64::from(k) / 2000.0;
            assert!(c.stability(x, 0.0).0.abs() <= 1.0 + 1e-12, "s = {stages}, x = {x}");
        }
        assert!(c.stability(-1.001 * limit, 0.0).0.abs() > 1.0);
    }
    for stages in [20_usize, 50, 100] {
        let ratio = rkc_stability_limit(stages) / (stages * stages - 1) as f64;
        assert!((ratio - 0.653).abs() < 2e-3, "{ratio}");
    }
}

#[test]
fn undamped_oscillations_are_amplified_as_predicted() {
    assert_abs_diff_eq!(rkc_growth(3, 0.697), 1.014708, epsilon = 1e-6);
    assert_abs_diff_eq!(rkc_growth(5, 0.697 * 2.5), 1.356912, epsilon = 1e-6);
    let constants = [(2, 0.25), (3, 0.1236), (4, 0.0964), (5, 0.0859), (6, 0.0806)];
    for (stages, constant) in constants {
        let y = 0.02_f64;
        let found = (rkc_growth(stages, y).powi(2) - 1.0) / y.powi(4);
        assert_abs_diff_eq!(found, constant, epsilon = 1e-3);
    }
}

#[test]
fn stage_numbers_follow_both_rules() {
    for (courant, stages) in
        [(0.1, 2), (0.392, 2), (0.394, 3), (1.047, 3), (1.049, 4), (1.966, 5), (3.145, 6), (4.586, 7)]
    {
        assert_eq!(rkc_stages_by_courant(courant), stages, "{courant}");
    }
    for radius in [0.0, 0.5, 3.0, 10.0, 100.0, 1e4] {
        let stages = rkc_stages(radius);
        assert!(rkc_stability_limit(stages) >= radius);
        assert!(stages == 2 || rkc_stability_limit(stages - 2) < radius, "{radius}: {stages}");
    }
    assert_eq!(rkc_stages(f64::NAN), 2);
    assert_eq!(rkc_stages(f64::INFINITY), usize::MAX);
}

/// `u′ = A u` on a line of points: diffusion, and optionally the wave equation `(q, v)` with a damper on the
/// difference of neighbours.
struct Line {
    points: usize,
    stiffness: f64,
    damping: f64,
    fixed_end: bool,
}

impl Line {
    fn laplace(&self, q: &[f64], i: usize) -> f64 {
        let left = if i == 0 { 0.0 } else { q[i - 1] };
        let right = if i + 1 == self.points { 0.0 } else { q[i + 1] };
        left - 2.0 * q[i] + right
    }

    /// Largest magnitude of the eigenvalues of the difference operator.
    fn top(&self) -> f64 {
        let free = self.points - usize::from(self.fixed_end);
        4.0 * (0.5 * std::f64::consts::PI * free as f64 / (free as f64 + 1.0)).sin().powi(2)
    }
}

impl Equations for Line {
    fn len(&self) -> usize {
        if self.stiffness > 0.0 { 2 * self.points } else { self.points }
    }

    fn rate(&self, _t: f64, u: &[f64], out: &mut [f64]) {
        if self.stiffness == 0.0 {
            for (i, out) in out.iter_mut().enumerate() {
                *out = self.damping * self.laplace(u, i);
            }
            if self.fixed_end {
                out[0] = 1e7 * u[0] + 3.0;
            }
            return;
        }
        let (q, v) = u.split_at(self.points);
        for i in 0..self.points {
            out[i] = v[i];
            out[self.points + i] = self.stiffness * self.laplace(q, i) + self.damping * self.laplace(v, i);
        }
    }

    fn jacobian(&self, _t: f64, _u: &[f64]) -> Vec<f64> {
        Vec::new()
    }

    fn impose(&self, _t: f64, u: &mut [f64]) {
        if self.fixed_end {
            u[0] = 0.0;
        }
    }
}

fn one_step(line: Line, step: f64) -> (TimeState, usize) {
    let n = line.len();
    let mut state = TimeState::new(0.0, (0..n).map(|i| (0.1 * i as f64).sin()).collect());
    if line.fixed_end {
        state.values[0] = 0.0;
    }
    let mut stepper = stepper(Scheme::Rkc(RkcOptions::default()), StepControl::Fixed { step });
    let report = stepper.advance(&mut Full::new(line), &mut state, 1e9).expect("one step");
    (state, report.stages.expect("stages"))
}

#[test]
fn the_spectral_radius_is_that_of_the_operator() {
    // Diffusion: real, negative.
    let line = Line { points: 40, stiffness: 0.0, damping: 100.0, fixed_end: false };
    let radius = 100.0 * line.top();
    let (state, stages) = one_step(line, 1.0);
    let memory = &state.memory;
    assert!((memory.spectral_radius / radius - 1.0).abs() < 0.1, "{} for {radius}", memory.spectral_radius);
    assert!(memory.dominant_damping > 0.99);
    assert_eq!(stages, rkc_stages(1.2 * memory.spectral_radius));
    // A prescribed entry with a nonsensical, fast rate is not part of the operator.
    let line = Line { points: 40, stiffness: 0.0, damping: 100.0, fixed_end: true };
    let radius = 100.0 * line.top();
    let (state, _) = one_step(line, 1.0);
    assert!((state.memory.spectral_radius / radius - 1.0).abs() < 0.1, "{}", state.memory.spectral_radius);
    // Waves: a conjugate pair; undamped, and with a damping ratio of 0.4 in the highest mode.
    for zeta in [0.0, 0.4] {
        let mut line = Line { points: 30, stiffness: 1e4, damping: 0.0, fixed_end: false };
        let omega = 100.0 * line.top().sqrt();
        line.damping = 2.0 * zeta * omega / line.top();
        let (state, _) = one_step(line, 1e-3);
        let memory = &state.memory;
        assert!((memory.spectral_radius / omega - 1.0).abs() < 0.1, "{} for {omega}", memory.spectral_radius);
        assert!((memory.dominant_damping - zeta).abs() < 0.1, "{} for {zeta}", memory.dominant_damping);
    }
}

#[test]
fn a_long_step_of_diffusion_is_stable_and_cheap() {
    let line = Line { points: 60, stiffness: 0.0, damping: 1e4, fixed_end: false };
    let mut system = Full::new(line);
    let mut state = TimeState::new(0.0, (0..60).map(|i| f64::from(i % 7)).collect());
    let mut stepper = stepper(Scheme::Rkc(RkcOptions::default()), StepControl::Fixed { step: 0.01 });
    run(&mut stepper, &mut system, &mut state, 1.0);
    // The slowest mode, exp(−1e4 · 4 sin²(π/122) t), has died out; the stiffest fall by 1 − ε/3 per step.
    assert!(state.values.iter().all(|u| u.abs() < 6.0 * 0.95_f64.powi(100)));
    // 400 Δt-limits of Euler's method in one step of 100 · √(400/0.653)/… ≈ 28 stages.
    let per_step = stepper.statistics().rate_evaluations as f64 / 100.0;
    assert!(per_step < 40.0, "{per_step}");
    assert_eq!(system.rates, stepper.statistics().rate_evaluations);
}

#[test]
fn too_many_stages_cut_the_step_and_bad_options_are_refused() {
    let options = RkcOptions { largest: 10, ..RkcOptions::default() };
    let line = Line { points: 20, stiffness: 0.0, damping: 100.0, fixed_end: false };
    let mut state = TimeState::new(0.0, vec![1.0; 20]);
    let mut stepper = stepper(Scheme::Rkc(options), StepControl::Fixed { step: 1.0 });
    let report = stepper.advance(&mut Full::new(line), &mut state, 1.0).expect("a shorter step");
    assert!(report.rejections.stages >= 1 && report.step < 1.0);
    assert!(report.stages.expect("stages") <= 10);

    let fixed = |stages| RkcOptions { stages: RkcStages::Fixed(stages), ..RkcOptions::default() };
    for options in [fixed(1), fixed(500), RkcOptions { largest: 1, ..RkcOptions::default() }] {
        let control = StepControl::Fixed { step: 1.0 };
        let error = nicolson_solvers::time::Stepper::new(Scheme::Rkc(options), control, None).err();
        assert!(matches!(error, Some(StepperError::Parameter { .. })));
    }
    let cause = StepCause::StageLimit { needed: 300, limit: 200 };
    assert_eq!(cause.to_string(), "300 stages needed for stability, 200 allowed");
}
