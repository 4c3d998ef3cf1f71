//! Systems of nonlinear equations of J. J. Moré, B. S. Garbow and K. E. Hillstrom, *Testing
//! unconstrained optimization software*, ACM TOMS 7 (1981) 17–41, with their standard starting points
//! (the numbers are those of the paper; the systems form MINPACK's `vecfcn`).

use super::support::{Dual, Equations, constant};

pub struct TestFunction {
    pub name: &'static str,
    pub start: Vec<f64>,
    pub equations: fn(&[Dual]) -> Vec<Dual>,
}

impl TestFunction {
    pub fn problem(&self) -> Equations {
        Equations::new(self.start.len(), self.equations)
    }
}

pub fn all() -> Vec<TestFunction> {
    let grid = |n: usize| -> Vec<f64> { (1..=n).map(|j| j as f64 / (n + 1) as f64).collect() };
    let parabola: Vec<f64> = grid(10).iter().map(|t| t * (t - 1.0)).collect();
    let case = |name, start: &[f64], equations| TestFunction { name, start: start.to_vec(), equations };
    vec![
        case("Rosenbrock (1)", &[-1.2, 1.0], rosenbrock),
        case("Freudenstein-Roth (2)", &[0.5, -2.0], freudenstein_roth),
        case("Powell badly scaled (3)", &[0.0, 1.0], powell_badly_scaled),
        case("helical valley (7)", &[-1.0, 0.0, 0.0], helical_valley),
        case("Powell singular (13)", &[3.0, -1.0, 0.0, 1.0], powell_singular),
        case("Wood (14)", &[-3.0, -1.0, -3.0, -1.0], wood),
        case("Watson (20), n = 6", &[0.0; 6], watson),
        case(
            "variably dimensioned (25), n = 10",
            &(1..=10).map(|j| 1.0 - f64::from(j) / 10.0).collect::<Vec<_>>(),
            variably_dimensioned,
        ),
        case("trigonometric (26), n = 10", &[0.1; 10], trigonometric),
        case("Brown almost linear (27), n = 10", &[0.5; 10], brown_almost_linear),
        case("discrete boundary value (28), n = 10", &parabola, discrete_boundary_value),
        case("discrete integral (29), n = 10", &parabola, discrete_integral),
        case("Broyden tridiagonal (30), n = 10", &[-1.0; 10], broyden_tridiagonal),
        case("Broyden banded (31), n = 10", &[-1.0; 10], broyden_banded),
        case("Chebyquad (35), n = 5", &grid(5), chebyquad),
        case("Chebyquad (35), n = 7", &grid(7), chebyquad),
        // There is no zero for n = 8: every method must fail.
        case("Chebyquad (35), n = 8", &grid(8), chebyquad),
    ]
}

pub fn rosenbrock(x: &[Dual]) -> Vec<Dual> {
    vec![constant(1.0) - x[0], (x[1] - x[0] * x[0]) * 10.0]
}

fn freudenstein_roth(x: &[Dual]) -> Vec<Dual> {
    vec![x[0] - 13.0 + ((constant(5.0) - x[1]) * x[1] - 2.0) * x[1], x[0] - 29.0 + ((x[1] + 1.0) * x[1] - 14.0) * x[1]]
}

fn powell_badly_scaled(x: &[Dual]) -> Vec<Dual> {
    vec![x[0] * x[1] * 1e4 - 1.0, (-x[0]).exp() + (-x[1]).exp() - 1.0001]
}

fn helical_valley(x: &[Dual]) -> Vec<Dual> {
    let turn = 2.0 * std::f64::consts::PI;
    let angle = if x[0].value > 0.0 {
        (x[1] / x[0]).atan() / turn
    } else if x[0].value < 0.0 {
        (x[1] / x[0]).atan() / turn + 0.5
    } else {
        constant(0.25_f64.copysign(x[1].value))
    };
    vec![(x[2] - angle * 10.0) * 10.0, ((x[0] * x[0] + x[1] * x[1]).sqrt() - 1.0) * 10.0, x[2]]
}

fn powell_singular(x: &[Dual]) -> Vec<Dual> {
    let (a, b) = (x[1] - x[2] * 2.0, x[0] - x[3]);
    vec![x[0] + x[1] * 10.0, (x[2] - x[3]) * 5.0_f64.sqrt(), a * a, b * b * 10.0_f64.sqrt()]
}

fn wood(x: &[Dual]) -> Vec<Dual> {
    let (a, b) = (x[1] - x[0] * x[0], x[3] - x[2] * x[2]);
    vec![
        x[0] * a * -200.0 - (constant(1.0) - x[0]),
        a * 200.0 + (x[1] - 1.0) * 20.2 + (x[3] - 1.0) * 19.8,
        x[2] * b * -180.0 - (constant(1.0) - x[2]),
        b * 180.0 + (x[3] - 1.0) * 20.2 + (x[1] - 1.0) * 19.8,
    ]
}

