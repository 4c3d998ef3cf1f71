//! Axes: which range to show, where the ticks go, what they say.
//!
//! The range comes from data nobody has looked at yet, so everything must survive: no data, one value,
//! values that agree to the last digits, 600 orders of magnitude. Values that cannot be shown (not
//! finite, beyond ±1e300, not positive on a logarithmic axis) have no place, and are skipped.

/// Magnitudes beyond this have no place: differences of such numbers overflow.
const LARGEST: f64 = 1e300;
/// Magnitudes below this are zero on a linear axis and have no place on a logarithmic one.
const SMALLEST: f64 = 1e-300;
/// Ticks that fit on an axis of usual length without crowding.
const TICKS: f64 = 6.0;
/// Most decades whose digits 2 to 9 are marked.
const MARKED_DECADES: i32 = 12;
/// A range narrower than this over its magnitude is labelled by differences from a reference value.
const NARROW: f64 = 1e-4;
/// A range narrower than this is rounding noise: it is shown as the constant it is.
const NOISE: f64 = 1e-14;

/// What stands beside a tick: a text, or a power of ten.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Label {
    /// Plain text.
    Text(String),
    /// `10` raised to this power.
    Power(i32),
}

/// A labelled place on an axis.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Tick {
    /// Place as a fraction of the axis, between 0 and 1.
    pub(super) place: f64,
    pub(super) label: Label,
}

/// A range of values, and how it is labelled.
#[derive(Debug, Clone)]
pub(super) struct Axis {
    /// Ends of the axis; of log₁₀ on a logarithmic axis.
    low: f64,
    high: f64,
    logarithmic: bool,
    /// Labelled ticks.
    pub(super) ticks: Vec<Tick>,
    /// Places of ticks without label.
    pub(super) minor: Vec<f64>,
    /// The labels are to be multiplied by ten to this power (0 for no factor).
    pub(super) exponent: i32,
    /// Added to the labels after that, as text.
    pub(super) reference: Option<String>,
}

impl Axis {
    /// An axis that shows all `values` with a margin of `margin` times their range at both ends.
    pub(super) fn new(values: impl Iterator<Item = f64>, logarithmic: bool, margin: f64) -> Self {
        let usable = values.filter(|value| usable(*value, logarithmic));
        let range = usable.fold(None, |range: Option<(f64, f64)>, value| {
            let (low, high) = range.unwrap_or((value, value));
            Some((low.min(value), high.max(value)))
        });
        if logarithmic { Self::logarithmic(range, margin) } else { Self::linear(range, margin, TICKS) }
    }

    /// A linear axis from `low` to `high`, widened only if they agree, with about `ticks` ticks.
    pub(super) fn between(low: f64, high: f64, ticks: f64) -> Self {
        Self::linear(Some((low, high)), 0.0, ticks.clamp(1.5, TICKS))
    }

    /// Place of a value as a fraction of the axis; `None` if it has none.
    pub(super) fn place(&self, value: f64) -> Option<f64> {
        if !usable(value, self.logarithmic) {
            return None;
        }
        let value = if self.logarithmic { value.log10() } else { value };
        Some((value - self.low) / (self.high - self.low))
    }

    fn linear(range: Option<(f64, f64)>, margin: f64, ticks: f64) -> Self {
        let (mut low, mut high) = range.unwrap_or((0.0, 1.0));
        let magnitude = low.abs().max(high.abs());
        if magnitude < SMALLEST {
            (low, high) = (-1.0, 1.0);
        } else if high - low <= NOISE * magnitude {
            (low, high) = (low - 0.1 * magnitude, high + 0.1 * magnitude);
        }
        let extra = margin * (high - low);
        (low, high) = (low - extra, high + extra);
        let mut axis =
            Self { low, high, logarithmic: false, ticks: Vec::new(), minor: Vec::new(), exponent: 0, reference: None };
        axis.set_linear_ticks(low, high, ticks);
        axis
    }

