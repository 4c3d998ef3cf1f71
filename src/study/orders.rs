//! Sizes, errors and observed orders.
//!
//! Errors `e = C h^p` on two levels give `p = ln(e₁/e₂) / ln(h₁/h₂)`. Values `v = v* + C h^p` without a known limit take
//! three levels (Richardson 1911): `(v₁ − v₂)/(v₂ − v₃) = (h₁^p − h₂^p)/(h₂^p − h₃^p)` has one root p, and then
//! `v* = v₃ + (v₃ − v₂)/((h₂/h₃)^p − 1)`.

use toml_edit::Item;

use super::entries::{Entry, number};
use crate::scene::findings::{Findings, Span};

/// Highest order looked for.
const HIGHEST_ORDER: f64 = 20.0;

/// One level of a convergence study.
#[derive(Debug, Clone, PartialEq)]
pub struct Level {
    /// Number of the case.
    pub case: usize,
    /// Size h.
    pub size: f64,
    /// What was measured; none where the case was not completed.
    pub value: Option<f64>,
    /// Distance from the limit.
    pub error: Option<f64>,
    /// Order from the level before to this one.
    pub order: Option<f64>,
}

/// What errors are measured against.
#[derive(Debug, Clone, PartialEq)]
pub enum Reference {
    /// The quantity is an error itself.
    Itself,
    /// A known value.
    Exact(f64),
    /// Extrapolated from the three finest levels.
    Extrapolated {
        /// The limit.
        value: f64,
        /// The order that goes with it.
        order: f64,
    },
    /// There is none.
    Unknown(&'static str),
}

/// Errors and orders of values measured on levels from coarse to fine.
pub(super) fn levels(
    cases: &[(usize, f64)],
    values: &[Option<f64>],
    is_error: bool,
    exact: Option<f64>,
) -> (Vec<Level>, Reference) {
    let values: Vec<Option<f64>> = values.iter().map(|value| value.filter(|value| value.is_finite())).collect();
    let known: Vec<(f64, f64)> =
        cases.iter().zip(&values).filter_map(|((_, size), value)| Some((*size, (*value)?))).collect();
    let reference = match exact {
        _ if is_error => Reference::Itself,
        Some(exact) => Reference::Exact(exact),
        None => extrapolated(&known),
    };
    let error = |value: f64| match reference {
        Reference::Itself => Some(value.abs()),
        Reference::Exact(limit) | Reference::Extrapolated { value: limit, .. } => Some((value - limit).abs()),
        Reference::Unknown(_) => None,
    };
    let mut levels: Vec<Level> = Vec::new();
    for (&(case, size), &value) in cases.iter().zip(&values) {
        let error = value.and_then(error);
        let before = levels.iter().rev().find_map(|level| Some((level.size, level.error?)));
        let order = match (reference.clone(), before, error) {
            // Errors against an extrapolated limit would confirm the order that it was made with.
            (Reference::Extrapolated { .. }, ..) => order_of_three(&known, size),
            (_, Some((coarser, larger)), Some(error)) if larger > 0.0 && error > 0.0 => {
                Some((larger / error).ln() / (coarser / size).ln())
            }
            _ => None,
        };
        levels.push(Level { case, size, value, error, order });
    }
    (levels, reference)
}

/// The order from the level of this size and the two before it.
fn order_of_three(known: &[(f64, f64)], size: f64) -> Option<f64> {
    let at = known.iter().position(|(h, _)| *h == size)?;
    richardson(known.get(at.checked_sub(2)?..=at)?).map(|(order, _)| order)
}

fn extrapolated(known: &[(f64, f64)]) -> Reference {
    let Some(last) = known.len().checked_sub(3).map(|from| &known[from..]) else {
        return Reference::Unknown("without an exact value, orders take three levels that were completed");
    };
    match richardson(last) {
        Some((order, value)) => Reference::Extrapolated { value, order },
        None => Reference::Unknown("the three finest values do not approach a limit from one side; refine further"),
    }
}

/// Order and limit of three values on sizes from coarse to fine.
fn richardson(levels: &[(f64, f64)]) -> Option<(f64, f64)> {
    let &[(h1, v1), (h2, v2), (h3, v3)] = levels else { return None };
    let (a, b) = ((h1 / h2).ln(), (h2 / h3).ln());
    let ratio = (v1 - v2) / (v2 - v3);
    // (h₁^p − h₂^p)/(h₂^p − h₃^p), which grows with p from a/b.
    let function = |p: f64| (a * p).exp_m1() / -(-b * p).exp_m1();
    if !ratio.is_finite() || ratio <= a / b || ratio >= function(HIGHEST_ORDER) {
        return None;
    }
    let (mut low, mut high) = (0.0, HIGHEST_ORDER);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if function(middle) < ratio { low = middle } else { high = middle }
    }
    let order = 0.5 * (low + high);
    Some((order, v3 + (v3 - v2) / (b * order).exp_m1()))
}

