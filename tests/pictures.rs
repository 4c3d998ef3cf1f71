//! Pictures of frames whose every particle is known: where it must be, how large, and in which colour.

use std::borrow::Cow;
use std::fs;
use std::path::{Path, PathBuf};

use nicolson::output::{Frame, FrameChoice, HtmlReport, Precision, Rendering, View};

const PURPLE: [u8; 3] = [68, 1, 84];
const YELLOW: [u8; 3] = [253, 231, 37];
const MAGENTA: [u8; 3] = [255, 0, 255];

/// Writes a square of 5 × 5 particles at a distance of 2 m, moved to the right by `shift`; the value is 0 in the lower
/// left corner, 1 in the upper right, and not a number in the middle.
fn square(directory: &Path, number: usize, shift: f64) {
    let positions: Vec<f64> = (0..25).flat_map(|i| [2.0 * f64::from(i % 5) + shift, 2.0 * f64::from(i / 5)]).collect();
    let mut values = vec![0.5; 25];
    (values[0], values[12], values[24]) = (0.0, f64::NAN, 1.0);
    let displacements: Vec<f64> = (0..50).map(|i| if i % 2 == 0 { shift } else { 0.0 }).collect();
    Frame {
        time: number as f64,
        dim: 2,
        positions: &positions,
        scalars: vec![("heat", Cow::Borrowed(&values)), ("volume", Cow::Owned(vec![4.0; 25]))],
        vectors: vec![("displacement", Cow::Owned(displacements))],
        tensors: Vec::new(),
        provenance: "{}",
    }
    .write(&directory.join(format!("fields-{number:05}.vtu")), Precision::Double)
    .unwrap();
}

struct Pixels {
    width: usize,
    rgb: Vec<u8>,
}

impl Pixels {
    fn read(path: &Path) -> Self {
        let mut reader = png::Decoder::new(std::io::BufReader::new(fs::File::open(path).unwrap())).read_info().unwrap();
        let mut rgb = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut rgb).unwrap();
        Self { width: info.width as usize, rgb }
    }

    /// Number and mean place of the pixels left of `most` whose colour is no further from this one than `apart`.
    fn spot(&self, colour: [u8; 3], apart: i32, most: usize) -> (f64, f64, f64) {
        let (mut count, mut x, mut y) = (0.0, 0.0, 0.0);
        for (at, pixel) in self.rgb.chunks_exact(3).enumerate().filter(|(at, _)| at % self.width < most) {
            if pixel.iter().zip(colour).all(|(a, b)| (i32::from(*a) - i32::from(b)).abs() <= apart) {
                (count, x, y) = (count + 1.0, x + (at % self.width) as f64, y + (at / self.width) as f64);
            }
        }
        (count, x / count, y / count)
    }
}

fn render(rendering: &Rendering, directory: &Path) -> PathBuf {
    rendering.write(directory).unwrap().remove(0)
}

#[test]
fn known_particles_have_their_place_size_and_colour() {
    let directory = tempfile::tempdir().unwrap();
    square(directory.path(), 0, 0.0);
    let out = Some(directory.path().join("a.png"));
    let rendering =
        Rendering { field: Some("heat".into()), width: Some(900), height: Some(760), out, ..Rendering::default() };
    let pixels = Pixels::read(&render(&rendering, directory.path()));
    assert_eq!((pixels.width, pixels.rgb.len() / 3 / 900), (900, 760));
    // The colour bar, at the right, has these colours too.
    let most = 720;
    let (low, high, lost) = (pixels.spot(PURPLE, 0, most), pixels.spot(YELLOW, 0, most), pixels.spot(MAGENTA, 0, most));
    // Four distances to the right and upwards.
    assert!(high.1 > low.1 && high.2 < low.2, "{low:?} {high:?}");
    assert!((high.1 - low.1 - (low.2 - high.2)).abs() < 1.5, "equal axes");
    assert!((lost.1 - 0.5 * (low.1 + high.1)).abs() < 1.0 && (lost.2 - 0.5 * (low.2 + high.2)).abs() < 1.0);
    // Discs of a volume of 4 m² have a radius of 1 m; their rims are mixed with the outline.
    let radius = (high.1 - low.1) / 8.0;
    let area = std::f64::consts::PI * radius * radius;
    for (count, ..) in [low, high, lost] {
        assert!(count < area && count > 0.9 * area, "{count} of {area} pixels");
    }
    // The outline: dark pixels around each disc, as none touches another by more than a point.
    let ring = pixels.spot([0x20; 3], 40, most).0;
    let around = 25.0 * 2.0 * std::f64::consts::PI * radius;
    assert!(ring > 0.6 * around && ring < 1.6 * around, "{ring} of {around}");
    // A range makes everything else look like its ends.
    let out = Some(directory.path().join("b.png"));
    let narrow = Rendering { range: Some((0.6, 0.7)), out, ..rendering };
    let pixels = Pixels::read(&render(&narrow, directory.path()));
    assert!(pixels.spot(PURPLE, 0, most).0 > 20.0 * 0.9 * area);
}

#[test]
fn the_reference_outline_stays_where_the_body_was() {
    let directory = tempfile::tempdir().unwrap();
    square(directory.path(), 0, 20.0);
    // At the left there is what was drawn leftmost: the body in its one colour, or an outline with nothing inside.
    let at_left = |reference: bool| {
        let out = Some(directory.path().join("a.png"));
        let rendering = Rendering { reference, width: Some(900), out, ..Rendering::default() };
        let pixels = Pixels::read(&render(&rendering, directory.path()));
        (pixels.spot([33, 144, 141], 3, 300).0, pixels.spot([0x90; 3], 3, 300).0)
    };
    let (with, without) = (at_left(true), at_left(false));
    assert!(with.0 == 0.0 && with.1 > 300.0, "{with:?}");
    assert!(without.0 > 10_000.0, "{without:?}");
}

