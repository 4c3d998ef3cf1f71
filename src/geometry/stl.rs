//! Triangles from STL files, ASCII or binary.
//!
//! A file is binary if its length is the one that the count at byte 80 asks for, whatever its first word says (many
//! programs begin binary files with `solid`). Normals in the file are not read: the order of the corners says more.

use super::points::PointError;
use super::surface::Triangle;

/// Bytes before the triangles, and of each triangle, of a binary file.
const HEADER: usize = 84;
const RECORD: usize = 50;
/// Most mistakes reported about one file.
const MOST_ERRORS: usize = 10;

/// Reads the triangles of a file. Allocates no more than a small multiple of its size.
///
/// # Errors
/// The first mistakes; those of a binary file have line 0 and name the triangle.
pub fn read_stl(bytes: &[u8]) -> Result<Vec<Triangle>, Vec<PointError>> {
    let count = bytes.get(80..HEADER).and_then(|count| count.try_into().ok()).map(u32::from_le_bytes);
    let expected = count.and_then(|count| (count as usize).checked_mul(RECORD)?.checked_add(HEADER));
    let triangles = match expected {
        Some(expected) if expected == bytes.len() => binary(&bytes[HEADER..])?,
        _ if is_ascii(bytes) => ascii(&String::from_utf8_lossy(bytes))?,
        Some(expected) => {
            let count = count.unwrap_or_default();
            let message = format!("the file holds {} bytes, where its {count} triangles take {expected}", bytes.len());
            return Err(vec![error(0, message, "it is cut short or damaged: export it again")]);
        }
        None => return Err(vec![error(0, "the file is too short for an STL".into(), "export it again")]),
    };
    if triangles.is_empty() {
        return Err(vec![error(0, "the file holds no triangles".into(), "export a solid, not an empty selection")]);
    }
    Ok(triangles)
}

/// Text begins with `solid`, and its first kilobyte has no byte that text has not.
fn is_ascii(bytes: &[u8]) -> bool {
    let start = bytes.iter().position(|byte| !byte.is_ascii_whitespace()).unwrap_or(0);
    let is_named = bytes[start..].get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    is_named && !bytes.iter().take(1024).any(|byte| *byte < 9)
}

fn binary(records: &[u8]) -> Result<Vec<Triangle>, Vec<PointError>> {
    let mut errors = Vec::new();
    let mut triangles = Vec::with_capacity(records.len() / RECORD);
    for (index, record) in records.chunks_exact(RECORD).enumerate() {
        let number = |at: usize| {
            let bytes = record.get(at..at + 4).and_then(|bytes| bytes.try_into().ok()).unwrap_or_default();
            f64::from(f32::from_le_bytes(bytes))
        };
        let triangle: Triangle =
            std::array::from_fn(|corner| std::array::from_fn(|axis| number(12 + 12 * corner + 4 * axis)).into());
        if !triangle.iter().all(|corner| corner.iter().all(|x| x.is_finite())) {
            let message = format!("triangle {} has a corner that is not finite", index + 1);
            errors.push(error(0, message, "repair the surface, or export it again"));
            if errors.len() >= MOST_ERRORS {
                break;
            }
        }
        triangles.push(triangle);
    }
    if errors.is_empty() { Ok(triangles) } else { Err(errors) }
}