fn watson(x: &[Dual]) -> Vec<Dual> {
    let mut f = vec![constant(0.0); x.len()];
    for i in 1..=29 {
        let t = f64::from(i) / 29.0;
        let (mut slope, mut value) = (constant(0.0), constant(0.0));
        for (j, x) in x.iter().enumerate() {
            if j > 0 {
                slope = slope + *x * (j as f64 * t.powi(j as i32 - 1));
            }
            value = value + *x * t.powi(j as i32);
        }
        let term = slope - value * value - 1.0;
        for (j, f) in f.iter_mut().enumerate() {
            *f = *f + (constant(j as f64) - value * (2.0 * t)) * term * t.powi(j as i32 - 1);
        }
    }
    let term = x[1] - x[0] * x[0] - 1.0;
    f[0] = f[0] + x[0] * (constant(1.0) - term * 2.0);
    f[1] = f[1] + term;
    f
}

fn variably_dimensioned(x: &[Dual]) -> Vec<Dual> {
    let mut sum = constant(0.0);
    for (j, x) in x.iter().enumerate() {
        sum = sum + (*x - 1.0) * (j + 1) as f64;
    }
    let common = sum * (sum * sum * 2.0 + 1.0);
    x.iter().enumerate().map(|(j, x)| *x - 1.0 + common * (j + 1) as f64).collect()
}

fn trigonometric(x: &[Dual]) -> Vec<Dual> {
    let mut sum = constant(x.len() as f64);
    for x in x {
        sum = sum - x.cos();
    }
    x.iter().enumerate().map(|(j, x)| sum + (constant(1.0) - x.cos()) * (j + 1) as f64 - x.sin()).collect()
}

fn brown_almost_linear(x: &[Dual]) -> Vec<Dual> {
    let (mut sum, mut product) = (constant(-(x.len() as f64 + 1.0)), constant(1.0));
    for x in x {
        sum = sum + *x;
        product = product * *x;
    }
    let mut f: Vec<Dual> = x.iter().map(|x| *x + sum).collect();
    f[x.len() - 1] = product - 1.0;
    f
}

fn neighbour(x: &[Dual], i: usize, offset: isize) -> Dual {
    i.checked_add_signed(offset).and_then(|i| x.get(i)).copied().unwrap_or(constant(0.0))
}

pub fn discrete_boundary_value(x: &[Dual]) -> Vec<Dual> {
    let h = 1.0 / (x.len() + 1) as f64;
    let equation = |i: usize| {
        let cube = (x[i] + (h * (i + 1) as f64 + 1.0)).cube();
        x[i] * 2.0 - neighbour(x, i, -1) - neighbour(x, i, 1) + cube * (0.5 * h * h)
    };
    (0..x.len()).map(equation).collect()
}

fn discrete_integral(x: &[Dual]) -> Vec<Dual> {
    let h = 1.0 / (x.len() + 1) as f64;
    let t = |i: usize| h * (i + 1) as f64;
    let equation = |i: usize| {
        let mut sum = constant(0.0);
        for (j, x) in x.iter().enumerate() {
            let weight = if j <= i { (1.0 - t(i)) * t(j) } else { t(i) * (1.0 - t(j)) };
            sum = sum + (*x + (t(j) + 1.0)).cube() * weight;
        }
        x[i] + sum * (0.5 * h)
    };
    (0..x.len()).map(equation).collect()
}

pub fn broyden_tridiagonal(x: &[Dual]) -> Vec<Dual> {
    let equation = |i| (constant(3.0) - x[i] * 2.0) * x[i] - neighbour(x, i, -1) - neighbour(x, i, 1) * 2.0 + 1.0;
    (0..x.len()).map(equation).collect()
}

fn broyden_banded(x: &[Dual]) -> Vec<Dual> {
    let equation = |i: usize| {
        let mut f = x[i] * (x[i] * x[i] * 5.0 + 2.0) + 1.0;
        for (j, x) in x.iter().enumerate().take(i + 2).skip(i.saturating_sub(5)) {
            if j != i {
                f = f - *x * (*x + 1.0);
            }
        }
        f
    };
    (0..x.len()).map(equation).collect()
}

fn chebyquad(x: &[Dual]) -> Vec<Dual> {
    let n = x.len();
    let mut f = vec![constant(0.0); n];
    for x in x {
        let argument = *x * 2.0 - 1.0;
        let (mut before, mut now) = (constant(1.0), argument);
        for f in &mut f {
            *f = *f + now / n as f64;
            (before, now) = (now, argument * now * 2.0 - before);
        }
    }
    // The integral of the even polynomials over [0, 1] is −1/(k² − 1), that of the odd ones vanishes.
    for k in (2..=n).step_by(2) {
        f[k - 1] = f[k - 1] + 1.0 / (k * k - 1) as f64;
    }
    f
}
