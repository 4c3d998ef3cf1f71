//! Reads the frames back that [`Frame`](super::Frame) wrote.
//!
//! Only this program's own form of the VTU format: vertices, arrays appended raw in zlib blocks behind 64-bit
//! headers. Every length is checked before anything of that size is made, so a damaged file is an error and no more.

use std::io::Read;
use std::path::{Path, PathBuf};

use flate2::read::ZlibDecoder;

use super::OutputError;

/// Where the appended arrays begin.
const APPENDED: &[u8] = b"<AppendedData encoding=\"raw\">";
/// Largest frame that is read, bytes.
const LARGEST: u64 = 1 << 34;
/// Most components of an array.
const MOST_COMPONENTS: usize = 9;

/// An array as the header declares it.
#[derive(Debug, Clone, PartialEq)]
struct Declaration {
    name: String,
    kind: String,
    components: usize,
    offset: usize,
}

/// A frame in memory, its arrays still compressed: they are unpacked when asked for.
#[derive(Debug, Clone)]
pub struct StoredFrame {
    path: PathBuf,
    bytes: Vec<u8>,
    /// First byte of the appended arrays.
    appended: usize,
    points: usize,
    time: f64,
    provenance: String,
    fields: Vec<Declaration>,
    positions: Declaration,
}

/// A field of a frame: `components` values per particle.
#[derive(Debug, Clone, PartialEq)]
pub struct StoredField {
    /// Components: 1, 3 for vectors, 9 for tensors (row by row).
    pub components: usize,
    /// Particle after particle.
    pub values: Vec<f64>,
}

impl StoredFrame {
    /// Reads a frame.
    ///
    /// # Errors
    /// [`OutputError::Unreadable`] if the file cannot be read, [`OutputError::Malformed`] if it is not a whole frame
    /// of this program.
    pub fn read(path: &Path) -> Result<Self, OutputError> {
        let bytes = crate::files::read(path, LARGEST).map_err(OutputError::unreadable("the frame", path))?;
        Self::parse(path, bytes)
    }

    /// Reads a frame from the bytes of a file; `path` stands in messages.
    ///
    /// # Errors
    /// [`OutputError::Malformed`] if they are not a whole frame of this program.
    pub fn parse(path: &Path, bytes: Vec<u8>) -> Result<Self, OutputError> {
        let malformed = |reason: &str| OutputError::Malformed { path: path.to_path_buf(), reason: reason.to_owned() };
        let start = find(&bytes, APPENDED).ok_or_else(|| malformed("it has no appended arrays"))?;
        let underscore = find(&bytes[start..], b"_").ok_or_else(|| malformed("its appended arrays are missing"))?;
        let header = std::str::from_utf8(&bytes[..start]).map_err(|_| malformed("its header is not text"))?;
        if attribute(header, "compressor") != Some("vtkZLibDataCompressor")
            || attribute(header, "header_type") != Some("UInt64")
            || attribute(header, "byte_order") != Some("LittleEndian")
        {
            return Err(malformed("it is in another form of the format than this program writes"));
        }
        let points = attribute(header, "NumberOfPoints")
            .and_then(|text| text.parse().ok())
            .ok_or_else(|| malformed("it does not tell its number of points"))?;
        let time = element(header, "TimeValue").and_then(|text| text.trim().parse().ok());
        let time = time.filter(|time: &f64| time.is_finite()).ok_or_else(|| malformed("it does not tell its time"))?;
        let codes = element(header, "provenance").unwrap_or_default();
        let codes: Vec<u8> = codes.split_whitespace().filter_map(|code| code.parse().ok()).collect();
        let provenance = String::from_utf8_lossy(codes.strip_suffix(&[0]).unwrap_or(&codes)).into_owned();
        let arrays = |name: &str| {
            let part =
                header.split(&format!("<{name}")).nth(1).and_then(|rest| rest.split(&format!("</{name}>")).next());
            part.map(|part| part.split("<DataArray").skip(1).filter_map(declaration).collect::<Vec<_>>())
        };
        let fields = arrays("PointData").ok_or_else(|| malformed("it has no fields"))?;
        let positions = arrays("Points").and_then(|mut found| found.pop()).filter(|points| points.components == 3);
        let positions = positions.ok_or_else(|| malformed("it has no positions"))?;
        let appended = start + underscore + 1;
        Ok(Self { path: path.to_path_buf(), bytes, appended, points, time, provenance, fields, positions })
    }

