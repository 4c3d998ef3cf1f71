//! The boundary of a cloud from comma-separated text: `x[,y[,z]],nx[,ny[,nz]],area`, one piece per line.
//!
//! Every piece is carried by the particle nearest to its point, which must be within a spacing. A first
//! line of names and lines that begin with `#` are allowed. The pieces must close, and enclose the body:
//! its volume and centroid are taken from them.

use std::collections::HashMap;

use super::points::PointError;
use crate::setup::{Face, Particles};
use crate::tensor::Vector;

/// Most mistakes reported about one file.
const MOST_ERRORS: usize = 10;
/// How far a normal may be from length one.
const UNIT: f64 = 1e-3;

/// Reads the faces of a list of points.
///
/// # Errors
/// The first mistakes of the text, in its order.
pub fn read_faces<const D: usize>(
    text: &str,
    particles: &Particles<D>,
    spacing: f64,
) -> Result<Vec<Face<D>>, Vec<PointError>> {
    let nearest = Nearest::new(&particles.positions, spacing);
    let (mut faces, mut errors) = (Vec::new(), Vec::new());
    let mut reader =
        csv::ReaderBuilder::new().has_headers(false).flexible(true).comment(Some(b'#')).from_reader(text.as_bytes());
    for (index, record) in reader.records().enumerate() {
        let read = match &record {
            Ok(record) => {
                let numbers: Option<Vec<f64>> = record.iter().map(|field| field.trim().parse().ok()).collect();
                if numbers.is_none() && index == 0 && record.iter().all(|field| field.trim().parse::<f64>().is_err()) {
                    continue;
                }
                face(numbers.as_deref(), &nearest, spacing)
            }
            Err(error) => Err((format!("the line cannot be read ({error})"), "write numbers separated by commas")),
        };
        match read {
            Ok(face) => faces.push(face),
            Err((message, remedy)) => {
                let place = record.as_ref().ok().and_then(csv::StringRecord::position);
                let line = place.map_or(1, |place| place.line() as usize);
                let length = text.lines().nth(line.saturating_sub(1)).map_or(1, |line| line.chars().count().max(1));
                errors.push(PointError { line, column: 1, length, message, remedy: remedy.to_owned() });
            }
        }
        if errors.len() >= MOST_ERRORS {
            break;
        }
    }
    if errors.is_empty() && faces.is_empty() {
        let message = "the file holds no faces".to_owned();
        errors.push(PointError { line: 1, column: 1, length: 1, message, remedy: "write one face per line".into() });
    }
    if errors.is_empty() { Ok(faces) } else { Err(errors) }
}

/// One line.
fn face<const D: usize>(
    numbers: Option<&[f64]>,
    nearest: &Nearest<'_, D>,
    spacing: f64,
) -> Result<Face<D>, (String, &'static str)> {
    let columns = ["write x,nx,area", "write x,y,nx,ny,area", "write x,y,z,nx,ny,nz,area"][D - 1];
    let Some(numbers) = numbers.filter(|numbers| numbers.iter().all(|number| number.is_finite())) else {
        return Err(("not a line of finite numbers".into(), columns));
    };
    if numbers.len() != 2 * D + 1 {
        return Err((format!("{} columns, where a face has {}", numbers.len(), 2 * D + 1), columns));
    }
    let point = Vector::from_fn(|axis, _| numbers[axis]);
    let normal: Vector<D> = Vector::from_fn(|axis, _| numbers[D + axis]);
    let area = numbers[2 * D];
    if (normal.norm() - 1.0).abs() > UNIT {
        return Err((format!("a normal of length {}", normal.norm()), "give outward normals of length 1"));
    }
    if area <= 0.0 {
        return Err((format!("an area of {area}"), "areas are positive"));
    }
    let Some(particle) = nearest.to(&point) else {
        return Err((format!("no point within {spacing} m"), "put faces beside the points that carry them"));
    };
    Ok(Face { particle, normal: normal.normalize(), area, point, side: None })
}

/// Points in cells of one spacing.
struct Nearest<'a, const D: usize> {
    positions: &'a [Vector<D>],
    spacing: f64,
    cells: HashMap<[i64; D], Vec<usize>>,
}

impl<'a, const D: usize> Nearest<'a, D> {
    fn new(positions: &'a [Vector<D>], spacing: f64) -> Self {
        let mut cells: HashMap<[i64; D], Vec<usize>> = HashMap::new();
        for (index, position) in positions.iter().enumerate() {
            cells.entry(cell(position, spacing)).or_default().push(index);
        }
        Self { positions, spacing, cells }
    }

    /// The point nearest to a place, the first of several; none if it is more than a spacing away.
    fn to(&self, place: &Vector<D>) -> Option<usize> {
        let home = cell(place, self.spacing);
        let around = (0..3_usize.pow(D as u32)).filter_map(|code| {
            self.cells.get(&std::array::from_fn(|axis| {
                home[axis].saturating_add((code / 3_usize.pow(axis as u32) % 3) as i64 - 1)
            }))
        });
        let distance = |index: &usize| (self.positions[*index] - place).norm();
        around
            .flatten()
            .copied()
            .filter(|index| distance(index) <= self.spacing)
            .min_by(|a, b| distance(a).total_cmp(&distance(b)).then(a.cmp(b)))
    }
}

fn cell<const D: usize>(place: &Vector<D>, spacing: f64) -> [i64; D] {
    // The cast saturates: points that far away share a cell, and distances still decide.
    std::array::from_fn(|axis| (place[axis] / spacing).floor() as i64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::read_points;

    #[test]
    fn faces_are_read_and_mistakes_located() {
        let points = read_points::<2>("0,0\n1,0\n0,1\n1,1\n", 1.0).unwrap();
        let faces = read_faces("x,y,nx,ny,area\n0.5,-0.1,0,-1,1\n1.1,0.9,1,0,0.5\n", &points, 1.0).unwrap();
        assert_eq!(faces.iter().map(|face| face.particle).collect::<Vec<_>>(), [0, 3]);
        assert_eq!((faces[1].normal, faces[1].area), (Vector::<2>::new(1.0, 0.0), 0.5));
        let cases = [
            ("0,0,0,-1\n", 1, "4 columns"),
            ("# faces\n0,0,0,-1,1\n0,0,0,-2,1\n", 3, "normal of length 2"),
            ("0,0,0,-1,0\n", 1, "area of 0"),
            ("9,0,0,-1,1\n", 1, "no point within"),
            ("0,0,a,-1,1\n", 1, "finite numbers"),
            ("", 1, "no faces"),
        ];
        for (text, line, phrase) in cases {
            let errors = read_faces(text, &points, 1.0).unwrap_err();
            assert!(errors[0].line == line && errors[0].message.contains(phrase), "{text:?}: {errors:?}");
        }
    }
}