fn ascii(text: &str) -> Result<Vec<Triangle>, Vec<PointError>> {
    let (mut triangles, mut errors) = (Vec::new(), Vec::new());
    let mut corners = Vec::with_capacity(3);
    let mut is_closed = true;
    let mut last = 0;
    for (index, line) in text.lines().enumerate() {
        last = index + 1;
        let mut words = line.split_whitespace();
        let word = words.next().unwrap_or_default().to_ascii_lowercase();
        match word.as_str() {
            "" => {}
            "solid" | "facet" | "outer" | "endloop" => is_closed = false,
            "endsolid" => is_closed = true,
            "endfacet" => {
                match <[_; 3]>::try_from(corners.as_slice()) {
                    Ok(triangle) => triangles.push(triangle),
                    Err(_) => {
                        let message = format!("a facet with {} corners", corners.len());
                        errors.push(error(last, message, "give every facet three lines that begin with `vertex`"));
                    }
                }
                corners.clear();
            }
            "vertex" => {
                let numbers: Option<Vec<f64>> = words.map(|word| word.parse().ok()).collect();
                match numbers.filter(|numbers| numbers.len() == 3 && numbers.iter().all(|number| number.is_finite())) {
                    Some(numbers) if corners.len() < 4 => {
                        corners.push(std::array::from_fn(|axis| numbers[axis]).into());
                    }
                    Some(_) => {}
                    None => {
                        corners.push([0.0; 3].into());
                        errors.push(error(last, "not a vertex".into(), "write `vertex x y z` with finite numbers"));
                    }
                }
            }
            _ => errors.push(error(last, format!("`{word}` does not belong into an STL file"), "export it again")),
        }
        if errors.len() >= MOST_ERRORS {
            break;
        }
    }
    if errors.is_empty() && !is_closed {
        errors.push(error(last.max(1), "the file ends before `endsolid`".into(), "it is cut short: export it again"));
    }
    if errors.is_empty() { Ok(triangles) } else { Err(errors) }
}

fn error(line: usize, message: String, remedy: &str) -> PointError {
    PointError { line, column: 1, length: 1, message, remedy: remedy.to_owned() }
}

/// A binary STL of triangles; normals are left zero, as readers recompute them.
pub fn write_stl(triangles: &[Triangle]) -> Vec<u8> {
    let mut bytes = vec![b' '; 80];
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for triangle in triangles {
        bytes.extend([0; 12]);
        bytes.extend(triangle.iter().flatten().flat_map(|x| (*x as f32).to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    const FACET: &str = "solid a\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1 0 0\n   vertex 0 1e0 0\n  \
                         endloop\n endfacet\nendsolid a\n";

    #[test]
    fn both_forms_give_the_same_triangles() {
        let text = read_stl(FACET.as_bytes()).unwrap();
        assert_eq!((text.len(), text[0][2][1]), (1, 1.0));
        let mut binary = write_stl(&text);
        assert_eq!(read_stl(&binary).unwrap(), text);
        // A binary file that begins like text.
        binary[..5].copy_from_slice(b"solid");
        assert_eq!(read_stl(&binary).unwrap(), text);
    }

    #[test]
    fn mistakes_are_located_and_nothing_is_allocated_for_claims() {
        let phrases = |bytes: &[u8]| read_stl(bytes).unwrap_err()[0].to_string();
        let mut huge = write_stl(&read_stl(FACET.as_bytes()).unwrap());
        huge[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
        assert!(phrases(&huge).contains("4294967295 triangles"));
        assert!(phrases(&huge[..100]).contains("holds 100 bytes"));
        assert!(phrases(b"").contains("too short"));
        assert!(phrases(b"hello").contains("too short"));
        assert!(phrases(b"solid a\nendsolid a\n").contains("no triangles"));
        let mut nan = write_stl(&read_stl(FACET.as_bytes()).unwrap());
        nan[96..100].copy_from_slice(&f32::NAN.to_le_bytes());
        assert!(phrases(&nan).contains("triangle 1 has a corner that is not finite"));
        assert!(phrases(FACET.replace("1e0", "inf").as_bytes()).contains("line 6"));
        assert!(phrases(FACET.replace("   vertex 1 0 0\n", "").as_bytes()).contains("a facet with 2 corners"));
        assert!(phrases(FACET.replace("endsolid a\n", "").as_bytes()).contains("before `endsolid`"));
        assert!(phrases(FACET.replace("outer", "auter").as_bytes()).contains("line 3, column 1: `auter`"));
    }
}
