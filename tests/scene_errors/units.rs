//! Quantities with units: mistakes in them, and that they mean what they say.

use nicolson::material::Volumetric;
use nicolson::scene::Scene;
use nicolson::setup::{ExactSolution, Setup};

use super::support::written;
use super::{GOOD, check};

#[test]
fn a_quantity_of_the_wrong_kind_is_refused_where_it_stands() {
    check(&[
        ("spacing = 0.25", "spacing = ▶\"5 Pa\"", "`5 Pa` is a pressure, but a length is wanted", "such as \"5 mm\""),
        ("spacing = 0.25", "spacing = ▶\"5\"", "`5` in quotes has no unit", "remove the quotes"),
        ("spacing = 0.25", "spacing = ▶\"5 mmm\"", "unknown unit `mmm`", "did you mean `mm`?"),
        ("spacing = 0.25", "spacing = ▶\"-5 mm\"", "`spacing` is -0.005 m, but must be positive", "positive"),
        ("upper = [2.5, 2.5]", "upper = [2.5, ▶\"2.5 s\"]", "is a time, but a length is wanted", "a number in m"),
        ("[0.0, -9.81]", "[0.0, ▶\"-9.81 m/s\"]", "is a velocity, but an acceleration", "9.81 m/s^2"),
        ("density = 1000.0, gamma", "density = ▶\"1 kg\", gamma", "is a mass, but a density", "7850 kg/m^3"),
        ("wave_speed = 10.0", "wave_speed = ▶\"10 Hz\"", "is a frequency, but a velocity", "36 km/h"),
        ("youngs_modulus = 1e6", "youngs_modulus = ▶\"1 N\"", "is a force, but a pressure", "210 GPa"),
        ("poissons_ratio = 0.3", "poissons_ratio = ▶\"0.3 m\"", "expected a number", "a number"),
        ("level = 2.5", "level = ▶\"2.5 m^2\"", "is an area, but a length", "5 mm"),
        ("\"0.001*Y\"]\nvelocity", "▶\"1 kPa\"]\nvelocity", "is a pressure, but a length", "5 mm"),
        ("[\"0\", \"-1\"]", "[\"0\", ▶\"-1 m\"]", "is a length, but a velocity", "36 km/h"),
        ("[\"1e4*sin(t)\", 0]", "[\"1e4*sin(t)\", ▶\"1 N\"]", "is a force, but a pressure", "210 GPa"),
        ("[\"1e4*sin(t)\", 0]", "[▶\"5 kPa + 1 Pa\", 0]", "`+` means nothing in a unit", "part of an expression"),
        ("end = 1.0", "end = ▶\"1 m\"", "is a length, but a time", "0.2 ms"),
        ("interval = 0.05", "interval = ▶\"0.05 m\"", "is a length, but a time", "0.2 ms"),
        ("at = [2.5, 2.5]", "at = [2.5, ▶\"2.5 kg\"]", "is a mass, but a length", "5 mm"),
    ]);
}

fn set_up(text: &str) -> (Scene, String) {
    let scene = written::scene(text);
    let (setup, _) = scene.setup::<2>().unwrap_or_else(|errors| panic!("{errors}"));
    (scene, format!("{setup:?}"))
}

/// The same scene with units everywhere is the same to the last bit, and keeps its text.
#[test]
fn quantities_are_the_numbers_they_stand_for() {
    let mut text = GOOD.to_owned();
    for (plain, quantity) in [
        ("gravity = [0.0, -9.81]", "gravity = [\"0 m/s^2\", \"-981 cm/s^2\"]"),
        ("spacing = 0.25", "spacing = \"250 mm\""),
        ("upper = [2.5, 2.5]", "upper = [\"2.5 m\", \"2500 mm\"]"),
        (
            "density = 1000.0, gamma = 7.0, wave_speed = 10.0",
            "density = \"1 g/cm^3\", gamma = 7.0, wave_speed = \"36 km/h\"",
        ),
        ("youngs_modulus = 1e6", "youngs_modulus = \"1 MPa\""),
        ("velocity = [\"0\", \"-1\"]", "velocity = [\"0 m/s\", -1]"),
        ("level = 2.5", "level = \"0.0025 km\""),
        ("point = [0.0, 0.0]", "point = [\"0 mm\", 0]"),
        ("value = [\"1e4*sin(t)\", 0]", "value = [\"1e4*sin(t)\", \"0 Pa\"]"),
        ("end = 1.0", "end = \"1000 ms\""),
        ("step = 0.05\n", "step = \"50 ms\"\n"),
        ("interval = 0.05", "interval = \"50000 us\""),
        ("at = [2.5, 2.5]", "at = [\"250 cm\", 2.5]"),
    ] {
        assert_eq!(text.matches(plain).count(), 1, "{plain}");
        text = text.replace(plain, quantity);
    }
    // What is a text in the one is a number in the other, here and above.
    let plain = GOOD.replace("velocity = [\"0\", \"-1\"]", "velocity = [0, -1]");
    let ((one, setup), (other, same)) = (set_up(&text), set_up(&plain));
    assert_eq!(setup, same);
    assert_eq!((one.time.clone(), one.output.clone()), (other.time, other.output));
    assert_eq!(one.text(), text);
}

