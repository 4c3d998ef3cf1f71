//! Reading files that a user names: what may never end (devices, pipes) and what is larger than can be meant is refused
//! instead of read.

use std::fs::{self, File};
use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;

/// Longest line of a table of numbers, bytes.
const LONGEST_LINE: usize = 1 << 20;

/// Reads a file of at most so many bytes.
pub(crate) fn read(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let file = open(path, most)?;
    let mut bytes = Vec::new();
    file.take(most.saturating_add(1)).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most { Err(too_large(bytes.len() as u64, most)) } else { Ok(bytes) }
}

/// Reads a text of at most so many bytes.
pub(crate) fn read_text(path: &Path, most: u64) -> io::Result<String> {
    let text = String::from_utf8(read(path, most)?);
    text.map_err(|_| io::Error::new(io::ErrorKind::InvalidData, "it is not UTF-8 text"))
}

/// Reads a table of at most so many bytes, and stops at a line that is none of a table's.
pub(crate) fn read_lines(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let mut reader = BufReader::with_capacity(1 << 16, open(path, most)?.take(most));
    let (mut bytes, mut line, mut length) = (Vec::new(), 1_usize, 0);
    loop {
        let part = reader.fill_buf()?;
        if part.is_empty() {
            return Ok(bytes);
        }
        for piece in part.split_inclusive(|byte| *byte == b'\n') {
            length += piece.len();
            if length > LONGEST_LINE {
                return Err(io::Error::other(format!(
                    "line {line} is longer than {LONGEST_LINE} bytes: it is no table"
                )));
            }
            if piece.ends_with(b"\n") {
                (line, length) = (line + 1, 0);
            }
        }
        bytes.extend_from_slice(part);
        let taken = part.len();
        reader.consume(taken);
    }
}

fn open(path: &Path, most: u64) -> io::Result<File> {
    // Before it is opened: opening a pipe waits for its other end.
    let found = fs::metadata(path)?;
    if found.is_dir() {
        return Err(io::Error::new(io::ErrorKind::IsADirectory, "it is a directory"));
    }
    if !found.is_file() {
        return Err(io::Error::other("it is not a file, but a device or a pipe, which may never end"));
    }
    if found.len() > most {
        return Err(too_large(found.len(), most));
    }
    File::open(path)
}

fn too_large(found: u64, most: u64) -> io::Error {
    io::Error::new(io::ErrorKind::FileTooLarge, format!("it has {found} bytes, and {most} are the most"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_too_large_or_no_file_is_refused() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a b.csv");
        fs::write(&path, "1,2\n3,4\n").unwrap();
        assert_eq!(read(&path, 8).unwrap(), b"1,2\n3,4\n");
        assert_eq!(read_lines(&path, 8).unwrap(), b"1,2\n3,4\n");
        assert_eq!(read_text(&path, 9).unwrap(), "1,2\n3,4\n");
        assert!(read(&path, 7).unwrap_err().to_string().contains("it has 8 bytes"));
        assert!(read(directory.path(), 7).unwrap_err().to_string().contains("a directory"));
        assert_eq!(read(&directory.path().join("absent"), 7).unwrap_err().kind(), io::ErrorKind::NotFound);
        if cfg!(target_os = "linux") {
            assert!(read(Path::new("/dev/zero"), 7).unwrap_err().to_string().contains("device"));
        }
        // Files that tell no length, as those of /proc, are read as far as the limit, too.
        let mut long = b"1,2\n".to_vec();
        long.resize(LONGEST_LINE + 10, b'7');
        fs::write(&path, &long).unwrap();
        assert!(read_lines(&path, 1 << 30).unwrap_err().to_string().contains("line 2 is longer"));
        fs::write(&path, b"\xff").unwrap();
        assert!(read_text(&path, 9).unwrap_err().to_string().contains("UTF-8"));
    }
}
