//! Quantities: values to the bit, dimensions, mistakes, systems.

use super::*;

const LENGTH: Dimension = [1, 0, 0, 0];

#[test]
fn decimal_prefixes_keep_the_bits_of_the_number() {
    for (text, value, dimension) in [
        ("5 mm", 0.005, LENGTH),
        ("9mm", 0.009, LENGTH),
        ("+.7 cm", 0.007, LENGTH),
        ("1.5e3 um", 0.0015, LENGTH),
        ("3 µm", 3e-6, LENGTH),
        ("3 μm", 3e-6, LENGTH),
        ("2 dam", 20.0, LENGTH),
        ("210 GPa", 210e9, Pressure::DIMENSION),
        ("-2.1E2 GPa", -210e9, Pressure::DIMENSION),
        ("0.2 ms", 0.0002, Time::DIMENSION),
        ("7850 kg/m^3", 7850.0, Density::DIMENSION),
        ("7.85 g/cm³", 7850.0, Density::DIMENSION),
        ("7.85e-9 tonne/mm^3", 7850.0, Density::DIMENSION),
        ("9.81 m/s^2", 9.81, Acceleration::DIMENSION),
        ("9.81 m*s^-2", 9.81, Acceleration::DIMENSION),
        ("9.81 m·s^-1/s", 9.81, Acceleration::DIMENSION),
        ("9.81 m/(s*s)", 9.81, Acceleration::DIMENSION),
        ("30 deg", 30.0, Angle::DIMENSION),
        ("30°", 30.0, Angle::DIMENSION),
        ("1 kPa*s", 1000.0, Viscosity::DIMENSION),
        ("1 N*s/m²", 1.0, Viscosity::DIMENSION),
        ("1 cP", 0.001, Viscosity::DIMENSION),
        ("3 kN/mm^2", 3e9, Pressure::DIMENSION),
        ("2 J/(kg*m)", 2.0, Acceleration::DIMENSION),
        ("1 bar", 1e5, Pressure::DIMENSION),
        ("10 mbar", 1e3, Pressure::DIMENSION),
        ("50 1/s", 50.0, [0, 0, -1, 0]),
        ("50 Hz", 50.0, [0, 0, -1, 0]),
        ("3 kW", 3000.0, [2, 1, -3, 0]),
        ("1 gn", 9.80665, Acceleration::DIMENSION),
        ("12 in", 0.3048, LENGTH),
        ("1 ft", 0.3048, LENGTH),
        ("2 min", 120.0, Time::DIMENSION),
        ("1.5 h", 5400.0, Time::DIMENSION),
        ("36 km/h", 10.0, Velocity::DIMENSION),
        ("1 lb", 0.453_592_37, [0, 1, 0, 0]),
        ("1 lbf", 4.448_221_615_260_5, [1, 1, -2, 0]),
        ("1 kip", 4_448.221_615_260_5, [1, 1, -2, 0]),
        ("1 atm", 101_325.0, Pressure::DIMENSION),
        ("1 ksi", 6_894_757.293_168_361, Pressure::DIMENSION),
        ("1e-400 km", 0.0, LENGTH),
    ] {
        assert_eq!(read(text), Ok((value, dimension)), "{text}");
    }
}

/// Named by their definitions: 1 psi = 1 lbf/in², 1 slug = 1 lbf s²/ft, 180° = π.
#[test]
fn rounded_units_agree_with_their_definitions() {
    for (one, other) in [("1 psi", "1 lbf/in^2"), ("1 slug", "1 lbf*s^2/ft"), ("3.141592653589793 rad", "180 deg")] {
        let ((a, kind), (b, same)) = (read(one).unwrap(), read(other).unwrap());
        assert_eq!(kind, same);
        assert!((a / b - 1.0).abs() < 4.0 * f64::EPSILON, "{one} is {a}, {other} is {b}");
    }
}

/// Every symbol with every prefix is read as itself, and means what it says.
#[test]
fn every_symbol_is_its_own() {
    for name in ["m", "g", "s", "N", "Pa", "J", "W", "Hz", "bar", "P", "rad"] {
        let (one, dimension) = read(&format!("1 {name}")).unwrap();
        for (prefix, factor) in [("k", 1e3), ("M", 1e6), ("G", 1e9), ("c", 1e-2), ("u", 1e-6), ("n", 1e-9)] {
            let (value, same) = read(&format!("1 {prefix}{name}")).unwrap();
            assert_eq!(same, dimension, "{prefix}{name}");
            assert!((value / (one * factor) - 1.0).abs() < 1e-15, "{prefix}{name}: {value}");
        }
    }
    // Minutes, not milli-inches; Pa, not peta-anything.
    assert_eq!(read("1 min").unwrap().0, 60.0);
    assert!(read("1 kmin").is_err() && read("1 kdeg").is_err() && read("1 kkg").is_err());
}