    /// Time in s.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Number of particles.
    pub fn points(&self) -> usize {
        self.points
    }

    /// Where the data come from, as it was given to [`Frame`](super::Frame).
    pub fn provenance(&self) -> &str {
        &self.provenance
    }

    /// Where it was read from.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Names and components of the fields, in the order of the file.
    pub fn fields(&self) -> impl Iterator<Item = (&str, usize)> {
        self.fields.iter().map(|field| (&*field.name, field.components))
    }

    /// Positions in m: three components per particle.
    ///
    /// # Errors
    /// [`OutputError::Malformed`] if they are damaged.
    pub fn positions(&self) -> Result<Vec<f64>, OutputError> {
        self.unpack(&self.positions)
    }

    /// A field by its name; `None` if the frame has no such field.
    ///
    /// # Errors
    /// [`OutputError::Malformed`] if it is damaged.
    pub fn field(&self, name: &str) -> Result<Option<StoredField>, OutputError> {
        let Some(declared) = self.fields.iter().find(|field| field.name == name) else { return Ok(None) };
        Ok(Some(StoredField { components: declared.components, values: self.unpack(declared)? }))
    }

    fn unpack(&self, array: &Declaration) -> Result<Vec<f64>, OutputError> {
        let malformed = |reason: &str| OutputError::Malformed {
            path: self.path.clone(),
            reason: format!("the array `{}` {reason}", array.name),
        };
        let size = match array.kind.as_str() {
            "Float32" => 4,
            "Float64" => 8,
            _ => return Err(malformed("holds no floating-point numbers")),
        };
        let expected = self.points.checked_mul(array.components * size).ok_or_else(|| malformed("is too long"))?;
        let raw = self.inflate(array.offset, expected).ok_or_else(|| malformed("is not whole"))?;
        let word = |bytes: &[u8]| match bytes.try_into() {
            Ok(bytes) => f64::from_le_bytes(bytes),
            Err(_) => bytes.try_into().map_or(f64::NAN, |bytes| f64::from(f32::from_le_bytes(bytes))),
        };
        Ok(raw.chunks_exact(size).map(word).collect())
    }

    /// The uncompressed bytes of the array at `offset`; `None` unless there are `expected` of them.
    fn inflate(&self, offset: usize, expected: usize) -> Option<Vec<u8>> {
        let array = self.bytes.get(self.appended.checked_add(offset)?..)?;
        let word = |index: usize| -> Option<usize> {
            let bytes = array.get(index.checked_mul(8)?..index.checked_mul(8)?.checked_add(8)?)?;
            usize::try_from(u64::from_le_bytes(bytes.try_into().ok()?)).ok()
        };
        let (blocks, full, last) = (word(0)?, word(1)?, word(2)?);
        let mut at = blocks.checked_add(3)?.checked_mul(8)?;
        if at > array.len() {
            return None;
        }
        let mut raw = Vec::new();
        for block in 0..blocks {
            let packed = array.get(at..at.checked_add(word(3 + block)?)?)?;
            let size = if block + 1 == blocks && last > 0 { last } else { full };
            // A zlib stream shrinks its content a thousandfold at most: more is a damaged header.
            if size > packed.len().saturating_mul(1100) || raw.len().checked_add(size)? > expected {
                return None;
            }
            let before = raw.len();
            ZlibDecoder::new(packed).take(size as u64 + 1).read_to_end(&mut raw).ok()?;
            if raw.len() - before != size {
                return None;
            }
            at += packed.len();
        }
        (raw.len() == expected).then_some(raw)
    }
}

fn find(bytes: &[u8], wanted: &[u8]) -> Option<usize> {
    bytes.windows(wanted.len()).position(|window| window == wanted)
}

/// The value of the first attribute of that name.
fn attribute<'a>(xml: &'a str, name: &str) -> Option<&'a str> {
    let marker = format!(" {name}=\"");
    let from = xml.find(&marker)? + marker.len();
    xml[from..].split('"').next()
}

/// The text of the element that declares this name.
fn element<'a>(xml: &'a str, name: &str) -> Option<&'a str> {
    let rest = &xml[xml.find(&format!("Name=\"{name}\""))?..];
    rest[rest.find('>')? + 1..].split('<').next()
}

