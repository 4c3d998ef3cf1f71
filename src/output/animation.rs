//! Pictures as an animation (GIF).
//!
//! One palette serves all frames: it holds what our pictures are made of (white, greys, the colours of the map, and
//! those lighter and darker), so nothing flickers and no quantiser guesses. Of each frame only what changed is stored.

use std::io::{self, Write};

use gif::{DisposalMethod, Encoder, Repeat};
use plotters::style::RGBColor;

use super::colour::{LINES, NOT_FINITE, mixed_with_white, samples, scaled};
use super::picture::Picture;

/// Index of the colour that lets the frame before show through.
const CLEAR: u8 = 255;
/// Colours of the map as they are, then by factor of their light.
const PURE: usize = 64;
const SHADES: [(f64, usize); 4] = [(0.87, 40), (0.75, 46), (0.62, 28), (0.46, 32)];
const LIGHTER: usize = 24;
/// Bits per channel that tell colours apart.
const BITS: u32 = 6;

/// Writes frames of the same size one after the other.
pub(super) struct Animation<W: Write> {
    encoder: Encoder<W>,
    palette: Vec<RGBColor>,
    /// Index of the nearest colour by bucket; `CLEAR` where it was not looked for yet.
    nearest: Vec<u8>,
    size: (usize, usize),
    before: Vec<u8>,
}

impl<W: Write> Animation<W> {
    /// An animation that repeats for ever, in the colours of a map.
    pub(super) fn new(file: W, size: (usize, usize), signed: bool) -> io::Result<Self> {
        let palette = palette(signed);
        let mut bytes: Vec<u8> = palette.iter().flat_map(|&RGBColor(r, g, b)| [r, g, b]).collect();
        bytes.resize(3 * 256, 0);
        let side = |length: usize| u16::try_from(length).map_err(io::Error::other);
        let mut encoder = Encoder::new(file, side(size.0)?, side(size.1)?, &bytes).map_err(io::Error::other)?;
        encoder.set_repeat(Repeat::Infinite).map_err(io::Error::other)?;
        Ok(Self { encoder, palette, nearest: vec![CLEAR; 1 << (3 * BITS)], size, before: Vec::new() })
    }

    /// Adds a frame that is shown for `delay` hundredths of a second.
    pub(super) fn push(&mut self, picture: &Picture, delay: u16) -> io::Result<()> {
        if picture.size() != self.size {
            return Err(io::Error::other("the frames of an animation differ in size"));
        }
        let (width, height) = self.size;
        let indices: Vec<u8> = picture.rgb().chunks_exact(3).map(|rgb| self.index([rgb[0], rgb[1], rgb[2]])).collect();
        let changed = |at: usize| self.before.get(at) != Some(&indices[at]);
        let rows = range_of((0..height).filter(|row| (row * width..(row + 1) * width).any(changed)));
        let columns = range_of((0..width).filter(|column| (0..height).any(|row| changed(row * width + column))));
        let mut buffer = Vec::with_capacity(rows.len() * columns.len());
        for row in rows.clone() {
            let places = columns.clone().map(|column| row * width + column);
            buffer.extend(places.map(|at| if changed(at) { indices[at] } else { CLEAR }));
        }
        // Sides fit in 16 bits: the whole picture's do.
        let short = |length: usize| length as u16;
        let frame = gif::Frame {
            delay,
            dispose: DisposalMethod::Keep,
            transparent: Some(CLEAR),
            top: short(rows.start),
            left: short(columns.start),
            width: short(columns.len()),
            height: short(rows.len()),
            buffer: buffer.into(),
            ..gif::Frame::default()
        };
        self.before = indices;
        self.encoder.write_frame(&frame).map_err(io::Error::other)
    }