#[test]
fn an_animation_keeps_its_axes_and_moves_the_body() {
    let directory = tempfile::tempdir().unwrap();
    (0..4).for_each(|number| square(directory.path(), number, 3.0 * number as f64));
    let out = directory.path().join("a.gif");
    let rendering =
        Rendering { field: Some("heat".into()), out: Some(out.clone()), rate: Some(10.0), ..Rendering::default() };
    render(&rendering, directory.path());
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut decoder = options.read_info(fs::File::open(&out).unwrap()).unwrap();
    let (width, height) = (usize::from(decoder.width()), usize::from(decoder.height()));
    let mut screen = Pixels { width, rgb: vec![0; 3 * width * height] };
    let (mut places, mut delays) = (Vec::new(), Vec::new());
    while let Some(frame) = decoder.read_next_frame().unwrap() {
        let (left, top, across) = (usize::from(frame.left), usize::from(frame.top), usize::from(frame.width));
        for (at, rgba) in frame.buffer.chunks_exact(4).enumerate().filter(|(_, rgba)| rgba[3] > 0) {
            let place = 3 * ((top + at / across) * width + left + at % across);
            screen.rgb[place..place + 3].copy_from_slice(&rgba[..3]);
        }
        places.push(screen.spot(MAGENTA, 0, width));
        delays.push(frame.delay);
    }
    assert_eq!((places.len(), delays), (4, vec![10, 10, 10, 100]));
    assert_eq!(decoder.repeat(), gif::Repeat::Infinite);
    let steps: Vec<f64> = places.windows(2).map(|pair| pair[1].1 - pair[0].1).collect();
    assert!(steps[0] > 20.0 && steps.iter().all(|step| (step - steps[0]).abs() < 1.0), "{steps:?}");
    assert!(places.iter().all(|place| (place.2 - places[0].2).abs() < 0.5 && (place.0 - places[0].0).abs() < 10.0));
    // Numbered pictures instead.
    let rendering =
        Rendering { frames: Some(FrameChoice::All), out: Some(directory.path().join("b.svg")), ..rendering };
    let files = rendering.write(directory.path()).unwrap();
    assert_eq!(files[3], directory.path().join("b-00003.svg"));
    assert!(fs::read_to_string(&files[3]).unwrap().contains("t = 3 s"));
}

/// From the right the particle with the largest x hides the others; from the left it is hidden.
#[test]
fn views_of_space_show_what_is_in_front() {
    let directory = tempfile::tempdir().unwrap();
    let positions: Vec<f64> = (0..5).flat_map(|i| [f64::from(i), 0.0, 0.0]).collect();
    Frame {
        time: 0.0,
        dim: 3,
        positions: &positions,
        scalars: vec![("heat", Cow::Borrowed(&[0.0, 0.5, 0.5, 0.5, 1.0])), ("volume", Cow::Borrowed(&[1.0; 5]))],
        vectors: Vec::new(),
        tensors: Vec::new(),
        // All on one line: only the scene tells that it is space.
        provenance: "{\"scene\": \"dimension = 3\"}",
    }
    .write(&directory.path().join("fields-00000.vtu"), Precision::Single)
    .unwrap();
    let seen = |view: &str, perspective: bool| {
        let out = Some(directory.path().join("a.png"));
        let view = Some(View { perspective, ..View::parse(view).unwrap() });
        let rendering = Rendering { view, width: Some(900), out, ..Rendering::default() };
        let pixels = Pixels::read(&render(&rendering, directory.path()));
        (pixels.spot(YELLOW, 25, 700).0, pixels.spot(PURPLE, 12, 700).0)
    };
    for perspective in [false, true] {
        let (right, left) = (seen("right", perspective), seen("left", perspective));
        assert!(right.0 > 1000.0 && right.1 < 50.0, "{right:?}");
        assert!(left.0 < 50.0 && left.1 > 1000.0, "{left:?}");
    }
    let (yellow, purple) = seen("front", false);
    assert!(yellow > 500.0 && purple > 500.0);
}

/// A run that is far too large for the file is thinned, and says so.
#[test]
fn a_large_run_is_thinned_to_a_small_report() {
    let directory = tempfile::tempdir().unwrap();
    let count = 60_000;
    let positions: Vec<f64> = (0..3 * count).map(|i| f64::from(i as u32 * 7919 % 10_007)).collect();
    let values: Vec<f64> = (0..count).map(|i| f64::from(i as u32).sin()).collect();
    for number in 0..20 {
        Frame {
            time: 0.1 * number as f64,
            dim: 3,
            positions: &positions,
            scalars: vec![("pressure", Cow::Borrowed(&values))],
            vectors: Vec::new(),
            tensors: Vec::new(),
            provenance: "{}",
        }
        .write(&directory.path().join(format!("fields-{number:05}.vtu")), Precision::Single)
        .unwrap();
    }
    let file = HtmlReport::default().write(directory.path()).unwrap();
    let html = fs::read_to_string(file).unwrap();
    assert!(html.len() > 3_000_000 && html.len() < 5_000_000, "{}", html.len());
    assert!(html.contains("16 of 20 frames and ") && html.contains("of 60000 particles, drawn larger"));
}
