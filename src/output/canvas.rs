//! One drawing, two files: the same calls go to an SVG document and to a PNG picture.
//!
//! plotters draws on whole device pixels and, for thick lines in bitmaps, without anti-aliasing. So
//! both media are drawn in finer units: SVG in tenths of a point, PNG on (usually) four device pixels per
//! point of which two by two are averaged. The layout above this file is in points (1 point = 1 SVG pixel).
//!
//! Text in PNG uses a font inside the program (no font is searched on the machine, so the same data
//! give the same bytes everywhere); SVG names `sans-serif` and leaves the choice to the viewer.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use plotters::backend::{BitMapBackend, DrawingBackend, SVGBackend};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{
    Color, FontDesc, FontFamily, FontStyle, FontTransform, RGBColor, ShapeStyle, TextStyle, register_font,
};

use super::chart::Area;
use super::colour::scaled;
use super::picture::{Picture, base64};
use super::splat::{Look, render};
use super::{OutputError, write_atomically};

/// A position in points from the upper left corner, y downwards.
pub(super) type Point = (f64, f64);

/// Outcome of drawing; the text is what the drawing library reported.
pub(super) type Drawn = Result<(), String>;

/// Device units per point in SVG.
const VECTOR_SCALE: f64 = 10.0;
/// Pixels of a PNG per point, where nothing else is asked for.
pub(super) const DENSITY: f64 = 2.0;
/// Device pixels that are averaged into one pixel of a picture, in each direction.
const OVERSAMPLING: usize = 2;

/// Circles that an SVG document may hold before they become a picture inside it.
const MOST_CIRCLES: usize = 20_000;

/// Name under which the embedded font is registered.
const FONT: &str = "nicolson plots";
/// Height of the embedded font (ascent − descent) over its em; the drawing library measures in heights.
const FONT_HEIGHT: f64 = 1.121;
/// The drawing library divides the size of SVG fonts by this.
const VECTOR_FONT_HEIGHT: f64 = 1.24;

pub(super) const BLACK: RGBColor = RGBColor(0x20, 0x20, 0x20);
pub(super) const GREY: RGBColor = RGBColor(0x80, 0x80, 0x80);
pub(super) const PALE: RGBColor = RGBColor(0xe2, 0xe2, 0xe2);
pub(super) const WHITE: RGBColor = RGBColor(0xff, 0xff, 0xff);

/// Something that can be drawn on either medium.
pub(super) trait Drawing {
    /// Width and height in points.
    fn size(&self) -> (f64, f64);
    /// Draws everything; the background is white already.
    fn draw<B: DrawingBackend>(&self, canvas: &mut Canvas<'_, B>) -> Drawn;
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Medium {
    Vector,
    Raster,
}

/// Which part of a text lies at the given position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Align {
    Left,
    Centre,
    Right,
}

/// A filled disc.
#[derive(Debug, Clone, Copy)]
pub(super) struct Disc {
    pub(super) centre: Point,
    pub(super) radius: f64,
    /// Towards the viewer, in points; for discs that are shown as balls.
    pub(super) depth: f64,
    pub(super) colour: RGBColor,
}

/// Draws in points on a backend of plotters.
pub(super) struct Canvas<'a, B: DrawingBackend> {
    backend: &'a mut B,
    scale: f64,
    /// Where positions count from.
    origin: Point,
    medium: Medium,
    /// Pictures that lie under everything else of an SVG document, as elements.
    pictures: Vec<String>,
}

