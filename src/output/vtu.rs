//! One frame of point data as a VTU file (VTK XML unstructured grid) for ParaView, VisIt and PyVista.
//!
//! Every particle is a vertex cell. Arrays are appended raw in zlib blocks with 64-bit headers: every
//! ParaView in use reads that, and it is a third smaller than uncompressed. `FieldData` holds the time
//! and the provenance, so a file that was copied away from its run still tells where it came from.
//! The same frame always gives the same bytes.
//!
//! Rejected: the legacy format (no compression), HDF5 (a C library, and older ParaViews refuse it),
//! base64 (a third larger for nothing).

use std::borrow::Cow;
use std::fmt::Write as _;
use std::io;
use std::path::Path;

use super::appended::Appended;
use super::text::{number, xml_attribute};
use super::{OutputError, write_atomically};

const ACTION: &str = "write the frame";

/// Storage of the fields; points are always in double precision.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Precision {
    /// `Float32`: seven digits, half the size; enough to look at. Values beyond 3.4e38 become infinite.
    #[default]
    Single,
    /// `Float64`: every bit.
    Double,
}

/// How a tensor that is known in the plane (or on the line) continues in the directions out of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OutOfPlane {
    /// Ones on the diagonal: a deformation gradient of plane strain.
    Identity,
    /// Zeros: a strain of plane strain, a stress of plane stress.
    Zero,
    /// Nothing is added: the values are already 3×3 per point (a stress with its out-of-plane part).
    Given,
}

/// A tensor at every point.
#[derive(Debug, Clone)]
pub struct Tensor<'a> {
    /// Name under which viewers list it.
    pub name: &'a str,
    /// Entries row by row: `dim`×`dim` per point, or 3×3 for [`OutOfPlane::Given`].
    pub values: Cow<'a, [f64]>,
    /// What stands in the rows and columns beyond `dim`.
    pub out_of_plane: OutOfPlane,
}

/// The state of all particles at one instant, borrowed from whoever computed it.
///
/// Values that are not finite are written as they are, so that the last frame of a failed run can be
/// looked at; only the time must be finite.
#[derive(Debug, Clone)]
pub struct Frame<'a> {
    /// Time in s.
    pub time: f64,
    /// Number of space dimensions: 1, 2 or 3.
    pub dim: usize,
    /// Positions in m: `dim` components per point, point after point.
    pub positions: &'a [f64],
    /// Name and one value per point.
    pub scalars: Vec<(&'a str, Cow<'a, [f64]>)>,
    /// Name and `dim` components per point; written as three, with zeros beyond `dim`.
    pub vectors: Vec<(&'a str, Cow<'a, [f64]>)>,
    /// Second-order tensors; written as nine components, row by row.
    pub tensors: Vec<Tensor<'a>>,
    /// Where the data come from (JSON, say); readable in ParaView as the field data `provenance`.
    pub provenance: &'a str,
}