    /// Index of the colour of the palette that is nearest to the bucket of this one.
    fn index(&mut self, rgb: [u8; 3]) -> u8 {
        let bucket = rgb.iter().fold(0, |bucket, &value| bucket << BITS | usize::from(value >> (8 - BITS)));
        if self.nearest[bucket] == CLEAR {
            let centre = rgb.map(|value| value >> (8 - BITS)).map(|value| i32::from(value << 2 | value >> 4));
            let distance = |&RGBColor(r, g, b): &RGBColor| {
                let [x, y, z] = [centre[0] - i32::from(r), centre[1] - i32::from(g), centre[2] - i32::from(b)];
                3 * x * x + 6 * y * y + z * z
            };
            let best = self.palette.iter().enumerate().min_by_key(|(_, colour)| distance(colour));
            self.nearest[bucket] = best.map_or(0, |(at, _)| at as u8);
        }
        self.nearest[bucket]
    }
}

/// The smallest range that holds all of an ascending list; one element if there is none, as a frame needs.
fn range_of(mut ascending: impl Iterator<Item = usize>) -> std::ops::Range<usize> {
    match ascending.next() {
        None => 0..1,
        Some(first) => first..ascending.last().unwrap_or(first) + 1,
    }
}

/// At most 255 colours.
fn palette(signed: bool) -> Vec<RGBColor> {
    let greys = [0xff, 0xf4, 0xe8, 0xe2, 0xd0, 0xc0, 0xb0, 0xa0, 0x90, 0x80, 0x70, 0x60, 0x50, 0x40, 0x30, 0x20, 0];
    let mut colours: Vec<RGBColor> = greys.map(|level| RGBColor(level, level, level)).to_vec();
    // The curve of a picture on the line.
    colours.extend([NOT_FINITE, LINES[0]]);
    colours.extend(samples(signed, PURE));
    for (factor, count) in SHADES {
        colours.extend(samples(signed, count).map(|colour| scaled(colour, factor)));
    }
    colours.extend(samples(signed, LIGHTER).map(mixed_with_white));
    colours
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(colour: impl Fn(usize, usize) -> [u8; 3]) -> Picture {
        let fine: Vec<u8> = (0..40 * 60).flat_map(|at| colour(at % 60, at / 60)).collect();
        Picture::averaged(&fine, 60, 1, 1.0)
    }

    #[test]
    fn the_palette_leaves_room_for_the_clear_colour() {
        for signed in [false, true] {
            let colours = palette(signed);
            assert!(colours.len() <= usize::from(CLEAR), "{}", colours.len());
            assert_eq!(colours[0], RGBColor(0xff, 0xff, 0xff));
        }
    }

    /// The decoder of another program would do the same: frames are laid over each other.
    #[test]
    fn frames_read_back_as_they_were() {
        let red = [0xb4, 4, 38];
        let moving = |step: usize| {
            picture(move |x, y| {
                if x / 5 == step && y > 30 {
                    red
                } else if y < 3 {
                    [0x20; 3]
                } else {
                    [0xff; 3]
                }
            })
        };
        let mut file = Vec::new();
        let mut animation = Animation::new(&mut file, (60, 40), true).unwrap();
        for step in [0, 3, 3, 7] {
            animation.push(&moving(step), 5).unwrap();
        }
        assert!(animation.push(&Picture::averaged(&[0; 12], 2, 1, 1.0), 5).is_err());
        drop(animation);
        let mut options = gif::DecodeOptions::new();
        options.set_color_output(gif::ColorOutput::RGBA);
        let mut decoder = options.read_info(&file[..]).unwrap();
        assert_eq!((decoder.width(), decoder.height()), (60, 40));
        let mut screen = vec![0; 60 * 40 * 4];
        let mut frames = 0;
        while let Some(frame) = decoder.read_next_frame().unwrap() {
            let (left, top, width) = (usize::from(frame.left), usize::from(frame.top), usize::from(frame.width));
            for (at, rgba) in frame.buffer.chunks_exact(4).enumerate().filter(|(_, rgba)| rgba[3] > 0) {
                let place = 4 * ((top + at / width) * 60 + left + at % width);
                screen[place..place + 4].copy_from_slice(rgba);
            }
            let step = [0, 3, 3, 7][frames];
            for (at, rgba) in screen.chunks_exact(4).enumerate() {
                let expected = moving(step).rgb()[3 * at..3 * at + 3].to_vec();
                assert_eq!(rgba[..3], expected, "frame {frames}, pixel {at}");
            }
            frames += 1;
        }
        assert_eq!(frames, 4);
    }
}