    fn logarithmic(range: Option<(f64, f64)>, margin: f64) -> Self {
        let (low, high) = range.map_or((-1.0, 1.0), |(low, high)| (low.log10(), high.log10()));
        let (low, high) = if high - low < 1e-3 { (low - 0.5, high + 0.5) } else { (low, high) };
        let extra = margin * (high - low);
        let (low, high) = (low - extra, high + extra);
        let mut axis =
            Self { low, high, logarithmic: true, ticks: Vec::new(), minor: Vec::new(), exponent: 0, reference: None };
        let (first, last) = (low.ceil() as i32, high.floor() as i32);
        if last - first < 1 {
            // Hardly a decade: powers of ten alone would leave the axis bare.
            if !axis.set_ticks_125() {
                axis.set_linear_ticks(10f64.powf(low), 10f64.powf(high), TICKS);
            }
            return axis;
        }
        let wanted = f64::from(last - first) / TICKS;
        let stride = [1, 2, 5, 10, 20, 50, 100].into_iter().find(|&stride| f64::from(stride) >= wanted).unwrap_or(200);
        let fraction = |exponent: f64| (exponent - low) / (high - low);
        for exponent in first..=last {
            if exponent % stride == 0 {
                axis.ticks.push(Tick { place: fraction(exponent.into()), label: Label::Power(exponent) });
            } else if stride <= 5 {
                axis.minor.push(fraction(exponent.into()));
            }
        }
        if last - first <= MARKED_DECADES && stride == 1 {
            for exponent in first - 1..=last {
                let places = (2..10).map(|digit| fraction(f64::from(exponent) + f64::from(digit).log10()));
                axis.minor.extend(places.filter(|place| (0.0..=1.0).contains(place)));
            }
        }
        axis
    }

    /// Ticks at 1, 2 and 5 times powers of ten on a logarithmic axis, if there are enough of them.
    fn set_ticks_125(&mut self) -> bool {
        let powers = self.low.floor() as i32..=self.high.floor() as i32;
        let values = powers.flat_map(|power| [1.0, 2.0, 5.0].map(|digit| digit * 10f64.powi(power)));
        let values: Vec<f64> = values.filter(|value| (self.low..=self.high).contains(&value.log10())).collect();
        let Some(&largest) = values.last().filter(|_| values.len() >= 4) else { return false };
        self.exponent = if (1e-2..1e5).contains(&largest) { 0 } else { largest.log10().floor() as i32 };
        for value in values {
            let shown = value * 10f64.powi(-self.exponent);
            // 0.99999… counts as 1.
            let decimals = (-0.01 - shown.log10()).ceil().max(0.0) as usize;
            if let Some(place) = self.place(value) {
                self.ticks.push(Tick { place: place.clamp(0.0, 1.0), label: Label::Text(decimal(shown, decimals)) });
            }
        }
        true
    }

    /// Ticks at round values between `low` and `high`, which are values also on a logarithmic axis.
    fn set_linear_ticks(&mut self, low: f64, high: f64, ticks: f64) {
        let magnitude = low.abs().max(high.abs());
        let narrow = high - low < NARROW * magnitude;
        let reference = if narrow { round_to(low + 0.5 * (high - low), power_of_ten(high - low)) } else { 0.0 };
        let (low, high) = (low - reference, high - reference);
        let largest = low.abs().max(high.abs());
        let factored = !(1e-3..1e5).contains(&largest);
        self.exponent = if factored { largest.log10().floor() as i32 } else { 0 };
        self.reference = narrow.then(|| super::text::readable(reference, 12));
        let step = round_step((high - low) / ticks);
        // Digits behind the point that tell neighbouring ticks apart.
        let unit = 10f64.powi(-self.exponent);
        let decimals = (0..12).find(|&digits| {
            let scaled = step * unit * 10f64.powi(digits);
            (scaled - scaled.round()).abs() < 1e-6 * scaled
        });
        let decimals = decimals.unwrap_or(12) as usize;
        let (first, last) = ((low / step - 1e-9).ceil(), (high / step + 1e-9).floor());
        let count = (last - first).clamp(0.0, 4.0 * TICKS) as usize;
        for index in 0..=count {
            let value = (first + index as f64) * step;
            if let Some(place) = self.place(value + reference) {
                let label = Label::Text(decimal(value * unit, decimals));
                self.ticks.push(Tick { place: place.clamp(0.0, 1.0), label });
            }
        }
    }
}

fn usable(value: f64, logarithmic: bool) -> bool {
    if logarithmic { (SMALLEST..=LARGEST).contains(&value) } else { value.abs() <= LARGEST }
}

/// The next power of ten that is not smaller.
fn power_of_ten(value: f64) -> f64 {
    10f64.powf(value.log10().ceil())
}

fn round_to(value: f64, unit: f64) -> f64 {
    (value / unit).round() * unit
}

