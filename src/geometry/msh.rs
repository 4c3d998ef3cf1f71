//! Meshes from Gmsh files: formats 2.2 and 4.1 in ASCII, elements of first order, physical groups with their names.
//!
//! What the file claims about numbers of nodes and elements is compared with what is there; nothing is allocated for it.

use std::collections::HashMap;

use super::points::PointError;
use crate::tensor::Vector;

/// A mesh as it stands in a file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// Places of the nodes, m.
    pub nodes: Vec<Vector<3>>,
    /// Elements of all dimensions.
    pub elements: Vec<Element>,
    /// Names of physical groups by dimension and number.
    pub names: HashMap<(usize, i64), String>,
}

/// An element of first order.
#[derive(Debug, Clone, PartialEq)]
pub struct Element {
    /// Its form.
    pub form: Form,
    /// Nodes in the order of Gmsh; as many as the form has.
    pub nodes: Vec<usize>,
    /// Numbers of the physical groups that it belongs to.
    pub groups: Vec<i64>,
}

/// Form of an element.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[allow(missing_docs, reason = "the names are those of the forms")]
pub enum Form {
    Point,
    Line,
    Triangle,
    Quadrilateral,
    Tetrahedron,
    Hexahedron,
    Prism,
    Pyramid,
}

impl Form {
    fn of(number: u64) -> Option<Self> {
        Some(match number {
            15 => Self::Point,
            1 => Self::Line,
            2 => Self::Triangle,
            3 => Self::Quadrilateral,
            4 => Self::Tetrahedron,
            5 => Self::Hexahedron,
            6 => Self::Prism,
            7 => Self::Pyramid,
            _ => return None,
        })
    }

    /// Number of dimensions and of nodes.
    pub fn size(self) -> (usize, usize) {
        match self {
            Self::Point => (0, 1),
            Self::Line => (1, 2),
            Self::Triangle => (2, 3),
            Self::Quadrilateral => (2, 4),
            Self::Tetrahedron => (3, 4),
            Self::Hexahedron => (3, 8),
            Self::Prism => (3, 6),
            Self::Pyramid => (3, 5),
        }
    }
}

type Fail = PointError;

/// Longest line of numbers, bytes.
const LONGEST_LINE: usize = 1 << 20;

fn fail(line: usize, message: impl Into<String>, remedy: &str) -> Fail {
    PointError { line, column: 1, length: 1, message: message.into(), remedy: remedy.to_owned() }
}

/// Reads a mesh.
///
/// # Errors
/// The first mistake, with its line.
pub fn read_msh(bytes: &[u8]) -> Result<Mesh, PointError> {
    let text = std::str::from_utf8(bytes).or_else(|error| {
        // Names may be in any encoding; a binary file shows in its format line.
        std::str::from_utf8(&bytes[..error.valid_up_to()])
    });
    let text = text.unwrap_or_default();
    let mut reader = Reader { lines: text.lines(), line: 0, numbers: HashMap::new(), physical: HashMap::new() };
    let mut mesh = Mesh::default();
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
            ("PhysicalNames", _) => reader.names(&mut mesh)?,
            ("Entities", Some(4)) => reader.entities()?,
            ("Nodes", Some(2)) => reader.nodes_2(&mut mesh)?,
            ("Nodes", _) => reader.nodes_4(&mut mesh)?,
            ("Elements", Some(2)) => reader.elements_2(&mut mesh)?,
            ("Elements", _) => reader.elements_4(&mut mesh)?,
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
    if mesh.nodes.is_empty() || mesh.elements.is_empty() {
        return Err(fail(reader.line.max(1), "the file holds no mesh", "generate the mesh before saving it"));
    }
    Ok(mesh)
}