impl Frame<'_> {
    /// Number of points.
    pub fn points(&self) -> usize {
        self.positions.len() / self.dim.max(1)
    }

    /// Writes the frame to `path` as a whole or not at all.
    ///
    /// # Errors
    /// [`OutputError::Unsuitable`] for a dimension that is not 1, 2 or 3, a time that is not finite, or
    /// an empty or repeated field name; [`OutputError::WrongLength`] for a field of the wrong length;
    /// [`OutputError::File`] if the disk refuses.
    pub fn write(&self, path: &Path, precision: Precision) -> Result<(), OutputError> {
        self.check(path)?;
        let mut appended = Appended::default();
        let header = self.header(precision, &mut appended).map_err(OutputError::file("compress", path))?;
        write_atomically(path, |file| {
            file.write_all(header.as_bytes())?;
            file.write_all(appended.bytes())?;
            file.write_all(b"\n  </AppendedData>\n</VTKFile>\n")
        })
    }

    fn check(&self, path: &Path) -> Result<(), OutputError> {
        let unsuitable = |reason: String, remedy: &'static str| OutputError::Unsuitable {
            action: ACTION,
            path: path.to_path_buf(),
            reason,
            remedy,
        };
        if !(1..=3).contains(&self.dim) {
            return Err(unsuitable(format!("points have {} dimensions", self.dim), "use 1, 2 or 3"));
        }
        if !self.time.is_finite() {
            return Err(unsuitable(format!("its time is {}", self.time), "write frames of accepted steps only"));
        }
        let points = self.points();
        let length = |name: &str, components: usize, found: usize| {
            OutputError::check_length(ACTION, path, name, components * points, found)
        };
        length("positions", self.dim, self.positions.len())?;
        let mut names: Vec<&str> = Vec::new();
        for (name, values) in &self.scalars {
            length(name, 1, values.len())?;
            names.push(name);
        }
        for (name, values) in &self.vectors {
            length(name, self.dim, values.len())?;
            names.push(name);
        }
        for tensor in &self.tensors {
            let rows = if tensor.out_of_plane == OutOfPlane::Given { 3 } else { self.dim };
            length(tensor.name, rows * rows, tensor.values.len())?;
            names.push(tensor.name);
        }
        names.sort_unstable();
        if names.first().is_some_and(|name| name.is_empty()) {
            return Err(unsuitable("a field has no name".to_owned(), "name every field"));
        }
        if let Some(pair) = names.windows(2).find(|pair| pair[0] == pair[1]) {
            return Err(unsuitable(format!("two fields are called `{}`", pair[0]), "give each field its own name"));
        }
        Ok(())
    }

    /// The XML up to the underscore; the arrays go to `appended` in the order in which they are declared.
    fn header(&self, precision: Precision, appended: &mut Appended) -> io::Result<String> {
        let points = self.points();
        let mut xml = String::from(
            "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n\
             <VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" \
             header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\">\n  <UnstructuredGrid>\n",
        );
        self.field_data(&mut xml);
        // Writing to a String cannot fail.
        let _ = writeln!(xml, "    <Piece NumberOfPoints=\"{points}\" NumberOfCells=\"{points}\">");
        self.point_data(precision, &mut xml, appended)?;

        xml.push_str("      <Points>\n");
        let positions = padded_vectors(self.positions, self.dim);
        declare(&mut xml, "Points", "Float64", 3, appended.push(&bytes(positions, Precision::Double))?);
        xml.push_str("      </Points>\n      <Cells>\n");
        let connectivity: Vec<u8> = (0..points as i64).flat_map(i64::to_le_bytes).collect();
        declare(&mut xml, "connectivity", "Int64", 1, appended.push(&connectivity)?);
        let offsets: Vec<u8> = (1..=points as i64).flat_map(i64::to_le_bytes).collect();
        declare(&mut xml, "offsets", "Int64", 1, appended.push(&offsets)?);
        // Cell type 1 is VTK_VERTEX.
        declare(&mut xml, "types", "UInt8", 1, appended.push(&vec![1; points])?);
        xml.push_str("      </Cells>\n    </Piece>\n  </UnstructuredGrid>\n  <AppendedData encoding=\"raw\">\n   _");
        Ok(xml)
    }

    fn field_data(&self, xml: &mut String) {
        let time = number(self.time);
        // VTK stores strings as character codes ended by 0; a 0 inside would cut the text in two.
        let codes: String = self.provenance.bytes().filter(|&code| code != 0).map(|code| format!("{code} ")).collect();
        let _ = write!(
            xml,
            "    <FieldData>\n      \
             <DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" format=\"ascii\">{time}</DataArray>\n      \
             <DataArray type=\"String\" Name=\"provenance\" NumberOfTuples=\"1\" format=\"ascii\">{codes}0</DataArray>\n    \
             </FieldData>\n"
        );
    }

    fn point_data(&self, precision: Precision, xml: &mut String, appended: &mut Appended) -> io::Result<()> {
        let kind = match precision {
            Precision::Single => "Float32",
            Precision::Double => "Float64",
        };
        // The first scalar and vector are what a viewer shows before the user chooses.
        xml.push_str("      <PointData");
        if let Some((name, _)) = self.scalars.first() {
            let _ = write!(xml, " Scalars=\"{}\"", xml_attribute(name));
        }
        if let Some((name, _)) = self.vectors.first() {
            let _ = write!(xml, " Vectors=\"{}\"", xml_attribute(name));
        }
        xml.push_str(">\n");
        for (name, values) in &self.scalars {
            declare(xml, name, kind, 1, appended.push(&bytes(values.iter().copied(), precision))?);
        }
        for (name, values) in &self.vectors {
            declare(xml, name, kind, 3, appended.push(&bytes(padded_vectors(values, self.dim), precision))?);
        }
        for tensor in &self.tensors {
            declare(xml, tensor.name, kind, 9, appended.push(&bytes(padded_tensors(tensor, self.dim), precision))?);
        }
        xml.push_str("      </PointData>\n");
        Ok(())
    }
}

