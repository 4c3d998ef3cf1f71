//! Points and volumes from VTU files: one piece, arrays as text or appended raw, compressed by zlib or not.
//!
//! Enough for the frames that this program writes, and for what ParaView writes with "raw" data. Sizes that a file claims
//! are compared with its length before anything is allocated.

use std::io::Read;
use std::ops::Range;

use super::points::PointError;

/// Names under which volumes are sought.
const VOLUMES: [&str; 2] = ["volume", "volumes"];
/// zlib makes nothing smaller than this part.
const SMALLEST: usize = 1100;

/// Points and volumes of a file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct VtuPoints {
    /// Places, m.
    pub points: Vec<[f64; 3]>,
    /// Volumes, if there is a point array `volume`, m^D.
    pub volumes: Option<Vec<f64>>,
}

fn fail(line: usize, message: impl Into<String>, remedy: &str) -> PointError {
    PointError { line, column: 1, length: 1, message: message.into(), remedy: remedy.to_owned() }
}

/// Reads the points of a file.
///
/// # Errors
/// The first mistake, with its line.
pub fn read_vtu(bytes: &[u8]) -> Result<VtuPoints, PointError> {
    let mark = b"<AppendedData";
    let at = bytes.windows(mark.len()).position(|window| window == mark).unwrap_or(bytes.len());
    let header = String::from_utf8_lossy(&bytes[..at]);
    let line_of = |place: usize| header.as_bytes().iter().take(place).filter(|byte| **byte == b'\n').count() + 1;
    let file = tag(&header, "VTKFile").ok_or_else(|| {
        fail(1, "this is not a VTU file", "give a .vtu of unstructured points, or a list of points as .csv")
    })?;
    if attribute(file, "type") != Some("UnstructuredGrid") {
        return Err(fail(1, "the file holds no unstructured grid", "save it as .vtu, or as a list of points in .csv"));
    }
    if attribute(file, "byte_order").is_some_and(|order| order != "LittleEndian") {
        return Err(fail(1, "the bytes are in reverse order", "save it with little-endian bytes"));
    }
    if header.matches("<Piece").count() > 1 {
        return Err(fail(1, "the file has more than one piece", "merge the pieces before saving it"));
    }
    let count = tag(&header, "Piece").and_then(|piece| attribute(piece, "NumberOfPoints")?.parse::<usize>().ok());
    let count = count.ok_or_else(|| fail(1, "the number of points is missing", "save the file again"))?;
    let mut appended: &[u8] = &[];
    if let Some(rest) = bytes.get(at..).filter(|rest| !rest.is_empty()) {
        let end = rest.iter().position(|byte| *byte == b'>').unwrap_or(rest.len());
        if !String::from_utf8_lossy(&rest[..end]).contains("raw") {
            return Err(fail(
                line_of(at),
                "the appended data are not raw",
                "save it with appended raw data, or as text",
            ));
        }
        let start = rest.iter().skip(end).position(|byte| *byte == b'_').map_or(rest.len(), |place| end + place + 1);
        appended = &rest[start..];
    }
    let source = Source {
        appended,
        wide: attribute(file, "header_type") == Some("UInt64"),
        compressor: attribute(file, "compressor").map(str::to_owned),
    };
    let mut found = VtuPoints::default();
    let mut places = None;
    let (places_at, fields_at) = (section(&header, "Points"), section(&header, "PointData"));
    for (start, array) in arrays(&header) {
        let is_points = places_at.contains(&start);
        let name = attribute(array, "Name").unwrap_or_default();
        let is_volume = fields_at.contains(&start) && VOLUMES.contains(&name);
        if !is_points && !is_volume {
            continue;
        }
        let components = if is_points { 3 } else { 1 };
        let body = header[start..].split_once('>').map_or("", |(_, body)| body.split('<').next().unwrap_or_default());
        let values = count
            .checked_mul(components)
            .ok_or_else(|| "more points than fit into memory".to_owned())
            .and_then(|length| source.values(array, body, length))
            .map_err(|why| fail(line_of(start), format!("array `{name}`: {why}"), "save the file again"))?;
        if is_points { places = Some(values) } else { found.volumes = Some(values) }
    }
    let places = places.ok_or_else(|| fail(1, "the file has no points", "save the file again"))?;
    found.points = places.as_chunks::<3>().0.to_vec();
    if found.points.is_empty() {
        return Err(fail(1, "the file holds no points", "save a grid that is not empty"));
    }
    Ok(found)
}