/// Numbers and expressions in millimetres, tonnes and seconds; the fields agree at points of the body.
#[test]
fn a_declared_system_scales_numbers_and_expressions() {
    let mut text = GOOD.to_owned();
    for (metres, millimetres) in [
        ("dimension = 2", "dimension = 2\nunits = \"mm-tonne-s\""),
        ("gravity = [0.0, -9.81]", "gravity = [0.0, -9810]"),
        ("body_force = [\"0.1*sin(t)\", 0]", "body_force = [\"100*sin(t)\", 0]"),
        ("spacing = 0.25", "spacing = \"0.25 m\""),
        ("{ lower = [0.0, 0.0], upper = [2.5, 2.5] }", "{ lower = [0.0, 0.0], upper = [2500, 2.5e3] }"),
        ("density = 1000.0, gamma = 7.0, wave_speed = 10.0", "density = 1e-9, gamma = 7.0, wave_speed = 1e4"),
        ("{ lower = [5.0, 0.0], upper = [6.0, 1.25] }", "{ lower = [5000, 0.0], upper = [6000, 1250] }"),
        ("density = 1000.0, youngs_modulus = 1e6", "density = 1e-9, youngs_modulus = 1"),
        (
            "displacement = [0, \"0.001*Y\"]\nvelocity = [\"0\", \"-1\"]",
            "displacement = [0, \"0.001*Y\"]\nvelocity = [\"0\", \"-1000\"]",
        ),
        ("level = 2.5", "level = 2500"),
        ("select.where = \"Y > 2.4\"", "select.where = \"Y > 2400\""),
        ("displacement = { y = \"0.1*sin(t)\" }", "displacement = { y = \"100*sin(t)\" }"),
        ("{ lower = [5.0, 0.0], upper = [5.2, 9.0] }", "{ lower = [5000, 0.0], upper = [5200, 9000] }"),
        ("value = [\"1e4*sin(t)\", 0]", "value = [\"1e-2*sin(t)\", 0]"),
        ("at = [2.5, 2.5]", "at = [2500, 2500]"),
        ("at = [5.5, 0.5]", "at = [5500, 500]"),
        ("pressure = \"1000*t\"", "pressure = \"1e-3*t\""),
    ] {
        assert_eq!(text.matches(metres).count(), 1, "{metres}");
        text = text.replace(metres, millimetres);
    }
    let [one, other] = [&text, GOOD].map(|text| written::set_up::<2>(text).0);
    assert_eq!(one.particles.positions, other.particles.positions);
    assert_eq!(one.particles.volumes, other.particles.volumes);
    assert_eq!((&one.constraints, one.gravity), (&other.constraints, other.gravity));
    assert_eq!(one.bodies[0].material.density, 1000.0);
    let close = |a: f64, b: f64| assert!((a - b).abs() <= 1e-14 * b.abs(), "{a} is not {b}");
    let modulus = |setup: &Setup<2>| match setup.bodies[1].material.volumetric {
        Some(Volumetric::Linear(law)) => law.bulk_modulus,
        other => panic!("{other:?}"),
    };
    close(modulus(&one), modulus(&other));
    for (a, b) in one.initial.displacement.iter().zip(&other.initial.displacement) {
        close(a[1], b[1]);
    }
    for (a, b) in one.initial.pressure.iter().flatten().zip(other.initial.pressure.iter().flatten()) {
        close(*a, *b);
    }
    for time in [0.3, 0.7] {
        let at = [1.0, 2.0, 0.0];
        close(one.motions[0].value(at, time), other.motions[0].value(at, time));
        close(one.motions[0].rate(at, time), other.motions[0].rate(at, time));
        close(one.tractions[0].value[0].value(at, time), other.tractions[0].value[0].value(at, time));
        let (force, same) = (one.body_force.as_ref().unwrap(), other.body_force.as_ref().unwrap());
        close(force[0].value(at, time), same[0].value(at, time));
        let pressure =
            |exact: &Option<ExactSolution<2>>| exact.as_ref().unwrap().pressure.as_ref().unwrap().value(at, time);
        close(pressure(&one.exact), pressure(&other.exact));
    }
}
