//! Shapes, layouts and boundaries in scenes: what is written is what is filled.

mod support;

use std::path::Path;

use nicolson::setup::{Constraint, Setup};
use support::written::{read, set_up};

fn scene(body: &str, rest: &str) -> String {
    format!(
        "dimension = 2\n[[body]]\n{body}\nmaterial.linear_volumetric = {{ density = 1, bulk_modulus = 1 }}\n{rest}\n\
         [time]\nend = 1\nstep = 0.1\n"
    )
}

fn good(body: &str, rest: &str) -> Setup<2> {
    set_up(&scene(body, rest)).0
}

fn first_error(body: &str, rest: &str) -> String {
    read::<2>(&scene(body, rest), Path::new("")).expect_err("a mistake").to_string()
}

const BEAM: &str = "counts = [36, 4]\nlayout = ['vertex', 'cell']\nshape.mapped_box = { lower = [0.25, 0.19], upper = \
                    [0.6, 0.21], map = ['0.6 - (0.6 - X)*(0.4 - sqrt(0.05^2 - (Y - 0.2)^2))/0.35', 'Y'] }";

#[test]
fn a_beam_is_clamped_on_an_arc_by_the_name_of_its_face() {
    let clamp = "[[boundary]]\nselect.face = 'lower_x'\nfix = ['x', 'y']\n\
                 [[traction]]\nface = 'upper_x'\nvalue = [0, 1]\n[[probe]]\nname = 'tip'\nat = [0.6, 0.2]";
    let setup = good(BEAM, clamp);
    assert_eq!(setup.particles.positions.len(), 36 * 4);
    let held: Vec<usize> = (0..36 * 4).filter(|a| setup.constraints[*a] == [Constraint::Fixed; 2]).collect();
    assert_eq!(held, [0, 36, 72, 108]);
    for a in held {
        let x = setup.particles.positions[a];
        let from_centre = (x[0] - 0.2).hypot(x[1] - 0.2);
        // Middles of chords: beside the circle by their sagitta, 0.005²/8/0.05.
        assert!(from_centre < 0.05 && from_centre > 0.05 - 7e-5, "{from_centre}");
    }
    assert_eq!(setup.tractions[0].areas.len(), 4);
    assert!((setup.tractions[0].areas.iter().map(|(_, area)| area).sum::<f64>() - 0.02).abs() < 1e-15);
    // The segment between the chord polygon and x = 0.6.
    let start = |y: f64| 0.2 + (0.05_f64.powi(2) - (y - 0.2).powi(2)).sqrt();
    let polygon: f64 =
        [0.19, 0.195, 0.2, 0.205].iter().map(|y| 0.005 * (0.6 - (start(*y) + start(y + 0.005)) / 2.0)).sum();
    assert!((setup.particles.volumes.iter().sum::<f64>() - polygon).abs() < 1e-15);
}

#[test]
fn rings_and_shaken_boxes_are_filled() {
    let ring = good(
        "spacing = 0.1\nshape.ring = { centre = [1, 2], inner = 0.5, outer = 1 }",
        "[[boundary]]\nselect.face = 'lower_x'\nfix = ['x', 'y']\n[[traction]]\nface = 'upper_x'\nvalue = [1, 0]",
    );
    assert_eq!(ring.constraints.iter().filter(|kind| **kind == [Constraint::Fixed; 2]).count(), 31);
    // Chords of a polygon with 63 corners.
    let around: f64 = ring.tractions[0].areas.iter().map(|(_, area)| area).sum();
    assert!((around - 126.0 * (std::f64::consts::PI / 63.0).sin()).abs() < 1e-12, "{around}");

    let flat = good("counts = [9, 9]\nshape.box = { lower = [0, 0], upper = [1, 1] }", "");
    let perturb =
        |text: &str| good(&format!("counts = [9, 9]\nshape.box = {{ lower = [0, 0], upper = [1, 1] }}\n{text}"), "");
    let (one, again) = (perturb("perturb = { amount = 0.2 }"), perturb("perturb = { amount = 0.2, seed = 1 }"));
    let other = perturb("perturb = { amount = 0.2, seed = 2 }");
    assert_eq!(one.particles, again.particles);
    assert_ne!(one.particles, other.particles);
    let moved = one.particles.positions.iter().zip(&flat.particles.positions).map(|(a, b)| (a - b).amax());
    let largest = moved.fold(0.0, f64::max);
    assert!(largest > 0.15 / 8.0 && largest <= 0.2 / 8.0 + 1e-15, "{largest}");
    assert!((one.particles.volumes.iter().sum::<f64>() - 1.0).abs() < 1e-14);
}