/// The sizes as given, or those of the first refined key.
pub(super) fn sizes(
    item: Option<&Item>,
    refined: &[Entry],
    place: &Span,
    findings: &mut Findings<'_>,
) -> Option<Vec<f64>> {
    let (list, span) = match item {
        Some(item) => (item.as_array(), item.span().unwrap_or_else(|| place.clone())),
        None => (refined.first()?.value.as_array(), refined.first()?.value_span.clone()),
    };
    let numbers: Option<Vec<f64>> = list.and_then(|list| list.iter().map(number).collect());
    let Some(sizes) = numbers else {
        let remedy = "add `sizes = [0.1, 0.05, 0.025]`, from coarse to fine";
        findings.error(span, "the sizes are not a list of numbers", remedy);
        return None;
    };
    if sizes.len() < 2 || !sizes.iter().all(|size| size.is_finite() && *size > 0.0) || !sizes.is_sorted_by(|a, b| a > b)
    {
        let remedy = "give at least two positive sizes, from coarse to fine; three where the exact value is not known";
        findings.error(span, "the sizes do not fall", remedy);
        return None;
    }
    Some(sizes)
}

/// A product of decimal numbers without the digits of its rounding, as TOML.
pub(super) fn rounded(value: f64) -> String {
    let value = format!("{value:.14e}").parse().unwrap_or(value);
    format!("{value:?}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_of_powers_are_found_also_on_uneven_sizes() {
        let sizes = [0.4, 0.25, 0.1, 0.06];
        let cases: Vec<(usize, f64)> = sizes.iter().enumerate().map(|(at, size)| (at + 1, *size)).collect();
        for order in [0.5, 1.0, 2.0, 3.7] {
            let values: Vec<Option<f64>> = sizes.iter().map(|h| Some(2.0 - 0.3 * f64::powf(*h, order))).collect();
            let (rows, reference) = levels(&cases, &values, false, None);
            let Reference::Extrapolated { value, order: found } = reference else { panic!("{reference:?}") };
            assert!((value - 2.0).abs() < 1e-12 && (found - order).abs() < 1e-9, "{order}: {value} {found}");
            assert_eq!(rows[1].order, None);
            assert!((rows[2].order.unwrap() - order).abs() < 1e-9);
            let (rows, _) = levels(&cases, &values, false, Some(2.0));
            assert!(rows[1..].iter().all(|row| (row.order.unwrap() - order).abs() < 1e-9), "{rows:?}");
        }
    }

    #[test]
    fn values_that_swing_stall_or_fail_have_no_limit() {
        let cases = [(1, 0.4), (2, 0.2), (3, 0.1)];
        for values in [[1.0, 2.0, 1.5], [1.0, 1.0, 1.0], [1.0, 2.0, 3.0], [1.0, 2.0, f64::NAN]] {
            let (rows, reference) = levels(&cases, &values.map(Some), false, None);
            assert!(matches!(reference, Reference::Unknown(_)), "{values:?}: {reference:?}");
            assert!(rows.iter().all(|row| row.order.is_none() && row.error.is_none()));
        }
        // A level that failed is stepped over.
        let (rows, _) = levels(&cases, &[Some(0.16), None, Some(0.01)], true, None);
        assert_eq!((rows[1].error, rows[1].order), (None, None));
        assert!((rows[2].order.unwrap() - 2.0).abs() < 1e-12);
    }

    #[test]
    fn factors_leave_no_rounding_behind() {
        assert_eq!(rounded(3.0 * 0.1), "0.3");
        assert_eq!(rounded(1e-3 * 0.1), "0.0001");
        assert_eq!(rounded(2.0), "2.0");
        assert_eq!(rounded(1e-7 * 3.0), "3e-7");
    }
}