/// The smallest of 1, 2, 2.5, 5 times a power of ten that is not below `step`.
pub(super) fn round_step(step: f64) -> f64 {
    let unit = 10f64.powf(step.log10().floor());
    let digit = [1.0, 2.0, 2.5, 5.0].into_iter().find(|digit| digit * unit >= step * (1.0 - 1e-9));
    digit.unwrap_or(10.0) * unit
}

/// A number with a true minus sign, and no minus before zero.
fn decimal(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(digits) if digits.bytes().all(|byte| matches!(byte, b'0' | b'.')) => digits.to_owned(),
        Some(digits) => format!("−{digits}"),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: &Axis) -> Vec<String> {
        let text = |tick: &Tick| match &tick.label {
            Label::Text(text) => text.clone(),
            Label::Power(power) => format!("10^{power}"),
        };
        axis.ticks.iter().map(text).collect()
    }

    #[test]
    fn ticks_are_round_and_told_apart() {
        let axis = Axis::new([0.0, 1.0].into_iter(), false, 0.0);
        assert_eq!(labels(&axis), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(labels(&Axis::between(-3.0, 3.0, 6.0)), ["−3", "−2", "−1", "0", "1", "2", "3"]);
        let axis = Axis::between(0.0, 2.5e-7, 6.0);
        assert_eq!(
            (labels(&axis), axis.exponent),
            (vec!["0.0".into(), "0.5".into(), "1.0".into(), "1.5".into(), "2.0".into(), "2.5".into()], -7)
        );
    }

    #[test]
    fn a_narrow_range_is_labelled_by_differences() {
        let axis = Axis::new([1.25, 1.25 + 4e-9].into_iter(), false, 0.0);
        assert_eq!(axis.reference.as_deref(), Some("1.25"));
        assert_eq!(axis.exponent, -9);
        assert!(axis.ticks.len() > 3);
        let noise = Axis::new([1.0, 1.0 + f64::EPSILON].into_iter(), false, 0.0);
        assert_eq!(noise.reference, None);
    }

    #[test]
    fn decades_are_labelled_and_short_ranges_are_not_bare() {
        let axis = Axis::new([1e-8, 1e-2].into_iter(), true, 0.0);
        assert_eq!(labels(&axis).len(), 7);
        assert_eq!(axis.place(1e-5).map(|place| (place * 1e9).round()), Some(0.5e9));
        assert_eq!(axis.place(0.0), None);
        assert!(Axis::new([2.0, 7.0].into_iter(), true, 0.0).ticks.len() > 3);
        let axis = Axis::new([3e-4, 9e-3].into_iter(), true, 0.0);
        assert_eq!((labels(&axis).join(" "), axis.exponent), ("0.5 1 2 5".to_owned(), -3));
        let axis = Axis::new([0.03, 0.6].into_iter(), true, 0.0);
        assert_eq!((labels(&axis).join(" ").as_str(), axis.exponent), ("0.05 0.1 0.2 0.5", 0));
        assert!(Axis::new([1e-300, 1e300].into_iter(), true, 0.0).ticks.len() < 10);
    }

    #[test]
    fn any_data_give_few_ticks_in_place() {
        let extremes =
            [0.0, -0.0, 1.0, -1.0, 5e-324, 1e-310, -1e-300, 1e300, -1e300, f64::MAX, f64::MIN, 1e16, 1.0 + 1e-15];
        for logarithmic in [false, true] {
            for low in extremes {
                for high in extremes.into_iter().chain([f64::NAN, f64::INFINITY]) {
                    let axis = Axis::new([low, high].into_iter(), logarithmic, 0.05);
                    assert!((1..=14).contains(&axis.ticks.len()), "{low:e} to {high:e}: {:?}", axis.ticks);
                    for tick in &axis.ticks {
                        assert!((0.0..=1.0).contains(&tick.place), "{low:e} to {high:e}: {tick:?}");
                    }
                    for label in labels(&axis) {
                        assert!(label.chars().count() < 10, "{low:e} to {high:e}: {label}");
                    }
                    for value in [low, high] {
                        let place = axis.place(value).unwrap_or(0.5);
                        assert!((0.0..=1.0).contains(&place), "{value:e} in {low:e} to {high:e} at {place}");
                    }
                }
            }
            let _ = Axis::new(std::iter::empty(), logarithmic, 0.05);
        }
    }
}