impl<B: DrawingBackend> Canvas<'_, B> {
    fn device(&self, (x, y): Point) -> (i32, i32) {
        // Far outside stays outside, without overflow in the rasteriser.
        let unit = |value: f64| (value * self.scale).round().clamp(-1e5, 1e5) as i32;
        (unit(x + self.origin.0), unit(y + self.origin.1))
    }

    /// Lets positions count from another point.
    pub(super) fn count_from(&mut self, origin: Point) {
        self.origin = origin;
    }

    /// A polyline; positions must be finite.
    pub(super) fn line(&mut self, points: &[Point], width: f64, colour: RGBColor) -> Drawn {
        let device: Vec<_> = points.iter().map(|&point| self.device(point)).collect();
        let stroke = ((width * self.scale).round() as u32).max(1);
        let style = ShapeStyle { color: colour.to_rgba(), filled: true, stroke_width: stroke };
        match self.medium {
            Medium::Vector => self.backend.draw_path(device, &style).map_err(described),
            // Piece by piece: the outline of a whole polyline that crosses itself would be filled wrongly.
            Medium::Raster => {
                for pair in device.windows(2) {
                    self.backend.draw_line(pair[0], pair[1], &style).map_err(described)?;
                }
                if device.len() > 2 && stroke > 2 {
                    for &joint in &device[1..device.len() - 1] {
                        self.backend.draw_circle(joint, stroke / 2, &style, true).map_err(described)?;
                    }
                }
                Ok(())
            }
        }
    }

    /// A filled rectangle.
    pub(super) fn rectangle(&mut self, corner: Point, opposite: Point, colour: RGBColor) -> Drawn {
        let style = ShapeStyle { color: colour.to_rgba(), filled: true, stroke_width: 0 };
        self.backend.draw_rect(self.device(corner), self.device(opposite), &style, true).map_err(described)
    }

    /// A filled disc.
    pub(super) fn disc(&mut self, centre: Point, radius: f64, colour: RGBColor) -> Drawn {
        let style = ShapeStyle { color: colour.to_rgba(), filled: true, stroke_width: 0 };
        let radius = ((radius * self.scale).round() as u32).max(1);
        self.backend.draw_circle(self.device(centre), radius, &style, true).map_err(described)
    }

    /// Many discs, *under* everything else: to be drawn first. `under` lie under the others, as an outline.
    ///
    /// An SVG document of a hundred thousand circles is slow to open, so beyond some number they become a
    /// picture inside the document.
    pub(super) fn cloud(&mut self, area: Area, under: &[Disc], discs: &[Disc], look: Look) -> Drawn {
        let moved = |discs: &[Disc]| -> Vec<Disc> {
            let corner = |(x, y): Point| (x - area.left, y - area.top);
            discs.iter().map(|disc| Disc { centre: corner(disc.centre), ..*disc }).collect()
        };
        let size = (area.width(), area.height());
        if self.medium == Medium::Raster {
            let pixels = render(size, self.scale, &moved(under), &moved(discs), look);
            let corner = self.device((area.left, area.top));
            let size = (pixels.width as u32, pixels.height as u32);
            return self.backend.blit_bitmap(corner, size, &pixels.rgb).map_err(described);
        }
        // Each has its outline, or its rim.
        if 2 * (under.len() + discs.len()) <= MOST_CIRCLES {
            return self.circles(under, discs, look);
        }
        let scale = DENSITY * OVERSAMPLING as f64;
        let pixels = render(size, scale, &moved(under), &moved(discs), look);
        let picture = Picture::averaged(&pixels.rgb, pixels.width, OVERSAMPLING, scale);
        let mut file = Vec::new();
        picture.encode(&mut file).map_err(described)?;
        let ((x, y), (width, height)) = (self.device((area.left, area.top)), picture.size_in_points());
        let unit = |value: f64| (value * self.scale).round() as i32;
        let (width, height) = (unit(width), unit(height));
        let data = base64(&file);
        self.pictures.push(format!(
            "<image x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" href=\"data:image/png;base64,{data}\"/>\n"
        ));
        Ok(())
    }

    /// The cloud as circles of an SVG document.
    fn circles(&mut self, under: &[Disc], discs: &[Disc], look: Look) -> Drawn {
        under.iter().try_for_each(|disc| self.disc(disc.centre, disc.radius + 0.9, GREY))?;
        under.iter().try_for_each(|disc| self.disc(disc.centre, disc.radius, WHITE))?;
        match look {
            Look::Flat { outline } => {
                if outline > 0.0 {
                    discs.iter().try_for_each(|disc| self.disc(disc.centre, disc.radius + outline, BLACK))?;
                }
                discs.iter().try_for_each(|disc| self.disc(disc.centre, disc.radius, disc.colour))
            }
            // No light in a drawing of circles: a rim tells them apart.
            Look::Balls => discs.iter().try_for_each(|disc| {
                self.disc(disc.centre, disc.radius, scaled(disc.colour, 0.6))?;
                self.disc(disc.centre, (0.82 * disc.radius).max(disc.radius - 1.0), disc.colour)
            }),
        }
    }

    /// Text whose baseline passes through `at`.
    pub(super) fn text(&mut self, at: Point, text: &str, size: f64, align: Align) -> Drawn {
        self.write(at, text, size, align, FontTransform::None)
    }

    /// Text that reads upwards and whose baseline passes through `at`.
    pub(super) fn text_upwards(&mut self, at: Point, text: &str, size: f64, align: Align) -> Drawn {
        self.write(at, text, size, align, FontTransform::Rotate270)
    }

    fn write(&mut self, at: Point, text: &str, size: f64, align: Align, turn: FontTransform) -> Drawn {
        let mut printable: String = text.chars().filter(|character| !character.is_control()).collect();
        if self.medium == Medium::Raster {
            // The rasteriser drops the empty margin at the left of every glyph; that of a bracket is as
            // wide as the space before a unit, which would seem to be missing.
            printable = printable.replace(" [", "  [");
        }
        if printable.is_empty() {
            return Ok(());
        }
        // Both media hang the text from its top, but each has its own idea how far the baseline is below.
        let (family, height, below) = match self.medium {
            Medium::Vector => (FontFamily::SansSerif, VECTOR_FONT_HEIGHT, 0.76),
            Medium::Raster => (FontFamily::Name(FONT), FONT_HEIGHT, FONT_HEIGHT / 2.0),
        };
        let top = if matches!(turn, FontTransform::Rotate270) {
            (at.0 - below * size, at.1)
        } else {
            (at.0, at.1 - below * size)
        };
        let font = FontDesc::new(family, size * height * self.scale, FontStyle::Normal).transform(turn);
        let horizontal = match align {
            Align::Left => HPos::Left,
            Align::Centre => HPos::Center,
            Align::Right => HPos::Right,
        };
        let style = TextStyle::from(font).color(&BLACK).pos(Pos::new(horizontal, VPos::Top));
        let device = self.device(top);
        self.backend.draw_text(&printable, &style, device).map_err(described)
    }
}