/// The XML element that points to an appended array.
fn declare(xml: &mut String, name: &str, kind: &str, components: usize, offset: usize) {
    let name = xml_attribute(name);
    let _ = writeln!(
        xml,
        "        <DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"appended\" offset=\"{offset}\"/>"
    );
}

/// Little-endian bytes in the given precision.
fn bytes(values: impl Iterator<Item = f64>, precision: Precision) -> Vec<u8> {
    match precision {
        Precision::Single => values.flat_map(|value| (value as f32).to_le_bytes()).collect(),
        Precision::Double => values.flat_map(f64::to_le_bytes).collect(),
    }
}

/// Three components per point from `dim`.
fn padded_vectors(values: &[f64], dim: usize) -> impl Iterator<Item = f64> + '_ {
    values.chunks_exact(dim).flat_map(move |vector| (0..3).map(move |i| vector.get(i).copied().unwrap_or(0.0)))
}

/// Nine entries per point, row by row.
fn padded_tensors<'a>(tensor: &'a Tensor<'_>, dim: usize) -> impl Iterator<Item = f64> + 'a {
    let rows = if tensor.out_of_plane == OutOfPlane::Given { 3 } else { dim };
    let beyond = if tensor.out_of_plane == OutOfPlane::Identity { 1.0 } else { 0.0 };
    tensor.values.chunks_exact(rows * rows).flat_map(move |entries| {
        (0..9).map(move |entry| match (entry / 3, entry % 3) {
            (i, j) if i < rows && j < rows => entries[i * rows + j],
            (i, j) if i == j => beyond,
            _ => 0.0,
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame<'a>(dim: usize, positions: &'a [f64], field: &'a [f64]) -> Frame<'a> {
        Frame {
            time: 0.5,
            dim,
            positions,
            scalars: vec![("field", Cow::Borrowed(field))],
            vectors: Vec::new(),
            tensors: Vec::new(),
            provenance: "{}",
        }
    }

    #[test]
    fn tensors_are_continued_as_told() {
        let padded = |dim, values: &[f64], out_of_plane| -> Vec<f64> {
            padded_tensors(&Tensor { name: "t", values: Cow::Borrowed(values), out_of_plane }, dim).collect()
        };
        assert_eq!(padded(2, &[2.0, 3.0, 4.0, 5.0], OutOfPlane::Identity), [2., 3., 0., 4., 5., 0., 0., 0., 1.]);
        assert_eq!(padded(1, &[2.0], OutOfPlane::Identity), [2., 0., 0., 0., 1., 0., 0., 0., 1.]);
        assert_eq!(padded(1, &[2.0], OutOfPlane::Zero), [2., 0., 0., 0., 0., 0., 0., 0., 0.]);
        let full: Vec<f64> = (0..9).map(f64::from).collect();
        assert_eq!(padded(2, &full, OutOfPlane::Given), full);
        assert_eq!(padded(3, &full, OutOfPlane::Zero), full);
    }

    #[test]
    fn unsuitable_frames_are_refused_with_the_reason() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("frame.vtu");
        let refusal = |frame: &Frame| frame.write(&path, Precision::Single).unwrap_err().to_string();
        assert!(refusal(&frame(0, &[], &[])).contains("0 dimensions"));
        assert!(refusal(&frame(4, &[], &[])).contains("4 dimensions"));
        assert!(refusal(&frame(2, &[0.0; 5], &[0.0; 2])).contains("positions"));
        assert!(refusal(&frame(2, &[0.0; 4], &[0.0; 3])).contains("`field` has 3 values where 2"));
        assert!(refusal(&Frame { time: f64::NAN, ..frame(1, &[0.0], &[0.0]) }).contains("time is NaN"));
        let mut twice = frame(1, &[0.0], &[0.0]);
        twice.vectors.push(("field", Cow::Borrowed(&[0.0])));
        assert!(refusal(&twice).contains("two fields are called `field`"));
        twice.vectors[0].0 = "";
        assert!(refusal(&twice).contains("no name"));
        assert!(!path.exists());
    }
}
