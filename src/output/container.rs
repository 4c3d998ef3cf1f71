//! Named arrays in one file, for checkpoints: the safetensors format.
//!
//! Eight bytes of length, a JSON header with type, shape and place of every array, and the arrays, little-endian: NumPy
//! reads it with its own means, and nothing in it can be executed. Written piece by piece, so that a large state is not
//! held twice, with the arrays in a fixed order, so that the same content gives the same bytes. Reading is left to the
//! crate of the format, which has seen more damaged files than we have; a checksum catches what it cannot.

use std::collections::HashMap;
use std::io;
use std::path::Path;

use nicolson_solvers::Snapshot;
use nicolson_solvers::snapshot::Array;
use safetensors::{Dtype, SafeTensors};
use serde_json::json;

use super::{OutputError, write_atomically};

/// What a file says it is.
const FORMAT: &str = "nicolson checkpoint";
/// Largest checkpoint that is read, bytes.
const LARGEST: u64 = 1 << 36;
/// Layout of the names and the header; later versions are refused.
const VERSION: u32 = 1;
/// Numbers converted at a time.
const PIECE: usize = 8192;

/// Writes `about` (JSON) and the arrays to `path` as a whole or not at all.
///
/// # Errors
/// [`OutputError::File`] if the disk refuses.
pub fn write_container(path: &Path, about: &str, arrays: &Snapshot) -> Result<(), OutputError> {
    let header = header(about, arrays);
    write_atomically(path, |file| {
        file.write_all(&(header.len() as u64).to_le_bytes())?;
        file.write_all(header.as_bytes())?;
        for (_, array) in in_order(arrays) {
            for_each_piece(array, |piece| file.write_all(piece))?;
        }
        Ok(())
    })
}

/// Numbers before texts, so that every number is aligned.
fn in_order(arrays: &Snapshot) -> impl Iterator<Item = (&str, &Array)> {
    let is_text = |array: &Array| matches!(array, Array::Text(_));
    let numbers = arrays.iter().filter(move |(_, array)| !is_text(array));
    numbers.chain(arrays.iter().filter(move |(_, array)| is_text(array)))
}

fn for_each_piece<E>(array: &Array, mut take: impl FnMut(&[u8]) -> Result<(), E>) -> Result<(), E> {
    let mut bytes = Vec::new();
    match array {
        Array::Reals(values) => {
            for piece in values.chunks(PIECE) {
                bytes.clear();
                piece.iter().for_each(|value| bytes.extend_from_slice(&value.to_le_bytes()));
                take(&bytes)?;
            }
        }
        Array::Integers(values) => {
            for piece in values.chunks(PIECE) {
                bytes.clear();
                piece.iter().for_each(|value| bytes.extend_from_slice(&value.to_le_bytes()));
                take(&bytes)?;
            }
        }
        Array::Text(text) => take(text.as_bytes())?,
    }
    Ok(())
}

/// Type and length of an array in entries and bytes.
fn measure(array: &Array) -> (&'static str, usize, usize) {
    match array {
        Array::Reals(values) => ("F64", values.len(), 8 * values.len()),
        Array::Integers(values) => ("U64", values.len(), 8 * values.len()),
        Array::Text(text) => ("U8", text.len(), text.len()),
    }
}

fn header(about: &str, arrays: &Snapshot) -> String {
    let meta = json!({
        "format": FORMAT,
        "version": VERSION.to_string(),
        "checksum": checksum(about, arrays),
        "about": about,
    });
    let mut text = format!("{{\"__metadata__\":{meta}");
    let mut end = 0;
    for (name, array) in in_order(arrays) {
        let (kind, length, bytes) = measure(array);
        let place = json!({ "dtype": kind, "shape": [length], "data_offsets": [end, end + bytes] });
        text += &format!(",{}:{place}", json!(name));
        end += bytes;
    }
    text.push('}');
    // The data begins on a multiple of eight.
    let padding = text.len().next_multiple_of(8) - text.len();
    text + &" ".repeat(padding)
}

/// A mark of everything in a file.
fn checksum(about: &str, arrays: &Snapshot) -> String {
    let mut hasher = blake3::Hasher::new();
    let mut part = |bytes: &[u8]| {
        hasher.update(bytes);
    };
    part(about.as_bytes());
    for (name, array) in in_order(arrays) {
        let (kind, length, _) = measure(array);
        part(format!("\n{name}\n{kind} {length}\n").as_bytes());
        let _ = for_each_piece(array, |piece| {
            part(piece);
            Ok::<(), io::Error>(())
        });
    }
    hasher.finalize().to_hex().to_string()
}

/// Reads a file back: what it says about itself, and its arrays.
///
/// # Errors
/// [`OutputError::Unreadable`] if there is none; [`OutputError::Request`] with what is wrong with it if it is not a file
/// of ours, one of a later version, or a damaged one.
pub fn read_container(path: &Path) -> Result<(String, Snapshot), OutputError> {
    let bytes = crate::files::read(path, LARGEST).map_err(OutputError::unreadable("the checkpoint", path))?;
    parse_container(path, &bytes, true)
}