/// The inside of the first tag of that name.
fn tag<'a>(text: &'a str, name: &str) -> Option<&'a str> {
    let start = text.find(&format!("<{name}"))?;
    text[start..].split_once('>').map(|(tag, _)| tag)
}

/// Where the first element of that name begins and ends.
fn section(text: &str, name: &str) -> Range<usize> {
    let start = text.find(&format!("<{name}")).unwrap_or(text.len());
    let length = text[start..].find(&format!("</{name}")).unwrap_or(text.len() - start);
    start..start + length
}

/// All tags of arrays with their places.
fn arrays(text: &str) -> impl Iterator<Item = (usize, &str)> {
    text.match_indices("<DataArray").filter_map(|(at, _)| Some((at, text[at..].split_once('>')?.0)))
}

fn attribute<'a>(tag: &'a str, name: &str) -> Option<&'a str> {
    let (_, rest) = tag.split_once(&format!(" {name}=\""))?;
    rest.split_once('"').map(|(value, _)| value)
}

struct Source<'a> {
    appended: &'a [u8],
    wide: bool,
    compressor: Option<String>,
}

impl Source<'_> {
    fn values(&self, array: &str, body: &str, length: usize) -> Result<Vec<f64>, String> {
        let values: Vec<f64> = match attribute(array, "format") {
            Some("ascii") => {
                let words = body.split_whitespace().take(length.saturating_add(1));
                let values: Option<Vec<f64>> = words.map(|word| word.parse().ok()).collect();
                values.ok_or("not all of it are numbers")?
            }
            Some("appended") => {
                let offset = attribute(array, "offset").and_then(|offset| offset.parse::<usize>().ok());
                let single = match attribute(array, "type") {
                    Some("Float32") => true,
                    Some("Float64") => false,
                    other => return Err(format!("values of type {}", other.unwrap_or("?"))),
                };
                let size = length.checked_mul(if single { 4 } else { 8 }).ok_or("more than fits into memory")?;
                let data = offset.and_then(|offset| self.appended.get(offset..)).ok_or("it lies beyond the file")?;
                let bytes = self.bytes(data, size)?;
                if single {
                    bytes.as_chunks::<4>().0.iter().map(|four| f64::from(f32::from_le_bytes(*four))).collect()
                } else {
                    bytes.as_chunks::<8>().0.iter().map(|eight| f64::from_le_bytes(*eight)).collect()
                }
            }
            other => return Err(format!("stored as {}, not as text or appended", other.unwrap_or("?"))),
        };
        if values.len() != length {
            return Err(format!("{} numbers, where there should be {length}", values.len()));
        }
        Ok(values)
    }

    /// Raw bytes of an appended array.
    fn bytes(&self, data: &[u8], size: usize) -> Result<Vec<u8>, String> {
        let width = if self.wide { 8 } else { 4 };
        let word = |index: usize| -> Result<usize, String> {
            let bytes =
                index.checked_mul(width).and_then(|at| data.get(at..at.checked_add(width)?)).ok_or("cut short")?;
            Ok(bytes.iter().rev().fold(0_u64, |word, byte| word << 8 | u64::from(*byte)) as usize)
        };
        match self.compressor.as_deref() {
            None => {
                let found = word(0)?;
                let bytes = data.get(width..).and_then(|data| data.get(..found)).ok_or("cut short")?;
                Ok(bytes.get(..size.min(found)).unwrap_or_default().to_vec())
            }
            Some("vtkZLibDataCompressor") => {
                if size / SMALLEST > data.len() {
                    return Err(format!("{size} bytes are promised, but {} are there", data.len()));
                }
                let blocks = word(0)?;
                let mut at = blocks.checked_add(3).and_then(|words| words.checked_mul(width)).ok_or("cut short")?;
                let mut bytes = Vec::new();
                for block in 0..blocks {
                    let length = word(3 + block)?;
                    let end = at.checked_add(length).ok_or("cut short")?;
                    let compressed = data.get(at..end).ok_or("cut short")?;
                    let room = (size - bytes.len().min(size)) as u64 + 1;
                    flate2::read::ZlibDecoder::new(compressed)
                        .take(room)
                        .read_to_end(&mut bytes)
                        .map_err(|error| format!("it cannot be decompressed ({error})"))?;
                    at = end;
                }
                Ok(bytes)
            }
            Some(other) => Err(format!("compressed by {other}, not by zlib")),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::borrow::Cow;

    use super::*;
    use crate::output::{Frame, Precision};

    const TEXT: &str = "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" \
        byte_order=\"LittleEndian\">\n<UnstructuredGrid><Piece NumberOfPoints=\"2\" NumberOfCells=\"0\">\n<PointData>\n\
        <DataArray type=\"Float64\" Name=\"volume\" format=\"ascii\">0.5 0.25</DataArray>\n</PointData>\n<Points>\n\
        <DataArray type=\"Float64\" Name=\"Points\" NumberOfComponents=\"3\" format=\"ascii\">0 0 0 1e0 2 3</DataArray>\n\
        </Points></Piece></UnstructuredGrid></VTKFile>\n";

    #[test]
    fn text_and_our_own_frames_are_read() {
        let text = read_vtu(TEXT.as_bytes()).unwrap();
        assert_eq!(text, VtuPoints { points: vec![[0.0; 3], [1.0, 2.0, 3.0]], volumes: Some(vec![0.5, 0.25]) });
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.vtu");
        // More than one block.
        let positions: Vec<f64> = (0..200_000).map(|i| f64::from(i).sqrt()).collect();
        let volumes: Vec<f64> = (0..100_000).map(f64::from).collect();
        let frame = Frame {
            time: 0.0,
            dim: 2,
            positions: &positions,
            scalars: vec![("volume", Cow::Borrowed(&volumes))],
            vectors: Vec::new(),
            tensors: Vec::new(),
            provenance: "{\"a\": \"<Points>\"}",
        };
        frame.write(&path, Precision::Single).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let read = read_vtu(&bytes).unwrap();
        assert_eq!(read.points[77], [positions[154], positions[155], 0.0]);
        assert_eq!(read.volumes.unwrap(), volumes);
        // Cut anywhere, damaged anywhere: an error or other numbers, never a panic.
        for at in (0..bytes.len()).step_by(bytes.len() / 97) {
            let _ = read_vtu(&bytes[..at]);
            let mut damaged = bytes.clone();
            damaged[at] ^= 0x5a;
            let _ = read_vtu(&damaged);
        }
        assert!(read_vtu(&bytes[..bytes.len() / 2]).is_err());
    }

    #[test]
    fn mistakes_are_located() {
        let cases = [
            (TEXT.replace("\"2\" Number", "\"99999999999999999\" Number"), 5, "where there should be"),
            (TEXT.replace("1e0", "one"), 8, "not all of it are numbers"),
            (TEXT.replace("0.5 0.25", "0.5"), 5, "1 numbers, where there should be 2"),
            (TEXT.replace("format=\"ascii\"", "format=\"binary\""), 5, "stored as binary"),
            (TEXT.replace("<Points>", "<Cells>"), 1, "no points"),
            (TEXT.replace("Unstructured", "Structured"), 1, "no unstructured grid"),
            (TEXT.replace("Little", "Big"), 1, "reverse order"),
            ("hello".into(), 1, "not a VTU file"),
            (String::new(), 1, "not a VTU file"),
        ];
        for (text, line, phrase) in cases {
            let error = read_vtu(text.as_bytes()).unwrap_err();
            assert!(error.line == line && error.message.contains(phrase), "{text}\n{error}");
        }
    }
}
