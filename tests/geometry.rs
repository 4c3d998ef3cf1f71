//! Geometry as scenes have it: shapes with set operations, STL, Gmsh and VTU files, groups, and what `check` says of them.

#[path = "geometry/files.rs"]
mod files;
#[path = "geometry/hole.rs"]
mod hole;
mod support;

use std::f64::consts::FRAC_PI_4;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use nicolson::setup::Setup;
use support::written::read;

/// A scene of one elastic body.
pub fn scene(dimension: usize, body: &str, rest: &str) -> String {
    format!(
        "dimension = {dimension}\n[[body]]\n{body}\nsmoothing = 1.0\nmaterial.linear_elastic = {{ density = 2, \
         youngs_modulus = 1e6, poissons_ratio = 0.3 }}\n{rest}\n[time]\nscheme = 'static'\nend = 1\nstep = 1\n"
    )
}

/// Set-up and warnings of a scene that is right.
pub fn good<const D: usize>(body: &str, rest: &str, folder: &Path) -> (Setup<D>, Vec<String>) {
    read(&scene(D, body, rest), folder).unwrap_or_else(|errors| panic!("{errors}"))
}

/// Runs the program in a folder.
pub fn nicolson(arguments: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_nicolson"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("the program starts")
}

/// A file of `examples/`.
pub fn example(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("examples").join(name)
}

#[test]
fn set_operations_are_filled() {
    let here = Path::new("");
    let (plate, _) = good::<2>(
        "spacing = 0.1\nshape.difference = [{ box = { lower = [-1, -1], upper = [1, 1] } }, { disc = { centre = [0, 0], \
         radius = 0.3 } }]",
        "[[boundary]]\nselect.face = 'lower_x'\nfix = ['x']\n[[traction]]\nface = 'upper_x'\nvalue = [1, 0]\n\
         [[traction]]\nselect.where = 'X^2 + Y^2 < 0.2'\nvalue = ['X', 'Y']",
        here,
    );
    let volume: f64 = plate.particles.volumes.iter().sum();
    assert!((volume / (4.0 - 0.09 * std::f64::consts::PI) - 1.0).abs() < 1e-4, "{volume}");
    let area = |index: usize| plate.tractions[index].areas.iter().map(|(_, area)| area).sum::<f64>();
    assert!((area(0) - 2.0).abs() < 1e-3 && (area(1) / (0.6 * std::f64::consts::PI) - 1.0).abs() < 0.02, "{}", area(1));
    // Sums over every form that a scene knows.
    let (solid, _) = good::<3>(
        "spacing = 0.125\nshape.union = [{ sphere = { centre = [0, 0, 0], radius = 1 } }, { cylinder = { start = [0, 0, 0], \
         end = [0, 0, 2], radius = 0.5 } }, { intersection = [{ trapezoid = { lower = [-1, -2], base = 2, top = 1, rise = \
         2, height = [-0.5, 0.5] } }, { half_space = { point = [0, 0, 0], normal = [0, 0, -1] } }] }]",
        "[[traction]]\nfacing = [0, 0, 1]\nselect.where = 'Z > 1.8'\nvalue = [0, 0, 1]",
        here,
    );
    assert!((solid.tractions[0].areas.iter().map(|(_, area)| area).sum::<f64>() / FRAC_PI_4 - 1.0).abs() < 0.05);
    let (turned, _) = good::<2>(
        "spacing = 0.1\nlattice = { angle = 45 }\nshape.polygon = { corners = [[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]] }",
        "",
        here,
    );
    assert!((turned.particles.volumes.iter().sum::<f64>() - 3.0).abs() < 1e-12);
    let record = &turned.geometry[0];
    assert!((record.mass - 6.0).abs() < 1e-12 && record.volume_error.unwrap().abs() < 1e-3 && record.has_faces);
}

#[test]
fn mistakes_in_shapes_are_explained() {
    let cases = [
        (2, "shape.union = []", "a set operation on nothing"),
        (2, "shape.half_space = { point = [0, 0], normal = [0, 1] }", "has no end along x"),
        (2, "shape.disc = { centre = [0, 0], radius = 1, inner = 2 }", "radii from 2 to 1"),
        (2, "shape.disc = { centre = [0, 0], radius = 0.05 }", "does not fit"),
        (2, "shape.sphere = { centre = [0, 0], radius = 1 }", "no such shape"),
        (1, "shape.disc = { centre = [0], radius = 1 }", "no such shape"),
        (3, "shape.polygon = { corners = [[0, 0], [1, 0], [0, 1]] }", "has no height"),
        (2, "shape.polygon = { corners = [[0, 0], [2, 1], [2, 0], [0, 2]] }", "edges 1 and 3 of the polygon cross"),
        (2, "shape.polygon = { corners = [[0, 0], [1, 1]] }", "without an area"),
        (
            2,
            "shape.difference = [{ disc = { centre = [0, 0], radius = 1 } }, { disc = { centre = [0, 0], radius = 2 } }]",
            "nothing is inside",
        ),
        (
            2,
            "shape.union = [{ mapped_box = { lower = [0, 0], upper = [1, 1], map = ['X', 'Y'] } }]",
            "mapped box cannot",
        ),
        (2, "shape.disc = { centre = [0, 0], radius = 1 }\nlayout = 'vertex'", "`layout` does not go with"),
        (2, "shape.ring = { centre = [0, 0], outer = 1 }\nlattice = { angle = 3 }", "a lattice of its own"),
        (2, "shape.disc = { centre = [0, 0], radius = 1 }\nlattice = { axis = [0, 0, 1] }", "has no axis"),
        (3, "shape.cylinder = { start = [0, 0, 0], end = [0, 0, 0], radius = 1 }", "has no length"),
        (2, "shape.disc = { centre = [0, 0], radius = 1 }\nmesh.file = 'a.msh'", "one of shape, points and mesh"),
    ];
    for (dimension, body, phrase) in cases {
        let text = scene(dimension, &format!("spacing = 0.1\n{body}"), "");
        let error = match dimension {
            1 => read::<1>(&text, Path::new("")).map(drop),
            2 => read::<2>(&text, Path::new("")).map(drop),
            _ => read::<3>(&text, Path::new("")).map(drop),
        };
        let error = error.expect_err(body).to_string();
        assert!(error.contains(phrase) && error.contains("help: "), "{body}\n{error}");
    }
    let disc = "spacing = 0.1\nshape.disc = { centre = [0, 0], radius = 1 }";
    for (rest, phrase) in [
        ("[[traction]]\nvalue = [1, 0]", "does not say where it acts"),
        ("[[traction]]\nfacing = [0, 0]\nvalue = [1, 0]", "the direction is zero"),
        ("[[traction]]\ngroup = 'a'\nvalue = [1, 0]", "there is no group 'a'"),
        ("[[boundary]]\nselect.group = 'a'\nfix = ['x']", "there is no group 'a'"),
        ("[[boundary]]\nselect.face = 'upper_x'\nfix = ['x']", "selects no particle"),
    ] {
        let error = read::<2>(&scene(2, disc, rest), Path::new("")).expect_err(rest).to_string();
        assert!(error.contains(phrase), "{rest}\n{error}");
    }
}
