//! Values, rates and messages of expressions.

use super::Expression;

const AT: [f64; 3] = [0.3, -1.7, 2.2];
const T: f64 = 0.45;

fn value(text: &str) -> f64 {
    Expression::parse(text).unwrap_or_else(|error| panic!("{text}: {error}")).value(AT, T)
}

#[test]
fn values_follow_the_usual_rules() {
    let [x, y, z] = AT;
    let t = T;
    let cases: [(&str, f64); 34] = [
        ("1", 1.0),
        ("1e-3", 1e-3),
        (" 2.5E+2 ", 250.0),
        (".5", 0.5),
        ("3.", 3.0),
        ("-X^2", -(x * x)),
        ("2^-X^2", 2f64.powf(-(x * x))),
        ("2^3^2", 512.0),
        ("-2^2", -4.0),
        ("1-2-3", -4.0),
        ("8/4/2", 1.0),
        ("1+2*3", 7.0),
        ("(1+2)*3", 9.0),
        ("- -3", 3.0),
        ("+X", x),
        ("sin(pi*X/2)*cos(t)", (std::f64::consts::PI * x / 2.0).sin() * t.cos()),
        ("max(1, min(2, 3), X)", 2.0),
        ("min(max(X, Y), max(Y, Z))", x),
        ("atan2(Y, X)", y.atan2(x)),
        ("atan2(sin(X), cos(X))", x),
        ("if(X < 0.5, 10, 20)", 10.0),
        ("if(X > 0.5, 1/0, if(t > 1, 5, 6))", 6.0),
        ("X > 0 && Y < 0", 1.0),
        ("X > 0 && Y > 0 || !(Z < 0)", 1.0),
        ("X == 0.3", 1.0),
        ("X != 0.3", 0.0),
        ("(X >= 0)*(X <= 1)*2", 2.0),
        ("step(0)", 1.0),
        ("step(-1e-300)", 0.0),
        ("sign(Y) + sign(0)", -1.0),
        ("abs(Y)", 1.7),
        ("floor(Y) + ceil(Y)", -3.0),
        ("exp(ln(Z)) + sqrt(4) + log10(1000)", z + 5.0),
        ("1000*9.81*(2.5-Y)", 1000.0 * 9.81 * (2.5 - y)),
    ];
    for (text, expected) in cases {
        let found = value(text);
        assert!((found - expected).abs() <= 1e-12 * expected.abs().max(1.0), "{text}: {found} instead of {expected}");
    }
}

#[test]
fn rates_agree_with_central_differences() {
    let texts = [
        "t",
        "t^3 - 2*t",
        "0.1*sin(2*pi*t)*X",
        "cos(t*Z)/(1+t)",
        "tan(t)",
        "asin(t/2)",
        "acos(t/2)",
        "atan(3*t)",
        "sinh(t)*cosh(t)",
        "tanh(2*t)",
        "exp(-t^2)",
        "ln(1+t)",
        "log10(1+t)",
        "sqrt(t+X)",
        "abs(t-1)",
        "min(t, 0.1)",
        "max(t, 0.1, X*t)",
        "atan2(t, 1-t)",
        "2^t",
        "t^t",
        "if(t < 0.4, 0, (t-0.4)^2)",
        "step(t-0.2)*t",
        "(t > 0.2)*sin(t)",
        "!(t > 2)*t",
        "floor(t)*t + ceil(t)*t",
        "sign(t)*t",
        "-t^2/-(1+t)",
    ];
    for text in texts {
        let expression = Expression::parse(text).unwrap();
        let h = 1e-5;
        let difference = (expression.value(AT, T + h) - expression.value(AT, T - h)) / (2.0 * h);
        let rate = expression.rate(AT, T);
        assert!((rate - difference).abs() <= 1e-8 * difference.abs().max(1.0), "{text}: {rate} against {difference}");
        assert!(expression.depends_on_time());
    }
}

#[test]
fn constants_have_no_rate_even_at_infinite_slopes() {
    for text in ["sqrt(0)", "0^0.5", "X", "asin(1)", "sqrt(0*X)", "abs(Y)^0.5", "atan2(0, 0)"] {
        assert_eq!(Expression::parse(text).unwrap().rate(AT, T), 0.0, "{text}");
    }
    assert_eq!(Expression::constant(4.0).value(AT, T), 4.0);
    assert_eq!(Expression::parse("2+3").unwrap().as_constant(), Some(5.0));
}