/// Reads a file from its bytes; `path` stands in messages. With `verify` its checksum must fit, as it must wherever the
/// content is used; tests of what comes after go without.
///
/// # Errors
/// As [`read_container`].
pub fn parse_container(path: &Path, bytes: &[u8], verify: bool) -> Result<(String, Snapshot), OutputError> {
    let refuse = |what: &str, remedy: &str| OutputError::request(format!("{}: {what}", path.display()), remedy);
    let damaged = |what: &str| refuse(&format!("the checkpoint is damaged: {what}"), "use an older one");
    let foreign = |what: &str| {
        let remedy = "give a checkpoint (step-….safetensors) or the directory of a run";
        refuse(&format!("this is not a checkpoint: {what}"), remedy)
    };
    let (_, header) = SafeTensors::read_metadata(bytes).map_err(|error| {
        // Ours begin with the length of a header and its brace.
        if bytes.get(8) == Some(&b'{') { damaged(&error.to_string()) } else { foreign(&error.to_string()) }
    })?;
    let meta: &HashMap<String, String> = match header.metadata() {
        Some(meta) if meta.get("format").is_some_and(|format| format == FORMAT) => meta,
        _ => return Err(foreign("its header does not say so")),
    };
    let of = |key: &str| meta.get(key).map(String::as_str).unwrap_or_default();
    match of("version").parse::<u32>() {
        Ok(version) if (1..=VERSION).contains(&version) => {}
        Ok(version) => {
            let what = format!("the checkpoint has version {version}, and this program reads up to {VERSION}");
            return Err(refuse(&what, "use the program that wrote it, or a later one"));
        }
        Err(_) => return Err(damaged("it has no version")),
    }
    let tensors = SafeTensors::deserialize(bytes).map_err(|error| damaged(&error.to_string()))?;
    let mut arrays = Snapshot::new();
    for (name, view) in tensors.iter() {
        let words = || view.data().chunks_exact(8).map(|word| word.try_into().unwrap_or([0; 8]));
        let array = match view.dtype() {
            Dtype::F64 => Array::Reals(words().map(f64::from_le_bytes).collect()),
            Dtype::U64 => Array::Integers(words().map(u64::from_le_bytes).collect()),
            Dtype::U8 => match std::str::from_utf8(view.data()) {
                Ok(text) => Array::Text(text.to_owned()),
                Err(_) => return Err(damaged(&format!("`{name}` is not text"))),
            },
            other => return Err(damaged(&format!("`{name}` has the type {other:?}"))),
        };
        arrays.insert(name, array);
    }
    if verify && checksum(of("about"), &arrays) != of("checksum") {
        return Err(damaged("its checksum does not fit its content"));
    }
    Ok((of("about").to_owned(), arrays))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn some() -> Snapshot {
        let mut arrays = Snapshot::new();
        arrays.put_reals("state/values", vec![0.1, -0.0, f64::NAN, 5e-324]);
        arrays.put_integers("b \"quoted\" name", vec![u64::MAX]);
        arrays.put_reals("none", Vec::new());
        arrays.put_text("a text", "grüße");
        arrays
    }

    fn bits(arrays: &Snapshot) -> String {
        let bits = |values: &[f64]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
        arrays
            .iter()
            .map(|(name, array)| match array {
                Array::Reals(values) => format!("{name}: {:?}\n", bits(values)),
                other => format!("{name}: {other:?}\n"),
            })
            .collect()
    }

    #[test]
    fn every_bit_comes_back_and_the_bytes_are_always_the_same() {
        let directory = tempfile::tempdir().unwrap();
        let paths = ["one", "two"].map(|name| directory.path().join(name));
        paths.iter().for_each(|path| write_container(path, "{\"x\": 1}", &some()).unwrap());
        let (about, arrays) = read_container(&paths[0]).unwrap();
        assert_eq!((about.as_str(), bits(&arrays)), ("{\"x\": 1}", bits(&some())));
        let bytes = std::fs::read(&paths[0]).unwrap();
        assert_eq!(bytes, std::fs::read(&paths[1]).unwrap());
        let length = u64::from_le_bytes(bytes[..8].try_into().unwrap());
        assert_eq!(length % 8, 0);
    }

    #[test]
    fn damage_anywhere_is_noticed() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("file");
        write_container(&path, "about", &some()).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        for place in 0..bytes.len() {
            for bit in [1, 16] {
                let mut other = bytes.clone();
                other[place] ^= bit;
                std::fs::write(&path, &other).unwrap();
                // A blank of the padding may become another blank.
                let harmless = |found: &Snapshot| bits(found) == bits(&some());
                let outcome = read_container(&path);
                assert!(outcome.as_ref().map_or(true, |(about, found)| about == "about" && harmless(found)), "{place}");
            }
        }
        for length in 0..bytes.len() {
            std::fs::write(&path, &bytes[..length]).unwrap();
            assert!(read_container(&path).unwrap_err().is_input(), "{length} bytes");
        }
    }

    #[test]
    fn foreign_and_later_files_are_told_apart() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("file");
        let error = |bytes: &[u8]| {
            std::fs::write(&path, bytes).unwrap();
            read_container(&path).unwrap_err().to_string()
        };
        assert!(error(b"solid bracket\n  facet normal 0 0 1").contains("not a checkpoint"));
        assert!(error(b"").contains("not a checkpoint"));
        let other = b"{\"__metadata__\":{\"format\":\"pt\"}}";
        let file = [&(other.len() as u64).to_le_bytes()[..], other].concat();
        assert!(error(&file).contains("does not say so"));
        write_container(&path, "about", &some()).unwrap();
        let text = std::fs::read(&path).unwrap();
        let place = text.windows(13).position(|part| part == b"\"version\":\"1\"").unwrap();
        let mut later = text.clone();
        later[place + 11] = b'7';
        let message = error(&later);
        assert!(message.contains("version 7") && message.contains("later one"), "{message}");
    }
}
