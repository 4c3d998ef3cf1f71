//! Particle clouds from comma-separated text: `x[,y[,z]]` and optionally `volume`, one particle per line.
//!
//! A first line of names and lines that begin with `#` are allowed. Without a volume every particle stands
//! for `spacing^D`, which is also the weight of the kernel sums in any case. The order of the file is kept.
//! Clouds carry no faces: nothing here knows where their boundary is (see [`read_faces`](super::read_faces)).

use std::collections::HashMap;

use nalgebra::SVector;

use crate::setup::Particles;

/// Most mistakes reported about one file.
const MOST_ERRORS: usize = 10;

/// Points nearer to each other than this part of the spacing are the same point.
const SAME: f64 = 1e-6;

/// A mistake in a list of points.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("line {line}, column {column}: {message}")]
pub struct PointError {
    /// Line, from 1.
    pub line: usize,
    /// Character in the line, from 1.
    pub column: usize,
    /// Number of characters concerned.
    pub length: usize,
    /// What is wrong.
    pub message: String,
    /// What to do about it.
    pub remedy: String,
}

/// Reads a list of points.
///
/// # Errors
/// The first mistakes of the text, in its order.
pub fn read_points<const D: usize>(text: &str, spacing: f64) -> Result<Particles<D>, Vec<PointError>> {
    let mut list =
        List::<D> { text, errors: Vec::new(), columns: None, lines: Vec::new(), particles: Particles::default() };
    let mut reader =
        csv::ReaderBuilder::new().has_headers(false).flexible(true).comment(Some(b'#')).from_reader(text.as_bytes());
    let mut first = true;
    for record in reader.records() {
        match record {
            Ok(record) => list.take(&record, std::mem::take(&mut first), spacing),
            Err(error) => {
                let line = error.position().map_or(1, |position| position.line() as usize);
                list.error(line, 0, format!("the line cannot be read ({error})"), "write numbers separated by commas");
            }
        }
        if list.errors.len() >= MOST_ERRORS {
            break;
        }
    }
    if list.errors.is_empty() && list.particles.positions.is_empty() {
        list.error(1, 0, "the file holds no points".to_owned(), "write one particle per line");
    }
    if list.errors.is_empty() {
        list.refuse_duplicates(spacing);
    }
    if list.errors.is_empty() { Ok(list.particles) } else { Err(list.errors) }
}

struct List<'a, const D: usize> {
    text: &'a str,
    errors: Vec<PointError>,
    /// Columns of the first line of numbers, and that line.
    columns: Option<(usize, usize)>,
    /// Line of every particle.
    lines: Vec<usize>,
    particles: Particles<D>,
}

impl<const D: usize> List<'_, D> {
    fn take(&mut self, record: &csv::StringRecord, first: bool, spacing: f64) {
        let line = record.position().map_or(1, |position| position.line() as usize);
        if first && record.iter().all(|field| field.trim().parse::<f64>().is_err()) && self.header(record, line) {
            return;
        }
        let (columns, because) = *self.columns.get_or_insert((record.len(), line));
        if record.len() != D && record.len() != D + 1 {
            let names = ["x", "y", "z"][..D].join(",");
            let message = format!("{} columns in a {D}-dimensional scene", record.len());
            self.error(line, 0, message, &format!("write {names} or {names},volume"));
            return;
        }
        if record.len() != columns {
            let message = format!("{} columns, where line {because} has {columns}", record.len());
            self.error(line, 0, message, "give every line the same columns");
            return;
        }
        let before = self.errors.len();
        let mut numbers = [0.0; 4];
        for (column, field) in record.iter().enumerate() {
            let field = field.trim();
            match field.parse::<f64>() {
                Ok(number) if number.is_finite() && (column < D || number > 0.0) => numbers[column] = number,
                Ok(number) if number.is_finite() => {
                    self.error(line, column, format!("a volume of {number} is impossible"), "volumes are positive");
                }
                Ok(_) => self.error(line, column, format!("`{field}` is not finite"), "write a finite number"),
                Err(_) => self.error(line, column, format!("`{field}` is not a number"), "write a number such as 0.5"),
            }
        }
        if self.errors.len() == before {
            let kernel_volume = spacing.powi(D as i32);
            self.lines.push(line);
            self.particles.positions.push(SVector::from_fn(|axis, _| numbers[axis]));
            self.particles.volumes.push(if columns == D { kernel_volume } else { numbers[D] });
            self.particles.kernel_volumes.push(kernel_volume);
        }
    }

    /// Whether the first line is a header; a wrong one is reported.
    fn header(&mut self, record: &csv::StringRecord, line: usize) -> bool {
        let expected: Vec<&str> = ["x", "y", "z"].into_iter().take(D).chain(["volume"]).collect();
        let names: Vec<String> = record.iter().map(|field| field.trim().to_lowercase()).collect();
        if names.iter().any(|name| !name.starts_with(|letter: char| letter.is_alphabetic()) || name == "nan") {
            return false;
        }
        for (column, name) in names.iter().enumerate() {
            if expected.get(column) != Some(&name.as_str()) {
                let message = format!("`{name}` is not the name of column {}", column + 1);
                self.error(line, column, message, &format!("the columns are {}", expected.join(",")));
            }
        }
        true
    }

    fn refuse_duplicates(&mut self, spacing: f64) {
        for (index, other) in repeated_points(&self.particles.positions, spacing) {
            let (line, twin) = (self.lines[index], self.lines[other]);
            self.error(line, 0, format!("the same point as in line {twin}"), "remove one of the two");
        }
    }

    fn error(&mut self, line: usize, column: usize, message: String, remedy: &str) {
        let source = self.text.lines().nth(line.saturating_sub(1)).unwrap_or_default();
        let before: usize = source.split(',').take(column).map(|field| field.chars().count() + 1).sum();
        let field = source.split(',').nth(column).unwrap_or_default();
        let blank = field.chars().take_while(|letter| letter.is_whitespace()).count();
        let length = field.trim().chars().count().max(1);
        self.errors.push(PointError { line, column: before + blank + 1, length, message, remedy: remedy.to_owned() });
    }
}

