//! Reads the tables back that [`Table`](super::Table) wrote, also while the run still adds to them.

use std::path::{Path, PathBuf};

use super::OutputError;
use super::quantity::remedy;

/// Largest table that is read, bytes.
const LARGEST: u64 = 1 << 32;

/// Columns of numbers with names.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct StoredTable {
    path: PathBuf,
    names: Vec<String>,
    columns: Vec<Vec<f64>>,
}

impl StoredTable {
    /// Reads a table. A last row that is not whole is left out: its run is still going on, or was killed.
    ///
    /// # Errors
    /// [`OutputError::Unreadable`] if there is none, [`OutputError::Malformed`] if it is not a table of numbers.
    pub fn read(path: &Path) -> Result<Self, OutputError> {
        Self::parse(path, &crate::files::read(path, LARGEST).map_err(OutputError::unreadable("the table", path))?)
    }

    /// Reads a table from the bytes of a file; `path` stands in messages.
    ///
    /// # Errors
    /// [`OutputError::Malformed`] if it is not a table of numbers.
    pub fn parse(path: &Path, text: &[u8]) -> Result<Self, OutputError> {
        let malformed = |reason: String| OutputError::Malformed { path: path.to_path_buf(), reason };
        let mut reader = csv::ReaderBuilder::new().flexible(true).from_reader(text);
        let names: Vec<String> = match reader.headers() {
            Ok(names) => names.iter().map(str::to_owned).collect(),
            Err(error) => return Err(malformed(error.to_string())),
        };
        let mut columns = vec![Vec::new(); names.len()];
        let mut broken = None;
        for (row, record) in reader.records().enumerate() {
            if let Some(row) = broken {
                return Err(malformed(format!("row {row} is not {} numbers", names.len())));
            }
            let record = record.map_err(|error| malformed(error.to_string()))?;
            let numbers: Option<Vec<f64>> = record.iter().map(|field| field.parse().ok()).collect();
            match numbers.filter(|numbers| numbers.len() == names.len()) {
                Some(numbers) => columns.iter_mut().zip(numbers).for_each(|(column, number)| column.push(number)),
                None => broken = Some(row + 1),
            }
        }
        Ok(Self { path: path.to_path_buf(), names, columns })
    }

    /// Names of the columns.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, Vec::len)
    }

    /// A column; `None` if there is none of that name.
    pub fn get(&self, name: &str) -> Option<&[f64]> {
        self.names.iter().position(|known| known == name).map(|at| &self.columns[at][..])
    }

    /// A column that somebody asked for.
    ///
    /// # Errors
    /// [`OutputError::Request`] if there is none of that name.
    pub fn column(&self, name: &str) -> Result<&[f64], OutputError> {
        self.get(name).ok_or_else(|| {
            let known: Vec<&str> = self.names.iter().skip(1).map(String::as_str).collect();
            OutputError::request(
                format!("there is no column `{name}` in {}", self.path.display()),
                remedy(name, &known),
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_torn_last_row_is_left_out_and_other_damage_is_told() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("history.csv");
        let read = |text: &str| {
            std::fs::write(&path, text).unwrap();
            StoredTable::read(&path)
        };
        let table = read("t,\"a, b\",c\n0,1,2\n1,NaN,-inf\n2,3").unwrap();
        assert_eq!(
            (table.rows(), table.get("a, b").unwrap()[0], table.get("c").unwrap()[1]),
            (2, 1.0, f64::NEG_INFINITY)
        );
        assert_eq!(read("t,kinetic\n0,1\n1,2e").unwrap().rows(), 1);
        assert!(read("t,c\n0,1\nx,2\n3,4\n").unwrap_err().to_string().contains("row 2 is not 2 numbers"));
        assert_eq!(read("").unwrap().rows(), 0);
        let error = read("t,kinetic\n").unwrap().column("kinetik").unwrap_err().to_string();
        assert!(error.contains("did you mean `kinetic`"), "{error}");
        assert!(StoredTable::read(&directory.path().join("absent.csv")).unwrap_err().is_input());
    }
}