#[test]
fn faces_of_a_cloud_come_from_a_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let (mut points, mut faces) = (String::from("x,y\n"), String::from("x,y,nx,ny,area\n"));
    let flat = good("counts = [5, 5]\nshape.box = { lower = [0, 0], upper = [1, 1] }", "").particles;
    flat.positions.iter().for_each(|x| points += &format!("{},{}\n", x[0], x[1]));
    flat.faces.iter().for_each(|face| {
        faces += &format!("{},{},{},{},{}\n", face.point[0], face.point[1], face.normal[0], face.normal[1], face.area);
    });
    std::fs::write(folder.path().join("cloud.csv"), points).expect("a file");
    std::fs::write(folder.path().join("faces.csv"), faces).expect("a file");
    let text = scene("points = { file = 'cloud.csv', spacing = 0.25, faces = 'faces.csv' }", "");
    let particles = read::<2>(&text, folder.path()).unwrap_or_else(|errors| panic!("{errors}")).0.particles;
    assert_eq!(particles.faces.len(), flat.faces.len());
    // 25 points of volume 1/16 were told that they fill the unit square around (1/2, 1/2).
    assert!(particles.volumes.iter().all(|volume| (volume - 0.04).abs() < 1e-14));
    let error = read::<2>(&text.replace("faces.csv", "none.csv"), folder.path()).expect_err("no file").to_string();
    assert!(error.contains("none.csv cannot be read"), "{error}");
}

#[test]
fn mistakes_in_shapes_are_explained() {
    let ring = |values: &str| format!("spacing = 0.1\nshape.ring = {{ {values} }}");
    let bent =
        |map: &str| format!("counts = [4, 4]\nshape.mapped_box = {{ lower = [0, 0], upper = [1, 1], map = {map} }}");
    let flat = |more: &str| format!("counts = [4, 4]\nshape.box = {{ lower = [0, 0], upper = [1, 1] }}\n{more}");
    let cases = [
        (bent("['X']"), "", "`map` has 1 component(s)"),
        (bent("['-X', 'Y']"), "", "turned inside out"),
        (bent("['1/X', 'Y']"), "", "the map sends"),
        (bent("['X + t', 'Y']"), "", "depends on the time"),
        (bent("['X + Z', 'Y']"), "", "`Z` does not exist"),
        (flat("layout = ['vertex']"), "", "`layout` has 1 component(s)"),
        (flat("layout = ['vertex', 'face']"), "", "`face`"),
        (flat("layout = 3"), "", "a layout"),
        (flat("perturb = { amount = 0.5 }"), "", "`amount` is 0.5"),
        (flat("perturb = { amount = 0.1 }\nvolumes = 'stencil'"), "", "cannot suit the stencil"),
        (flat("volumes = 'stencil'\nsmoothing = 5"), "", "moved from the second row"),
        (ring("centre = [0, 0], inner = 1, outer = 0.5"), "", "a ring from 1 to 0.5"),
        (ring("centre = [0, 0], outer = 0.04"), "", "does not fit"),
        (ring("centre = [0, 0], outer = 1, height = [0, 1]"), "", "has no height"),
        (ring("centre = [0, 0], outer = 1") + "\ncounts = [3, 3]", "", "`counts` belongs to boxes"),
        (flat(""), "[[boundary]]\nselect.face = 'lower_z'\nfix = ['x']", "no such face"),
        (flat(""), "[[boundary]]\nselect.face = 'left'\nfix = ['x']", "`left`"),
    ];
    for (body, rest, phrase) in cases {
        let error = first_error(&body, rest);
        assert!(error.contains(phrase), "{body}\n{error}");
    }
}
