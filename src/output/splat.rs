//! Many discs as pixels: flat ones with a common outline, or balls with light and depth.

use plotters::style::RGBColor;

use super::canvas::{BLACK, Disc, WHITE};
use super::colour::scaled;

/// How a cloud of discs is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Look {
    /// Discs in their order, with a dark line of this width in points around all of them together.
    Flat {
        /// Width of the line.
        outline: f64,
    },
    /// Balls, lit from the upper left, the nearer over the farther.
    Balls,
}

/// Direction of the light: left, up, towards the viewer.
const LIGHT: [f64; 3] = [-0.36, 0.48, 0.8];
/// Share of the radius from which a ball has its dark rim, if it is large enough to have one.
const RIM_FROM_SHARE: f64 = 0.94;
/// Smallest radius in pixels of a ball with a rim.
const RIM_FROM: f64 = 5.0;

/// Pixels of `width` columns, three bytes each, on white.
pub(super) struct Pixels {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) rgb: Vec<u8>,
}

/// Draws discs given in points on an area of `size` points with `scale` pixels per point.
///
/// `under` are drawn first: their common outline in grey, white inside.
pub(super) fn render(size: (f64, f64), scale: f64, under: &[Disc], discs: &[Disc], look: Look) -> Pixels {
    let (width, height) = ((size.0 * scale).round().max(1.0) as usize, (size.1 * scale).round().max(1.0) as usize);
    let mut pixels = Pixels { width, height, rgb: vec![0xff; 3 * width * height] };
    let line = |width: f64| (width * scale).max(1.0);
    pixels.flat(under, scale, line(0.9), |_| RGBColor(0x90, 0x90, 0x90));
    pixels.flat(under, scale, 0.0, |_| WHITE);
    match look {
        Look::Flat { outline } => {
            if outline > 0.0 {
                pixels.flat(discs, scale, line(outline), |_| BLACK);
            }
            pixels.flat(discs, scale, 0.0, |disc| disc.colour);
        }
        Look::Balls => pixels.balls(discs, scale),
    }
    pixels
}

impl Pixels {
    fn flat(&mut self, discs: &[Disc], scale: f64, extra: f64, colour: impl Fn(&Disc) -> RGBColor) {
        for disc in discs {
            let radius = (disc.radius * scale).max(0.7) + extra;
            let RGBColor(r, g, b) = colour(disc);
            let (x, y) = (disc.centre.0 * scale - 0.5, disc.centre.1 * scale - 0.5);
            for row in rows(y, radius, self.height) {
                let half = (radius * radius - (row as f64 - y).powi(2)).max(0.0).sqrt();
                for column in rows(x, half, self.width) {
                    let at = 3 * (row * self.width + column);
                    self.rgb[at..at + 3].copy_from_slice(&[r, g, b]);
                }
            }
        }
    }

    fn balls(&mut self, discs: &[Disc], scale: f64) {
        let mut nearest = vec![f32::NEG_INFINITY; self.width * self.height];
        for disc in discs {
            let radius = (disc.radius * scale).max(0.7);
            let (x, y) = (disc.centre.0 * scale - 0.5, disc.centre.1 * scale - 0.5);
            for row in rows(y, radius, self.height) {
                let down = (row as f64 - y) / radius;
                let half = radius * (1.0 - down * down).max(0.0).sqrt();
                for column in rows(x, half, self.width) {
                    let across = (column as f64 - x) / radius;
                    let off = across * across + down * down;
                    let towards = (1.0 - off).max(0.0).sqrt();
                    let depth = (disc.depth + disc.radius * towards) as f32;
                    let at = row * self.width + column;
                    if depth <= nearest[at] {
                        continue;
                    }
                    nearest[at] = depth;
                    let lit = across * LIGHT[0] - down * LIGHT[1] + towards * LIGHT[2];
                    let rim = radius > RIM_FROM && off > RIM_FROM_SHARE * RIM_FROM_SHARE;
                    let factor = if rim { 0.45 } else { (0.56 + 0.5 * lit.max(-0.2)).min(1.0) };
                    let RGBColor(r, g, b) = scaled(disc.colour, factor);
                    self.rgb[3 * at..3 * at + 3].copy_from_slice(&[r, g, b]);
                }
            }
        }
    }
}

/// Pixels within `reach` of `middle`, of `count` there are.
fn rows(middle: f64, reach: f64, count: usize) -> std::ops::Range<usize> {
    // `max` and `min` take the other one of NaN, where `clamp` panics.
    let low = (middle - reach).ceil().max(0.0).min(count as f64);
    let high = ((middle + reach).floor() + 1.0).max(low).min(count as f64);
    low as usize..high as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    fn disc(centre: (f64, f64), radius: f64, depth: f64, colour: RGBColor) -> Disc {
        Disc { centre, radius, depth, colour }
    }

    fn at(pixels: &Pixels, x: usize, y: usize) -> RGBColor {
        let first = 3 * (y * pixels.width + x);
        RGBColor(pixels.rgb[first], pixels.rgb[first + 1], pixels.rgb[first + 2])
    }

    const RED: RGBColor = RGBColor(200, 0, 0);
    const BLUE: RGBColor = RGBColor(0, 0, 200);

    #[test]
    fn flat_discs_have_their_colour_and_one_outline_around_all() {
        let discs = [disc((10.0, 10.0), 4.0, 0.0, RED), disc((16.0, 10.0), 4.0, 0.0, BLUE)];
        let pixels = render((30.0, 20.0), 2.0, &[], &discs, Look::Flat { outline: 1.0 });
        assert_eq!((pixels.width, pixels.height), (60, 40));
        assert_eq!((at(&pixels, 20, 20), at(&pixels, 32, 20)), (RED, BLUE));
        assert_eq!(at(&pixels, 20, 10), BLACK, "above the first");
        assert_eq!(at(&pixels, 26, 20), BLUE, "no line between them");
        assert_eq!(at(&pixels, 0, 0), WHITE);
        let under = [disc((10.0, 10.0), 8.0, 0.0, RED)];
        let pixels = render((30.0, 20.0), 2.0, &under, &[], Look::Flat { outline: 1.0 });
        assert_eq!((at(&pixels, 20, 20), at(&pixels, 36, 20)), (WHITE, RGBColor(0x90, 0x90, 0x90)));
    }

    #[test]
    fn the_nearer_ball_hides_the_farther_whatever_their_order() {
        let near = disc((10.0, 10.0), 5.0, 3.0, RED);
        let far = disc((11.0, 10.0), 5.0, 0.0, BLUE);
        for discs in [[near, far], [far, near]] {
            let pixels = render((20.0, 20.0), 2.0, &[], &discs, Look::Balls);
            let RGBColor(r, _, b) = at(&pixels, 20, 20);
            assert!(r > 180 && b == 0, "{r} {b}");
            let RGBColor(r, _, b) = at(&pixels, 30, 20);
            assert!(r == 0 && b > 60, "{r} {b}");
        }
    }

    #[test]
    fn discs_outside_and_without_size_do_no_harm() {
        let odd = [(-1e9, 5.0, 3.0), (1e9, 1e9, 1e8), (5.0, 5.0, 0.0), (f64::NAN, 1.0, 1.0), (1.0, 1.0, f64::NAN)];
        let discs = odd.map(|(x, y, radius)| disc((x, y), radius, 0.0, RED));
        for look in [Look::Balls, Look::Flat { outline: 1.0 }] {
            let pixels = render((10.0, 10.0), 1.0, &discs, &discs, look);
            assert_eq!(pixels.rgb.len(), 300);
        }
    }
}
