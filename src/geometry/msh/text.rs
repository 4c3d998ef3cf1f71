//! Gmsh files as text.

use super::{Builder, Mesh, PointError, Wrong};
use crate::tensor::Vector;

type Fail = PointError;

/// Longest line of numbers, bytes.
const LONGEST_LINE: usize = 1 << 20;

fn fail(line: usize, message: impl Into<String>, remedy: &str) -> Fail {
    PointError { line, column: 1, length: 1, message: message.into(), remedy: remedy.to_owned() }
}

/// Reads a mesh.
pub(super) fn read(bytes: &[u8]) -> Result<Mesh, PointError> {
    let text = std::str::from_utf8(bytes).or_else(|error| {
        // Names may be in any encoding.
        std::str::from_utf8(&bytes[..error.valid_up_to()])
    });
    let text = text.unwrap_or_default();
    let mut reader = Reader { lines: text.lines(), line: 0, builder: Builder::default() };
    let mut version = None;
    while let Some(line) = reader.next() {
        let Some(section) = line.trim().strip_prefix('$') else {
            if line.trim().is_empty() {
                continue;
            }
            return Err(fail(
                reader.line,
                "this is not a Gmsh file",
                "export it from Gmsh as .msh, version 4.1 or 2.2",
            ));
        };
        let start = reader.line;
        if section != "MeshFormat" && version.is_none() {
            return Err(fail(start, "the file does not begin with `$MeshFormat`", "export it from Gmsh again"));
        }
        match (section, version) {
            ("MeshFormat", _) => version = Some(reader.format()?),
            ("PhysicalNames", _) => reader.names()?,
            ("Entities", Some(4)) => reader.entities()?,
            ("Nodes", Some(2)) => reader.nodes_2()?,
            ("Nodes", _) => reader.nodes_4()?,
            ("Elements", Some(2)) => reader.elements_2()?,
            ("Elements", _) => reader.elements_4()?,
            _ => {}
        }
        let end = format!("$End{section}");
        loop {
            match reader.next() {
                Some(line) if line.trim() == end => break,
                Some(_) if !matches!(section, "MeshFormat" | "PhysicalNames" | "Nodes" | "Elements") => {}
                Some(line) => {
                    let message = format!("`{}` where `{end}` should be", line.trim());
                    return Err(fail(reader.line, message, "the counts do not fit what is there: export it again"));
                }
                None => {
                    return Err(fail(
                        start,
                        format!("`${section}` has no `{end}`"),
                        "the file is cut short, or binary",
                    ));
                }
            }
        }
    }
    let line = reader.line.max(1);
    reader.builder.finished().map_err(|(message, remedy)| fail(line, message, remedy))
}

struct Reader<'a> {
    lines: std::str::Lines<'a>,
    line: usize,
    builder: Builder,
}