#[test]
fn mistakes_are_named() {
    for (text, message, remedy) in [
        ("5", "has no unit", "remove the quotes"),
        ("mm", "does not begin with a number", "such as `5 mm`"),
        ("", "does not begin", "5 mm"),
        ("5 mmm", "unknown unit `mmm`", "did you mean `mm`?"),
        ("5 Mpa", "unknown unit `Mpa`", "did you mean `MPa`?"),
        ("5 gpa", "unknown unit `gpa`", "did you mean `GPa`?"),
        ("5 KG", "unknown unit `KG`", "did you mean `kg`?"),
        ("5 hz", "unknown unit `hz`", "did you mean `Hz`?"),
        ("5 inch", "unknown unit `inch`", "did you mean `in`?"),
        ("5 t", "unknown unit `t`", "did you mean `tonne`?"),
        ("5 seconds", "unknown unit", "did you mean `s`?"),
        ("5 degrees", "unknown unit", "did you mean `deg`?"),
        ("5 Pas", "unknown unit `Pas`", "did you mean `Pa*s`?"),
        ("5 xyzzy", "unknown unit `xyzzy`", "units are m g s N Pa"),
        ("5 Pa s", "`s` means nothing in a unit", "write `*`"),
        ("5 m + 3 mm", "`+` means nothing", "part of an expression"),
        ("5 m^0.5", "`.` means nothing", "units are like"),
        ("5 m^", "not a power", "whole number"),
        ("5 m^99", "not a power", "whole number"),
        ("5 m^-2147483648", "not a power", "whole number"),
        ("5 m^9999999999", "not a power", "whole number"),
        ("5 (((((((am^9)^9)^9)^9)^9)^9)^9)^-9", "too large", "1.7e308"),
        ("5 m/", "ends too early", "m/s^2"),
        ("5 m/(s", "never closed", "missing `)`"),
        ("5 $", "`$` means nothing", "units are like"),
        ("5 m\u{7}", "means nothing", "units are like"),
        ("1e308 km", "too large", "1.7e308"),
        ("1e99999999999 m", "too large", "1.7e308"),
    ] {
        let error = read(text).unwrap_err();
        assert!(error.message.contains(message) && error.remedy.contains(remedy), "{text:?}: {error:?}");
    }
    assert!(read(&format!("1 {}m{}", "(".repeat(20), ")".repeat(20))).unwrap_err().message.contains("too deep"));
    assert!(read(&format!("1 {}", "m*".repeat(300))).unwrap_err().message.contains("too long"));
}

#[test]
fn a_quantity_is_a_number_and_a_name_that_is_none_of_expressions() {
    let is = |text: &str| is_quantity(text, crate::expression::is_name);
    for text in ["5 mm", " -9.81 m/s^2 ", "5mmm", "1e3 Pa", "30°", "3 µm", "5 e"] {
        assert!(is(text), "{text}");
    }
    for text in
        ["5", "5*X", "2X", "2 x", "5 t", "2 pi", "3 sin(X)", "2exp(1)", "X", "mm", "", "(5 mm)", "- 5 mm", "5 1/s"]
    {
        assert!(!is(text), "{text}");
    }
}

#[test]
fn dimensions_have_names() {
    assert_eq!(describe(Pressure::DIMENSION), "a pressure");
    assert_eq!(describe([1, 1, -2, 0]), "a force");
    assert_eq!(describe([0; 4]), "a number without a unit");
    assert_eq!(describe([1, -1, 2, 0]), "a quantity in m*kg^-1*s^2");
    assert_eq!(wanted::<Length>(), "a number in m, or a length such as \"5 mm\"");
}

/// Every example of a kind is of that kind.
#[test]
fn examples_are_of_their_kind() {
    fn check<K: Kind>() {
        assert_eq!(read(K::EXAMPLE).unwrap().1, K::DIMENSION, "{}", K::NAME);
    }
    check::<Length>();
    check::<Time>();
    check::<Velocity>();
    check::<Acceleration>();
    check::<Density>();
    check::<Pressure>();
    check::<Viscosity>();
    check::<Angle>();
}

/// Density of steel, a modulus and gravity, as they are known in each system.
#[test]
fn systems_are_consistent() {
    use UnitSystem::*;
    for (system, steel, modulus, gravity) in [
        (MetreKilogramSecond, 7850.0, 210e9, 9.81),
        (MillimetreTonneSecond, 7.85e-9, 210e3, 9810.0),
        (MillimetreKilogramMillisecond, 7.85e-6, 210.0, 9.81e-3),
        (MillimetreGramMillisecond, 7.85e-3, 210e3, 9.81e-3),
        (CentimetreGramMicrosecond, 7.85, 2.1, 9.81e-10),
    ] {
        let close = |found: f64, wanted: f64| assert!((found / wanted - 1.0).abs() < 1e-15, "{system:?}: {found}");
        close(system.in_si(steel, Density::DIMENSION), 7850.0);
        close(system.in_si(modulus, Pressure::DIMENSION), 210e9);
        close(system.in_si(gravity, Acceleration::DIMENSION), 9.81);
        assert_eq!(system.in_si(30.0, Angle::DIMENSION), 30.0);
        assert_eq!(within(system, current), system);
        assert_eq!(current(), MetreKilogramSecond);
        assert!(system.in_si(f64::NAN, LENGTH).is_nan() && system.in_si(f64::INFINITY, LENGTH).is_infinite());
    }
    // Rounded once, as if written in SI.
    assert_eq!(MillimetreTonneSecond.in_si(9.0, LENGTH), 0.009);
}