fn described(error: impl std::fmt::Display) -> String {
    error.to_string()
}

/// Width in points that a text may need, with a margin for the wider fonts an SVG viewer may choose.
pub(super) fn text_width(text: &str, size: f64) -> f64 {
    const MEASURED_AT: f64 = 200.0;
    // Registered first: a description of a font that is not there yet never finds it.
    let width = font_is_ready()
        .then(|| FontDesc::new(FontFamily::Name(FONT), MEASURED_AT * FONT_HEIGHT, FontStyle::Normal))
        .and_then(|font| font.box_size(text).ok());
    let em = width.map_or(0.6 * text.chars().count() as f64, |(width, _)| f64::from(width) / MEASURED_AT);
    1.12 * em * size
}

/// The text, shortened to `width` points if it is longer.
pub(super) fn shortened(text: &str, size: f64, width: f64) -> String {
    if text_width(text, size) <= width {
        return text.to_owned();
    }
    let mut kept: Vec<char> = text.chars().collect();
    loop {
        kept.pop();
        let candidate: String = kept.iter().chain(&['…']).collect();
        if kept.is_empty() || text_width(&candidate, size) <= width {
            return candidate;
        }
    }
}

/// Registers the embedded font on first use.
fn font_is_ready() -> bool {
    static READY: OnceLock<bool> = OnceLock::new();
    *READY.get_or_init(|| register_font(FONT, FontStyle::Normal, epaint_default_fonts::UBUNTU_LIGHT).is_ok())
}