/// What follows `<DataArray` as a declaration.
fn declaration(xml: &str) -> Option<Declaration> {
    let number = |name: &str| attribute(xml, name)?.parse::<usize>().ok();
    Some(Declaration {
        name: unescaped(attribute(xml, "Name")?),
        kind: attribute(xml, "type")?.to_owned(),
        components: number("NumberOfComponents").filter(|count| (1..=MOST_COMPONENTS).contains(count))?,
        offset: number("offset")?,
    })
}

/// Undoes `xml_attribute`.
pub(super) fn unescaped(text: &str) -> String {
    text.replace("&lt;", "<").replace("&gt;", ">").replace("&quot;", "\"").replace("&amp;", "&")
}

#[cfg(test)]
mod tests {
    use std::borrow::Cow;
    use std::fs;

    use super::super::{Frame, OutOfPlane, Precision, Tensor};
    use super::*;

    fn written(precision: Precision, points: usize) -> Vec<u8> {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("späce in name.vtu");
        let positions: Vec<f64> = (0..2 * points).map(|i| f64::from(i as u32) * 0.1).collect();
        let field: Vec<f64> = (0..points).map(|i| (f64::from(i as u32)).sin()).collect();
        Frame {
            time: 2.5e-7,
            dim: 2,
            positions: &positions,
            scalars: vec![("a < \"b\" & c", Cow::Borrowed(&field))],
            vectors: vec![("velocity", Cow::Borrowed(&positions))],
            tensors: vec![Tensor {
                name: "f",
                values: Cow::Owned(vec![2.0; 4 * points]),
                out_of_plane: OutOfPlane::Identity,
            }],
            provenance: "{\"scene\": \"tïtle\"}",
        }
        .write(&path, precision)
        .unwrap();
        fs::read(path).unwrap()
    }

    #[test]
    fn every_bit_comes_back() {
        // Several blocks of 2²⁰ bytes.
        let points = 150_000;
        let frame = StoredFrame::parse(Path::new("f"), written(Precision::Double, points)).unwrap();
        assert_eq!((frame.time(), frame.points(), frame.provenance()), (2.5e-7, points, "{\"scene\": \"tïtle\"}"));
        assert_eq!(frame.fields().collect::<Vec<_>>(), [("a < \"b\" & c", 1), ("velocity", 3), ("f", 9)]);
        let positions = frame.positions().unwrap();
        let wrong = (0..points).find(|&i| {
            let expected = [f64::from(2 * i as u32) * 0.1, f64::from(2 * i as u32 + 1) * 0.1, 0.0];
            positions[3 * i..3 * i + 3] != expected
        });
        assert_eq!(wrong, None);
        let field = frame.field("a < \"b\" & c").unwrap().unwrap();
        assert_eq!((field.components, field.values[149_999]), (1, 149_999f64.sin()));
        assert_eq!(frame.field("f").unwrap().unwrap().values[..9], [2., 2., 0., 2., 2., 0., 0., 0., 1.]);
        assert_eq!(frame.field("absent").unwrap(), None);
        let single = StoredFrame::parse(Path::new("f"), written(Precision::Single, 3)).unwrap();
        assert_eq!(single.field("a < \"b\" & c").unwrap().unwrap().values[1], f64::from(1f64.sin() as f32));
        let none = StoredFrame::parse(Path::new("f"), written(Precision::Double, 0)).unwrap();
        assert!(none.positions().unwrap().is_empty());
    }

    /// A frame that is cut off anywhere, or has any byte changed, is an error or reads as something: no panic.
    #[test]
    fn damage_is_an_error_and_never_a_panic() {
        let whole = written(Precision::Double, 40);
        let read = |bytes: Vec<u8>| {
            StoredFrame::parse(Path::new("f"), bytes).and_then(|frame| {
                for (name, _) in frame.fields() {
                    frame.field(name)?;
                }
                frame.positions()
            })
        };
        let (mut refused, header) = (0, find(&whole, APPENDED).unwrap());
        for length in 0..whole.len() - 200 {
            refused += usize::from(read(whole[..length].to_vec()).is_err());
        }
        assert!(refused >= header, "{refused} of {}", whole.len());
        for at in 0..whole.len() {
            for value in [0, 0xff, b'9', b'"'] {
                let mut damaged = whole.clone();
                damaged[at] = value;
                let _ = read(damaged);
            }
        }
        let error = read(b"<?xml version=\"1.0\"?>".to_vec()).unwrap_err().to_string();
        assert!(error.contains("no appended arrays") && error.contains("run the case again"), "{error}");
    }
}