struct Reader<'a> {
    lines: std::str::Lines<'a>,
    line: usize,
    /// Number of a node in the file to its index.
    numbers: HashMap<u64, usize>,
    /// Dimension and number of a part of the geometry to its physical groups.
    physical: HashMap<(usize, i64), Vec<i64>>,
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
        if words.get(1) != Some(&"0") {
            return Err(fail(self.line, "the file is binary", "save it as text, with `Mesh.Binary = 0`"));
        }
        Ok(version)
    }

    fn names(&mut self, mesh: &mut Mesh) -> Result<(), Fail> {
        let count = self.row::<u64>(1)?[0];
        for _ in 0..count {
            let line = self.need()?;
            let mut words = line.split_whitespace();
            let dimension = words.next().and_then(|word| word.parse().ok());
            let number = words.next().and_then(|word| word.parse().ok());
            let name = line.split_once('"').and_then(|(_, rest)| rest.rsplit_once('"')).map(|(name, _)| name);
            let (Some(dimension), Some(number), Some(name)) = (dimension, number, name) else {
                return Err(fail(self.line, "not a physical name", "write `dimension number \"name\"`"));
            };
            mesh.names.insert((dimension, number), name.to_owned());
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
                self.physical.insert((dimension, row[0] as i64), groups);
            }
        }
        Ok(())
    }

    fn node(&mut self, mesh: &mut Mesh, number: u64, row: &[f64]) -> Result<(), Fail> {
        let place = Vector::<3>::from_fn(|axis, _| row[axis]);
        if !place.iter().all(|x| x.is_finite()) {
            return Err(fail(self.line, "a node that is not finite", "repair the mesh"));
        }
        if self.numbers.insert(number, mesh.nodes.len()).is_some() {
            return Err(fail(self.line, format!("node {number} is there twice"), "export it from Gmsh again"));
        }
        mesh.nodes.push(place);
        Ok(())
    }

    fn nodes_2(&mut self, mesh: &mut Mesh) -> Result<(), Fail> {
        let count = self.row::<u64>(1)?[0];
        for _ in 0..count {
            let row = self.row::<f64>(4)?;
            self.node(mesh, row[0] as u64, &row[1..])?;
        }
        Ok(())
    }

    fn nodes_4(&mut self, mesh: &mut Mesh) -> Result<(), Fail> {
        let blocks = self.row::<u64>(4)?[0];
        for _ in 0..blocks {
            let count = self.row::<u64>(4)?[3];
            let mut numbers = Vec::new();
            for _ in 0..count {
                numbers.push(self.row::<u64>(1)?[0]);
            }
            for number in numbers {
                let row = self.row::<f64>(3)?;
                self.node(mesh, number, &row)?;
            }
        }
        Ok(())
    }

    fn element(&mut self, mesh: &mut Mesh, form: u64, nodes: &[u64], groups: Vec<i64>) -> Result<(), Fail> {
        let Some(form) = Form::of(form) else {
            let message = format!("elements of type {form} are not of first order");
            return Err(fail(self.line, message, "save the mesh with `Mesh.ElementOrder = 1`"));
        };
        if nodes.len() < form.size().1 {
            let message = format!("{} nodes, where this element has {}", nodes.len(), form.size().1);
            return Err(fail(self.line, message, "export it from Gmsh again"));
        }
        let indices: Option<Vec<usize>> =
            nodes[..form.size().1].iter().map(|number| self.numbers.get(number).copied()).collect();
        let Some(nodes) = indices else {
            return Err(fail(self.line, "a node that does not exist", "export it from Gmsh again"));
        };
        mesh.elements.push(Element { form, nodes, groups });
        Ok(())
    }

    fn elements_2(&mut self, mesh: &mut Mesh) -> Result<(), Fail> {
        let count = self.row::<u64>(1)?[0];
        for _ in 0..count {
            let row = self.row::<i64>(4)?;
            let tags = usize::try_from(row[2]).unwrap_or(usize::MAX).min(row.len() - 3);
            let group = row[3..3 + tags].first().copied().filter(|group| *group > 0);
            let nodes: Vec<u64> = row[3 + tags..].iter().map(|node| node.unsigned_abs()).collect();
            self.element(mesh, row[1].unsigned_abs(), &nodes, group.into_iter().collect())?;
        }
        Ok(())
    }

    fn elements_4(&mut self, mesh: &mut Mesh) -> Result<(), Fail> {
        let blocks = self.row::<u64>(4)?[0];
        for _ in 0..blocks {
            let head = self.row::<i64>(4)?;
            let key = (usize::try_from(head[0]).unwrap_or(usize::MAX), head[1]);
            let groups = self.physical.get(&key).cloned().unwrap_or_default();
            for _ in 0..head[3] {
                let row = self.row::<u64>(2)?;
                self.element(mesh, head[2].unsigned_abs(), &row[1..], groups.clone())?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Two triangles of the unit square, with a group for the area and one for the side x = 0.
    pub const OLD: &str = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n1 7 \"clamp ä\"\n2 9 \"plate\"\n\
        $EndPhysicalNames\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 1 1 0\n5 0 1 0\n$EndNodes\n$Elements\n3\n1 1 2 7 1 5 1\n\
        2 2 2 9 1 1 2 3\n3 2 2 9 1 1 3 5\n$EndElements\n";
    pub const NEW: &str = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n1 7 \"clamp ä\"\n2 9 \"plate\"\n\
        $EndPhysicalNames\n$Entities\n0 1 1 0\n4 0 0 0 0 1 0 1 7 2 1 -4\n1 0 0 0 1 1 0 1 9 1 4\n$EndEntities\n$Nodes\n\
        1 4 1 5\n2 1 0 4\n1\n2\n3\n5\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n$EndNodes\n$Elements\n2 3 1 3\n1 4 1 1\n1 5 1\n2 1 2 2\n\
        2 1 2 3\n3 1 3 5\n$EndElements\n";

    #[test]
    fn both_versions_give_the_same_mesh() {
        let old = read_msh(OLD.as_bytes()).unwrap();
        assert_eq!(old, read_msh(NEW.as_bytes()).unwrap());
        assert_eq!((old.nodes.len(), old.elements.len()), (4, 3));
        assert_eq!(old.names[&(1, 7)], "clamp ä");
        assert_eq!(old.elements[0], Element { form: Form::Line, nodes: vec![3, 0], groups: vec![7] });
    }

    #[test]
    fn mistakes_are_located() {
        let cases = [
            (OLD.replace("2.2 0", "3.0 0"), 2, "version 3.0"),
            (OLD.replace("2.2 0", "2.2 1"), 2, "binary"),
            (OLD.replace("5 0 1 0", "5 0 nan 0"), 14, "not finite"),
            (OLD.replace("5 0 1 0", "3 0 1 0"), 14, "twice"),
            (OLD.replace("5 0 1 0\n", ""), 14, "`$EndNodes` where 4"),
            (OLD.replace("$Nodes\n4", "$Nodes\n18446744073709551615"), 15, "`$EndNodes` where"),
            (OLD.replace("$Nodes\n4", "$Nodes\n3"), 14, "`5 0 1 0` where `$EndNodes`"),
            (OLD.replace("3 2 2 9 1 1 3 5", "3 2 2 9 1 1 3 6"), 20, "does not exist"),
            (OLD.replace("3 2 2 9 1 1 3 5", "3 9 2 9 1 1 3 5"), 20, "not of first order"),
            (OLD.replace("3 2 2 9 1 1 3 5", "3 2 2 9 1 1 3"), 20, "2 nodes, where this element has 3"),
            (OLD.replace("3 2 2 9 1 1 3 5", "3 2 -2 9 1 1 3"), 20, "nodes"),
            (OLD.replace("$EndElements\n", ""), 16, "has no `$EndElements`"),
            (NEW.replace("2 1 0 4", "2 1 0 999999999999"), 25, "where 1 or more"),
            (NEW.replace("\"plate\"", "plate"), 7, "not a physical name"),
            ("hello\n".into(), 1, "not a Gmsh file"),
            (String::new(), 1, "no mesh"),
            ("$Nodes\n".into(), 1, "begin with"),
        ];
        for (text, line, phrase) in cases {
            let error = read_msh(text.as_bytes()).unwrap_err();
            assert!(error.line == line && error.message.contains(phrase), "{text}\n{error}");
        }
        assert!(read_msh(b"$MeshFormat\n4.1 1 8\n\x01\x00\xff").unwrap_err().message.contains("binary"));
    }
}