/// Writes `STEM.svg` and `STEM.png` and returns both paths.
pub(super) fn write_both(drawing: &impl Drawing, stem: &Path) -> Result<[PathBuf; 2], OutputError> {
    // Not `with_extension`, which would cut a stem such as `probe.tip`.
    let named = |extension: &str| {
        let mut name = OsString::from(stem);
        name.push(extension);
        PathBuf::from(name)
    };
    let (svg, png) = (named(".svg"), named(".png"));
    write_svg(drawing, &svg)?;
    write_png(drawing, DENSITY, &png)?;
    Ok([svg, png])
}

/// Writes an SVG document.
pub(super) fn write_svg(drawing: &impl Drawing, path: &Path) -> Result<(), OutputError> {
    let document = document(drawing, path)?;
    write_atomically(path, |file| file.write_all(document.as_bytes()))
}

/// Writes a PNG picture with `density` pixels per point.
pub(super) fn write_png(drawing: &impl Drawing, density: f64, path: &Path) -> Result<(), OutputError> {
    let picture = picture(drawing, density, path)?;
    write_atomically(path, |file| picture.encode(file))
}

/// The drawing as an SVG document; `path` is what messages name.
pub(super) fn document(drawing: &impl Drawing, path: &Path) -> Result<String, OutputError> {
    vector(drawing).map_err(|reason| OutputError::Drawing { path: path.to_path_buf(), reason })
}

/// The drawing as pixels, `density` of them per point; `path` is what messages name.
pub(super) fn picture(drawing: &impl Drawing, density: f64, path: &Path) -> Result<Picture, OutputError> {
    raster(drawing.size(), density, |canvas| drawing.draw(canvas))
        .map_err(|reason| OutputError::Drawing { path: path.to_path_buf(), reason })
}

fn device_size((width, height): (f64, f64), scale: f64) -> (u32, u32) {
    ((width * scale).round().max(1.0) as u32, (height * scale).round().max(1.0) as u32)
}

fn vector(drawing: &impl Drawing) -> Result<String, String> {
    let (width, height) = device_size(drawing.size(), VECTOR_SCALE);
    let mut document = String::new();
    let mut backend = SVGBackend::with_string(&mut document, (width, height));
    let mut canvas = Canvas {
        backend: &mut backend,
        scale: VECTOR_SCALE,
        origin: (0.0, 0.0),
        medium: Medium::Vector,
        pictures: Vec::new(),
    };
    canvas.rectangle((0.0, 0.0), drawing.size(), WHITE)?;
    drawing.draw(&mut canvas)?;
    let pictures = canvas.pictures.concat();
    backend.present().map_err(described)?;
    drop(backend);
    // The first element is the background; pictures lie directly on it.
    let background = document.find("/>\n").map_or(0, |at| at + 3);
    document.insert_str(background, &pictures);
    // The view box stays in fine units, the size on the page is in points.
    let fine = format!("width=\"{width}\" height=\"{height}\"");
    let (width, height) = (f64::from(width) / VECTOR_SCALE, f64::from(height) / VECTOR_SCALE);
    let points = format!("width=\"{width}\" height=\"{height}\" stroke-linejoin=\"round\" stroke-linecap=\"round\"");
    Ok(document.replacen(&fine, &points, 1))
}

/// Draws on a white bitmap of `size` points and averages it down to `density` pixels per point.
fn raster(
    size: (f64, f64),
    density: f64,
    draw: impl FnOnce(&mut Canvas<'_, BitMapBackend<'_>>) -> Drawn,
) -> Result<Picture, String> {
    if !font_is_ready() {
        return Err("the embedded font cannot be read".to_owned());
    }
    let scale = density * OVERSAMPLING as f64;
    let (width, height) = device_size(size, scale);
    let mut fine = vec![0xff; 3 * width as usize * height as usize];
    let mut backend: BitMapBackend<'_> =
        BitMapBackend::with_buffer_and_format(&mut fine, (width, height)).map_err(described)?;
    let (origin, pictures) = ((0.0, 0.0), Vec::new());
    draw(&mut Canvas { backend: &mut backend, scale, origin, medium: Medium::Raster, pictures })?;
    backend.present().map_err(described)?;
    drop(backend);
    Ok(Picture::averaged(&fine, width as usize, OVERSAMPLING, scale))
}
