//! Tables that grow while the run goes on (`history.csv`, `probes.csv`).
//!
//! Unlike every other file these cannot wait for the end: a user plots them while the job runs, and
//! they are what is left of a job that was killed. So each row goes to the file under its final name
//! at once, by a *single* write call: there is never half a row for a reader to trip over.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use super::OutputError;
use super::text::number;

/// A CSV file with a header line and one line of numbers per row.
///
/// Numbers are the shortest text that reads back as the same `f64` (`pandas.read_csv(...,
/// float_precision="round_trip")` gets every bit). Values that are not finite are `NaN`, `inf`, `-inf`.
#[derive(Debug)]
pub struct Table {
    path: PathBuf,
    file: File,
    columns: usize,
    line: String,
}

impl Table {
    /// Creates (or empties) `path` and writes the header line. `columns` are the names with their unit,
    /// such as `"kinetic [J]"`; names with commas or quotes are quoted.
    ///
    /// # Errors
    /// [`OutputError::File`] if the file cannot be created or written.
    pub fn create(path: &Path, columns: &[&str]) -> Result<Self, OutputError> {
        let file = File::create(path).map_err(OutputError::file("create the table", path))?;
        let mut table = Self { path: path.to_path_buf(), file, columns: columns.len(), line: String::new() };
        table.line = columns.iter().map(|name| quoted(name)).collect::<Vec<_>>().join(",");
        table.write_line()?;
        Ok(table)
    }

    /// Opens a table that a run has left, to go on after its first `bytes` bytes: what is beyond them is to be
    /// [cut off](Self::cut). Nothing is changed yet.
    ///
    /// # Errors
    /// [`OutputError::Unreadable`] if there is no such file, [`OutputError::Request`] if it is shorter, has other columns,
    /// or no row ends there.
    pub fn reopen(path: &Path, columns: &[&str], bytes: u64) -> Result<Self, OutputError> {
        let mut head = columns.iter().map(|name| quoted(name)).collect::<Vec<_>>().join(",");
        head.push('\n');
        let open = || -> std::io::Result<(File, Option<&'static str>)> {
            let mut file = File::options().read(true).write(true).open(path)?;
            if file.metadata()?.len() < bytes || bytes < head.len() as u64 {
                return Ok((file, Some("it is shorter than it was")));
            }
            let mut start = vec![0; head.len()];
            file.read_exact(&mut start)?;
            let mut last = [0];
            file.seek(SeekFrom::Start(bytes - 1))?;
            file.read_exact(&mut last)?;
            let wrong = match () {
                () if start != head.as_bytes() => Some("it has other columns"),
                () if last != [b'\n'] => Some("no row ends where one did"),
                () => None,
            };
            Ok((file, wrong))
        };
        let (file, wrong) = open().map_err(OutputError::unreadable("the table", path))?;
        if let Some(wrong) = wrong {
            return Err(OutputError::request(
                format!("{} cannot be continued: {wrong} when the checkpoint was written", path.display()),
                "restart into another directory with --out: what is missing then begins at the checkpoint",
            ));
        }
        Ok(Self { path: path.to_path_buf(), file, columns: columns.len(), line: String::new() })
    }

    /// Cuts off what is beyond the first `bytes` bytes; rows then go on there.
    ///
    /// # Errors
    /// [`OutputError::File`] if the disk refuses.
    pub fn cut(&mut self, bytes: u64) -> Result<(), OutputError> {
        let cut = self.file.set_len(bytes).and_then(|()| self.file.seek(SeekFrom::Start(bytes)));
        cut.map(|_| ()).map_err(OutputError::file("cut", &self.path))
    }

    /// Forces all rows to the disk and returns the length of the file.
    ///
    /// # Errors
    /// [`OutputError::File`] if the disk refuses.
    pub fn settle(&mut self) -> Result<u64, OutputError> {
        let length = self.file.sync_data().and_then(|()| self.file.stream_position());
        length.map_err(OutputError::file("write", &self.path))
    }

    /// Appends one row; it is in the file when the call returns.
    ///
    /// # Errors
    /// [`OutputError::WrongLength`] unless there is one value per column (nothing is written then),
    /// [`OutputError::File`] if the disk refuses.
    pub fn row(&mut self, values: &[f64]) -> Result<(), OutputError> {
        OutputError::check_length("add a row to", &self.path, "row", self.columns, values.len())?;
        self.line.clear();
        for (column, &value) in values.iter().enumerate() {
            if column > 0 {
                self.line.push(',');
            }
            self.line.push_str(&number(value));
        }
        self.write_line()
    }

    /// Where the table is written.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Hands the line to the operating system in one piece. `File` has no buffer of its own, so
    /// `write_all` is one call unless the disk is full.
    fn write_line(&mut self) -> Result<(), OutputError> {
        self.line.push('\n');
        self.file.write_all(self.line.as_bytes()).map_err(OutputError::file("add a row to", &self.path))
    }
}

/// A name as a CSV field (RFC 4180).
fn quoted(name: &str) -> String {
    if name.contains([',', '"', '\n', '\r']) { format!("\"{}\"", name.replace('"', "\"\"")) } else { name.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_on_disk_at_once_and_keep_every_bit() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("history.csv");
        let mut table = Table::create(&path, &["t [s]", "odd, \"name\"", "x"]).unwrap();
        let rows = [[0.0, 1.0 / 3.0, -2.5e-9], [1e-5, f64::NAN, f64::INFINITY], [0.1 + 0.2, 1e300, 5e-324]];
        for (count, row) in rows.iter().enumerate() {
            table.row(row).unwrap();
            assert_eq!(std::fs::read_to_string(&path).unwrap().lines().count(), count + 2);
        }
        let mut reader = csv::Reader::from_path(&path).unwrap();
        assert_eq!(reader.headers().unwrap(), vec!["t [s]", "odd, \"name\"", "x"]);
        for (record, row) in reader.records().zip(rows) {
            for (text, value) in record.unwrap().iter().zip(row) {
                let read: f64 = text.parse().unwrap();
                assert!(
                    read.to_bits() == value.to_bits() || (read.is_nan() && value.is_nan()),
                    "{text} is not {value}"
                );
            }
        }
    }

    #[test]
    fn a_row_of_the_wrong_length_writes_nothing() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("probes.csv");
        let mut table = Table::create(&path, &["t", "x"]).unwrap();
        let error = table.row(&[1.0]).unwrap_err().to_string();
        assert!(error.contains("probes.csv") && error.contains("1 values where 2"), "{error}");
        assert_eq!(std::fs::read_to_string(table.path()).unwrap(), "t,x\n");
        assert!(Table::create(&directory.path().join("absent/t.csv"), &["t"]).is_err());
    }
}