impl<'a> Reader<'a> {
    fn next(&mut self) -> Option<&'a str> {
        self.line += 1;
        self.lines.next()
    }

    fn need(&mut self) -> Result<&'a str, Fail> {
        self.next()
            .ok_or_else(|| fail(self.line.saturating_sub(1), "the file ends here", "it is cut short: export it again"))
    }

    /// The numbers of the next line, at least so many.
    fn row<T: std::str::FromStr>(&mut self, least: usize) -> Result<Vec<T>, Fail> {
        let line = self.need()?;
        if line.len() > LONGEST_LINE {
            return Err(fail(self.line, "a line that is too long for a mesh", "export it from Gmsh again"));
        }
        let row: Option<Vec<T>> = line.split_whitespace().map(|word| word.parse().ok()).collect();
        row.filter(|row| row.len() >= least).ok_or_else(|| {
            let shown: String = line.trim().chars().take(40).collect();
            fail(self.line, format!("`{shown}` where {least} or more numbers should be"), "export it from Gmsh again")
        })
    }

    fn format(&mut self) -> Result<u8, Fail> {
        let line = self.need()?;
        let words: Vec<&str> = line.split_whitespace().collect();
        let version = match words.first() {
            Some(&"2.2" | &"2.1" | &"2") => 2,
            Some(&"4.1") => 4,
            _ => {
                let message = format!("a format of version {}", words.first().unwrap_or(&"?"));
                return Err(fail(self.line, message, "save it with `Mesh.MshFileVersion = 4.1` or 2.2"));
            }
        };
        Ok(version)
    }

    fn names(&mut self) -> Result<(), Fail> {
        let count = self.row::<u64>(1)?[0];
        for _ in 0..count {
            let line = self.need()?;
            let named = self.builder.name(line);
            self.here(named)?;
        }
        Ok(())
    }

    /// Physical groups of points, curves, surfaces and volumes.
    fn entities(&mut self) -> Result<(), Fail> {
        let counts = self.row::<u64>(4)?;
        for (dimension, count) in counts.iter().take(4).enumerate() {
            for _ in 0..*count {
                let row = self.row::<f64>(5)?;
                // The number, then a point or the corners of a box, then the groups.
                let at = if dimension == 0 { 4 } else { 7 };
                let groups = row.get(at).copied().unwrap_or(0.0) as usize;
                let groups = row.iter().skip(at + 1).take(groups).map(|group| *group as i64).collect();
                self.builder.physical.insert((dimension, row[0] as i64), groups);
            }
        }
        Ok(())
    }

    /// Gives a mistake its line.
    fn here(&self, result: Result<(), Wrong>) -> Result<(), Fail> {
        result.map_err(|(message, remedy)| fail(self.line, message, remedy))
    }

    fn node(&mut self, number: u64, row: &[f64]) -> Result<(), Fail> {
        let taken = self.builder.node(number, Vector::<3>::from_fn(|axis, _| row[axis]));
        self.here(taken)
    }

    fn nodes_2(&mut self) -> Result<(), Fail> {
        let count = self.row::<u64>(1)?[0];
        for _ in 0..count {
            let row = self.row::<f64>(4)?;
            self.node(row[0] as u64, &row[1..])?;
        }
        Ok(())
    }

    fn nodes_4(&mut self) -> Result<(), Fail> {
        let blocks = self.row::<u64>(4)?[0];
        for _ in 0..blocks {
            let count = self.row::<u64>(4)?[3];
            let mut numbers = Vec::new();
            for _ in 0..count {
                numbers.push(self.row::<u64>(1)?[0]);
            }
            for number in numbers {
                let row = self.row::<f64>(3)?;
                self.node(number, &row)?;
            }
        }
        Ok(())
    }

    fn element(&mut self, form: u64, nodes: &[u64], groups: Vec<i64>) -> Result<(), Fail> {
        let taken = Builder::form(form).and_then(|form| self.builder.element(form, nodes, groups));
        self.here(taken)
    }

    fn elements_2(&mut self) -> Result<(), Fail> {
        let count = self.row::<u64>(1)?[0];
        for _ in 0..count {
            let row = self.row::<i64>(4)?;
            let tags = usize::try_from(row[2]).unwrap_or(usize::MAX).min(row.len() - 3);
            let group = row[3..3 + tags].first().copied().filter(|group| *group > 0);
            let nodes: Vec<u64> = row[3 + tags..].iter().map(|node| node.unsigned_abs()).collect();
            self.element(row[1].unsigned_abs(), &nodes, group.into_iter().collect())?;
        }
        Ok(())
    }

    fn elements_4(&mut self) -> Result<(), Fail> {
        let blocks = self.row::<u64>(4)?[0];
        for _ in 0..blocks {
            let head = self.row::<i64>(4)?;
            let key = (usize::try_from(head[0]).unwrap_or(usize::MAX), head[1]);
            let groups = self.builder.physical.get(&key).cloned().unwrap_or_default();
            for _ in 0..head[3] {
                let row = self.row::<u64>(2)?;
                self.element(head[2].unsigned_abs(), &row[1..], groups.clone())?;
            }
        }
        Ok(())
    }
}
