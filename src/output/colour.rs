//! Colours that remain distinct for colour-blind readers and in print.

use plotters::style::RGBColor;

/// Line colours (Okabe and Ito, without the yellow that is lost on white).
pub(super) const LINES: [RGBColor; 7] = [
    RGBColor(0x00, 0x72, 0xb2),
    RGBColor(0xd5, 0x5e, 0x00),
    RGBColor(0x00, 0x9e, 0x73),
    RGBColor(0xcc, 0x79, 0xa7),
    RGBColor(0x20, 0x20, 0x20),
    RGBColor(0xe6, 0x9f, 0x00),
    RGBColor(0x56, 0xb4, 0xe9),
];

/// Colour of particles whose value is not finite.
pub(super) const NOT_FINITE: RGBColor = RGBColor(0xff, 0x00, 0xff);

/// Nine support points of *viridis*: lightness grows evenly from dark to bright.
const SEQUENTIAL: [[u8; 3]; 9] = [
    [68, 1, 84],
    [71, 44, 122],
    [59, 81, 139],
    [44, 113, 142],
    [33, 144, 141],
    [39, 173, 129],
    [92, 200, 99],
    [170, 220, 50],
    [253, 231, 37],
];

/// Nine support points of Moreland's cool–warm map: grey at zero, so that zero is visible on white.
const DIVERGING: [[u8; 3]; 9] = [
    [59, 76, 192],
    [98, 130, 234],
    [141, 176, 254],
    [184, 208, 249],
    [221, 221, 221],
    [245, 196, 173],
    [244, 154, 123],
    [222, 96, 77],
    [180, 4, 38],
];

/// How values become colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ColourMap {
    /// Diverging if there are values of both signs, else sequential.
    #[default]
    Automatic,
    /// From the smallest to the largest value (viridis).
    Sequential,
    /// Centred at zero, equally far to both sides (cool–warm).
    Diverging,
}

impl ColourMap {
    /// Whether values between `low` and `high` are shown as signed.
    pub(super) fn is_signed(self, low: f64, high: f64) -> bool {
        match self {
            Self::Automatic => low < 0.0 && high > 0.0,
            Self::Sequential => false,
            Self::Diverging => true,
        }
    }

    /// The ends of the colour bar for values in a range.
    pub(super) fn ends(self, (low, high): (f64, f64)) -> (f64, f64) {
        let most = low.abs().max(high.abs());
        if self.is_signed(low, high) { (-most, most) } else { (low, high) }
    }
}

/// The colour at the finite `fraction` (clamped to 0..1) of the signed or unsigned map.
pub(super) fn colour(signed: bool, fraction: f64) -> RGBColor {
    let supports = if signed { &DIVERGING } else { &SEQUENTIAL };
    let position = fraction.clamp(0.0, 1.0) * (supports.len() - 1) as f64;
    let index = (position as usize).min(supports.len() - 2);
    let part = position - index as f64;
    let mix = |channel: usize| {
        let (from, to) = (f64::from(supports[index][channel]), f64::from(supports[index + 1][channel]));
        (from + part * (to - from)).round() as u8
    };
    RGBColor(mix(0), mix(1), mix(2))
}

/// The same colour closer to black: `factor` of its light.
pub(super) fn scaled(RGBColor(red, green, blue): RGBColor, factor: f64) -> RGBColor {
    let dim = |channel: u8| (f64::from(channel) * factor) as u8;
    RGBColor(dim(red), dim(green), dim(blue))
}

/// The same colour half way to white.
pub(super) fn mixed_with_white(RGBColor(red, green, blue): RGBColor) -> RGBColor {
    let lift = |channel: u8| channel / 2 + 0x7f;
    RGBColor(lift(red), lift(green), lift(blue))
}

/// The colours of a map at `count` places evenly from its low to its high end.
pub(super) fn samples(signed: bool, count: usize) -> impl Iterator<Item = RGBColor> {
    (0..count).map(move |at| colour(signed, at as f64 / (count.max(2) - 1) as f64))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lightness_grows_along_the_sequential_map() {
        let lightness = |RGBColor(r, g, b): RGBColor| {
            let linear = |channel: u8| (f64::from(channel) / 255.0).powf(2.2);
            0.2126 * linear(r) + 0.7152 * linear(g) + 0.0722 * linear(b)
        };
        let values: Vec<f64> = (0..=100).map(|i| lightness(colour(false, f64::from(i) / 100.0))).collect();
        assert!(values.windows(2).all(|pair| pair[1] >= pair[0] - 2e-3), "{values:?}");
        assert_eq!(colour(true, 0.5), RGBColor(221, 221, 221));
        assert_eq!(colour(false, 7.0), RGBColor(253, 231, 37));
    }

    #[test]
    fn the_map_follows_the_signs() {
        assert!(ColourMap::Automatic.is_signed(-1.0, 2.0));
        assert!(!ColourMap::Automatic.is_signed(0.0, 2.0));
        assert!(ColourMap::Diverging.is_signed(0.0, 2.0));
    }
}
