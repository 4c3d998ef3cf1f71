//! Pictures of pixels: averaged down from a finer drawing, encoded as PNG, embedded as text.

use std::io::{self, Write};

/// An RGB picture.
pub(super) struct Picture {
    width: usize,
    height: usize,
    rgb: Vec<u8>,
    /// Points per pixel.
    pixel: f64,
}

impl Picture {
    /// Averages blocks of `block`×`block` pixels of a drawing with `width` pixels per row and `scale`
    /// pixels per point.
    pub(super) fn averaged(fine: &[u8], width: usize, block: usize, scale: f64) -> Self {
        let row = 3 * width;
        let (width, height) = (width / block, fine.len() / row.max(1) / block);
        let mut rgb = Vec::with_capacity(3 * width * height);
        let mut sums = vec![[0_usize; 3]; width];
        for rows in fine.chunks_exact((row * block).max(1)).take(height) {
            sums.fill([0; 3]);
            for row in rows.chunks_exact(row) {
                for (sum, pixels) in sums.iter_mut().zip(row.chunks_exact(3 * block)) {
                    for pixel in pixels.chunks_exact(3) {
                        sum.iter_mut().zip(pixel).for_each(|(sum, channel)| *sum += usize::from(*channel));
                    }
                }
            }
            rgb.extend(sums.iter().flatten().map(|sum| (sum / (block * block)) as u8));
        }
        Self { width, height, rgb, pixel: block as f64 / scale }
    }

    /// Width and height in points.
    pub(super) fn size_in_points(&self) -> (f64, f64) {
        (self.width as f64 * self.pixel, self.height as f64 * self.pixel)
    }

    /// Width and height in pixels.
    pub(super) fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// Three bytes per pixel, row by row.
    pub(super) fn rgb(&self) -> &[u8] {
        &self.rgb
    }

    /// Writes the picture in PNG format.
    pub(super) fn encode(&self, file: impl Write) -> io::Result<()> {
        let mut encoder = png::Encoder::new(file, self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        // Plots are drawn at the end of every run: larger files, sooner.
        encoder.set_compression(png::Compression::Fast);
        let mut writer = encoder.write_header().map_err(io::Error::other)?;
        writer.write_image_data(&self.rgb).and_then(|()| writer.finish()).map_err(io::Error::other)
    }
}

/// Bytes as text that may stand inside a document (RFC 4648).
pub(super) fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for group in bytes.chunks(3) {
        let bits = (0..3).fold(0, |bits, i| bits << 8 | u32::from(group.get(i).copied().unwrap_or(0)));
        for digit in 0..4 {
            let index = bits >> (18 - 6 * digit) & 63;
            text.push(if digit <= group.len() { char::from(DIGITS[index as usize]) } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_agrees_with_the_standard() {
        let known = [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")];
        for (plain, coded) in known {
            assert_eq!(base64(plain.as_bytes()), coded);
        }
        assert_eq!(base64(&[0xff, 0xfe, 0xfd]), "//79");
    }

    #[test]
    fn blocks_are_averaged() {
        let fine: Vec<u8> = (0..4 * 4 * 3).collect();
        let picture = Picture::averaged(&fine, 4, 2, 4.0);
        assert_eq!((picture.width, picture.height), (2, 2));
        // Pixels 0, 1, 4 and 5 of the first channel.
        assert_eq!(picture.rgb[0], (3 + 12 + 15) / 4);
        assert_eq!(picture.size_in_points(), (1.0, 1.0));
    }
}