/// The first pairs of points that are the same at the scale of a spacing: the later one, and the earlier.
pub fn repeated_points<const D: usize>(positions: &[SVector<f64, D>], spacing: f64) -> Vec<(usize, usize)> {
    let edge = SAME * spacing;
    let cell = |position: &SVector<f64, D>| -> [i64; D] { std::array::from_fn(|axis| (position[axis] / edge) as i64) };
    let mut cells: HashMap<[i64; D], usize> = HashMap::with_capacity(positions.len());
    let mut found = Vec::new();
    for (index, position) in positions.iter().enumerate() {
        let home = cell(position);
        // All cells around: two points on either side of a cell's border are still the same point.
        let twin = (0..3_usize.pow(D as u32)).find_map(|code| {
            let around: [i64; D] =
                std::array::from_fn(|axis| home[axis].saturating_add((code / 3_usize.pow(axis as u32) % 3) as i64 - 1));
            let other = *cells.get(&around)?;
            ((positions[other] - position).norm() <= edge).then_some(other)
        });
        match twin {
            Some(other) => found.push((index, other)),
            None => drop(cells.insert(home, index)),
        }
        if found.len() >= MOST_ERRORS {
            break;
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn errors(text: &str) -> Vec<PointError> {
        read_points::<2>(text, 0.1).unwrap_err()
    }

    #[test]
    fn points_with_and_without_volumes_and_header() {
        let particles = read_points::<2>("# cloud\nx, y\n0, 0\n1e-1,0.5\n", 0.1).unwrap();
        assert_eq!(particles.positions[1], SVector::from([0.1, 0.5]));
        assert!((particles.volumes[0] - 0.01).abs() < 1e-15);
        let particles = read_points::<2>("0,0,3\n1,0,4\n", 0.1).unwrap();
        assert_eq!(particles.volumes, [3.0, 4.0]);
        assert!((particles.kernel_volumes[1] - 0.01).abs() < 1e-15);
        assert_eq!(read_points::<1>("0\n1\n2\n", 1.0).unwrap().positions.len(), 3);
        assert_eq!(read_points::<3>("0,0,0\r\n1,0,0\r\n", 1.0).unwrap().positions.len(), 2);
        assert_eq!(read_points::<1>("\u{feff}x\n1\n", 1.0).unwrap().positions.len(), 1);
    }

    #[test]
    fn mistakes_are_located() {
        let cases = [
            ("0,0\n1, abc\n", 2, 4, "not a number"),
            ("0,0\nnan,0\n", 2, 1, "not finite"),
            ("nan,0\n", 1, 1, "not finite"),
            ("0,inf\n", 1, 3, "not finite"),
            ("0,0\n1,0,1\n", 2, 1, "3 columns, where line 1 has 2"),
            ("0\n", 1, 1, "1 columns in a 2-dimensional"),
            ("0,0,0,0\n", 1, 1, "4 columns"),
            ("0,0,0\n", 1, 5, "volume of 0"),
            ("x,z\n0,0\n", 1, 3, "not the name of column 2"),
            ("", 1, 1, "no points"),
            ("x,y\n", 1, 1, "no points"),
            ("0,0\n1,1\n0.00000001,0\n", 3, 1, "same point as in line 1"),
            ("# one\n\n0,0\n,1\n", 4, 1, "not a number"),
        ];
        for (text, line, column, phrase) in cases {
            let found = &errors(text)[0];
            assert_eq!((found.line, found.column), (line, column), "{text:?}: {found}");
            assert!(found.message.contains(phrase) && !found.remedy.is_empty(), "{text:?}: {found}");
        }
        assert_eq!(errors(&"a,1\n0,b\n".repeat(100)).len(), MOST_ERRORS);
        assert!(read_points::<1>("1e300\n2e300\n", 1e-3).is_ok());
    }
}
