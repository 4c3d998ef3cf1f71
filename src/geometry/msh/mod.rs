//! Meshes from Gmsh files: formats 2.2 and 4.1, as text or binary, elements of first order, physical groups with their
//! names (<https://gmsh.info/doc/texinfo/gmsh.html#Gmsh-file-formats>).
//!
//! What the file claims about numbers of nodes and elements is compared with what is there; nothing is allocated for it.

mod binary;
mod text;

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

/// What is wrong, and the remedy; the readers know the place.
type Wrong = (String, &'static str);

/// A mesh that is being read.
#[derive(Default)]
struct Builder {
    mesh: Mesh,
    /// Number of a node in the file to its index.
    numbers: HashMap<u64, usize>,
    /// Dimension and number of a part of the geometry to its physical groups.
    physical: HashMap<(usize, i64), Vec<i64>>,
}

impl Builder {
    fn node(&mut self, number: u64, place: Vector<3>) -> Result<(), Wrong> {
        if !place.iter().all(|x| x.is_finite()) {
            return Err(("a node that is not finite".to_owned(), "repair the mesh"));
        }
        if self.numbers.insert(number, self.mesh.nodes.len()).is_some() {
            return Err((format!("node {number} is there twice"), "export it from Gmsh again"));
        }
        self.mesh.nodes.push(place);
        Ok(())
    }

    fn form(number: u64) -> Result<Form, Wrong> {
        Form::of(number).ok_or_else(|| {
            (format!("elements of type {number} are not of first order"), "save the mesh with `Mesh.ElementOrder = 1`")
        })
    }

    /// Takes as many of the nodes as the form has.
    fn element(&mut self, form: Form, nodes: &[u64], groups: Vec<i64>) -> Result<(), Wrong> {
        let (_, count) = form.size();
        if nodes.len() < count {
            return Err((
                format!("{} nodes, where this element has {count}", nodes.len()),
                "export it from Gmsh again",
            ));
        }
        let indices: Option<Vec<usize>> =
            nodes[..count].iter().map(|number| self.numbers.get(number).copied()).collect();
        let Some(nodes) = indices else {
            return Err(("a node that does not exist".to_owned(), "export it from Gmsh again"));
        };
        self.mesh.elements.push(Element { form, nodes, groups });
        Ok(())
    }

    /// A line of `$PhysicalNames`.
    fn name(&mut self, line: &str) -> Result<(), Wrong> {
        let mut words = line.split_whitespace();
        let dimension = words.next().and_then(|word| word.parse().ok());
        let number = words.next().and_then(|word| word.parse().ok());
        let name = line.split_once('"').and_then(|(_, rest)| rest.rsplit_once('"')).map(|(name, _)| name);
        let (Some(dimension), Some(number), Some(name)) = (dimension, number, name) else {
            return Err(("not a physical name".to_owned(), "write `dimension number \"name\"`"));
        };
        self.mesh.names.insert((dimension, number), name.to_owned());
        Ok(())
    }

    /// The mesh, if there is one.
    fn finished(self) -> Result<Mesh, Wrong> {
        if self.mesh.nodes.is_empty() || self.mesh.elements.is_empty() {
            return Err(("the file holds no mesh".to_owned(), "generate the mesh before saving it"));
        }
        Ok(self.mesh)
    }
}

/// Reads a mesh.
///
/// # Errors
/// The first mistake, with its line in a text, or with its byte in the message where the file is binary.
pub fn read_msh(bytes: &[u8]) -> Result<Mesh, PointError> {
    if let Some(format) = binary::Format::of(bytes)? { binary::read(bytes, &format) } else { text::read(bytes) }
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
    }
}