#[test]
fn a_value_that_is_no_number_is_not_hidden() {
    for text in
        ["0/0", "sqrt(-1)", "min(0/0, 1)", "min(1, 0/0)", "max(1, 0/0)", "if(0/0, 1, 2)", "step(0/0)", "ln(-1)*t"]
    {
        assert!(value(text).is_nan(), "{text} gives {}", value(text));
    }
}

#[test]
fn mentions_are_known() {
    let expression = Expression::parse("X*sin(t)").unwrap();
    assert!(expression.depends_on_time() && expression.depends_on_coordinate(0));
    assert!(!expression.depends_on_coordinate(1) && !expression.depends_on_coordinate(7));
    assert_eq!(expression.to_string(), "X*sin(t)");
}

/// A random expression as text, with its value and rate computed alongside by other code.
fn random(state: &mut u64, depth: usize) -> (String, f64, f64) {
    let mut next = |bound: u64| {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*state >> 33) % bound
    };
    let kind = if depth == 0 { next(4) } else { 4 + next(9) };
    match kind {
        0 => ("X".into(), AT[0], 0.0),
        1 => ("Y".into(), AT[1], 0.0),
        2 => ("t".into(), T, 1.0),
        3 => {
            let number = f64::from(u32::try_from(next(1000)).unwrap()) / 64.0;
            (format!("{number}"), number, 0.0)
        }
        kind => {
            let (a, av, ar) = random(state, depth - 1);
            let (b, bv, br) = random(state, depth - 1);
            match kind {
                4 => (format!("({a}) + ({b})"), av + bv, ar + br),
                5 => (format!("({a}) - ({b})"), av - bv, ar - br),
                6 => (format!("({a})*({b})"), av * bv, ar * bv + av * br),
                7 => (format!("({a})/(2+abs({b}))"), av / (2.0 + bv.abs()), {
                    let q = 2.0 + bv.abs();
                    let qr = if bv == 0.0 { 0.0 } else { bv.signum() * br };
                    (ar * q - av * qr) / (q * q)
                }),
                8 => (format!("-sin({a})"), -av.sin(), -av.cos() * ar),
                9 => (format!("min({a}, {b})"), if av <= bv { av } else { bv }, if av <= bv { ar } else { br }),
                10 => {
                    (format!("if({a} < {b}, {b}, {a})"), if av < bv { bv } else { av }, if av < bv { br } else { ar })
                }
                11 => (format!("({a})^2"), av * av, 2.0 * av * ar),
                _ => (format!("tanh({a}) - ({b})*1"), av.tanh() - bv, (1.0 - av.tanh().powi(2)) * ar - br),
            }
        }
    }
}

#[test]
fn random_expressions_agree_with_independent_arithmetic() {
    let mut state = 7;
    for round in 0..700 {
        let (text, expected, rate) = random(&mut state, 1 + round % 7);
        if text.len() > super::LONGEST_TEXT {
            continue;
        }
        let expression = Expression::parse(&text).unwrap_or_else(|error| panic!("{text}: {error}"));
        let (found, found_rate) = (expression.value(AT, T), expression.rate(AT, T));
        assert!((found - expected).abs() <= 1e-9 * expected.abs().max(1.0), "{text}: {found} instead of {expected}");
        assert!((found_rate - rate).abs() <= 1e-9 * rate.abs().max(1.0), "{text}: rate {found_rate}, not {rate}");
    }
}

#[test]
fn long_expressions_are_evaluated_whole() {
    let terms: Vec<String> = (1..=300).map(|factor| format!("{factor}*t")).collect();
    let expression = Expression::parse(&terms.join("+")).unwrap();
    assert_eq!((expression.value(AT, 2.0), expression.rate(AT, 2.0)), (90_300.0, 45_150.0));
    let nested = format!("{}t{}", "abs(1-".repeat(40), ")".repeat(40));
    assert_eq!(Expression::parse(&nested).unwrap().value(AT, 0.25), 0.25);
}

#[test]
fn expressions_can_be_shared_among_threads() {
    fn shareable<T: Send + Sync + Clone>() {}
    shareable::<Expression>();
}
