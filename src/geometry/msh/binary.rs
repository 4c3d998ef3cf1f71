//! Gmsh files in binary: formats 2.2 and 4.1, of either order of bytes.
//!
//! Sections begin and end with lines of text; physical names, and the counts of format 2.2, are text too. The fourth
//! line holds the integer 1, from which the order of bytes is seen.

use super::{Builder, Mesh, PointError, Wrong};
use crate::tensor::Vector;

/// What the format line says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Format {
    is_new: bool,
    is_big_endian: bool,
    /// Byte after the integer 1.
    start: usize,
}

fn fail(message: impl Into<String>, remedy: &str) -> PointError {
    PointError { line: 0, column: 1, length: 1, message: message.into(), remedy: remedy.to_owned() }
}

impl Format {
    /// The format of a binary file; none if it is a text.
    pub fn of(bytes: &[u8]) -> Result<Option<Self>, PointError> {
        let mut reader = Reader { bytes, at: 0, is_big_endian: false };
        if reader.line().is_none_or(|head| head.trim() != "$MeshFormat") {
            return Ok(None);
        }
        let line = reader.line().unwrap_or_default();
        let words: Vec<&str> = line.split_whitespace().collect();
        if words.get(1) != Some(&"1") {
            return Ok(None);
        }
        let is_new = match words.first() {
            Some(&"2.2" | &"2.1" | &"2") => false,
            Some(&"4.1") => true,
            other => {
                let message = format!("a binary format of version {}", other.unwrap_or(&"?"));
                return Err(fail(message, "save it with `Mesh.MshFileVersion = 4.1` or 2.2"));
            }
        };
        if words.get(2) != Some(&"8") {
            let message = format!("numbers of {} bytes", words.get(2).unwrap_or(&"?"));
            return Err(fail(message, "save it on a 64-bit machine, or as text with `Mesh.Binary = 0`"));
        }
        let one = reader.take(4).map_err(|(message, remedy)| fail(message, remedy))?;
        let is_big_endian = match one {
            [1, 0, 0, 0] => false,
            [0, 0, 0, 1] => true,
            _ => {
                let message = format!("the integer 1 reads as {one:?}: the order of bytes is not known");
                return Err(fail(message, "transfer the file in binary mode, or save it again"));
            }
        };
        Ok(Some(Self { is_new, is_big_endian, start: reader.at }))
    }
}

/// Reads a mesh.
pub(super) fn read(bytes: &[u8], format: &Format) -> Result<Mesh, PointError> {
    let mut reader = Reader { bytes, at: format.start, is_big_endian: format.is_big_endian };
    let mut builder = Builder::default();
    let at = |reader: &Reader<'_>, (message, remedy): Wrong| fail(format!("{message} (byte {})", reader.at), remedy);
    reader.end("MeshFormat").map_err(|wrong| at(&reader, wrong))?;
    while reader.skip_blanks() {
        let section = reader.line().and_then(|line| line.trim().strip_prefix('$').map(str::to_owned));
        let Some(section) = section else {
            let wrong = ("no section begins here".to_owned(), "the counts do not fit what is there: export it again");
            return Err(at(&reader, wrong));
        };
        let done = match (section.as_str(), format.is_new) {
            ("PhysicalNames", _) => reader.names(&mut builder),
            ("Entities", true) => reader.entities(&mut builder),
            ("Nodes", false) => reader.nodes_2(&mut builder),
            ("Nodes", true) => reader.nodes_4(&mut builder),
            ("Elements", false) => reader.elements_2(&mut builder),
            ("Elements", true) => reader.elements_4(&mut builder),
            _ => reader.pass(&section),
        };
        done.and_then(|()| reader.end(&section)).map_err(|wrong| at(&reader, wrong))?;
    }
    builder.finished().map_err(|wrong| at(&reader, wrong))
}

struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
    is_big_endian: bool,
}

impl<'a> Reader<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], Wrong> {
        let end = self.at.checked_add(count).filter(|end| *end <= self.bytes.len());
        let Some(end) = end else {
            return Err(("the file ends here".to_owned(), "it is cut short: export it again"));
        };
        let taken = &self.bytes[self.at..end];
        self.at = end;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], Wrong> {
        let mut own = [0; N];
        own.copy_from_slice(self.take(N)?);
        if self.is_big_endian {
            own.reverse();
        }
        Ok(own)
    }

    fn int(&mut self) -> Result<i64, Wrong> {
        Ok(i32::from_le_bytes(self.array()?).into())
    }

    fn size(&mut self) -> Result<u64, Wrong> {
        Ok(u64::from_le_bytes(self.array()?))
    }

    fn double(&mut self) -> Result<f64, Wrong> {
        Ok(f64::from_le_bytes(self.array()?))
    }

    fn place(&mut self) -> Result<Vector<3>, Wrong> {
        Ok(Vector::from([self.double()?, self.double()?, self.double()?]))
    }

    /// The rest of the line; none at the end of the file, or if it is no text.
    fn line(&mut self) -> Option<&'a str> {
        let rest = self.bytes.get(self.at..).filter(|rest| !rest.is_empty())?;
        let length = rest.iter().position(|byte| *byte == b'\n');
        self.at += length.map_or(rest.len(), |length| length + 1);
        std::str::from_utf8(&rest[..length.unwrap_or(rest.len())]).ok()
    }

    /// Whether something follows.
    fn skip_blanks(&mut self) -> bool {
        let rest = &self.bytes[self.at..];
        self.at += rest.iter().take_while(|byte| byte.is_ascii_whitespace()).count();
        self.at < self.bytes.len()
    }

    /// `$EndSection`, after blanks.
    fn end(&mut self, section: &str) -> Result<(), Wrong> {
        let start = self.at;
        self.skip_blanks();
        if self.line().is_some_and(|line| line.trim().strip_prefix("$End") == Some(section)) {
            return Ok(());
        }
        self.at = start;
        let message = format!("`$End{section}` should be here");
        Err((message, "the counts do not fit what is there, or the file is cut short: export it again"))
    }

    /// Goes to the end of a section that is not needed.
    fn pass(&mut self, section: &str) -> Result<(), Wrong> {
        let end = format!("$End{section}");
        let rest = &self.bytes[self.at..];
        match rest.windows(end.len()).position(|window| window == end.as_bytes()) {
            Some(position) => {
                self.at += position;
                Ok(())
            }
            None => Err((format!("`${section}` has no `{end}`"), "the file is cut short: export it again")),
        }
    }

    /// A count that stands as text.
    fn count(&mut self) -> Result<u64, Wrong> {
        let count = self.line().and_then(|line| line.trim().parse().ok());
        count.ok_or_else(|| ("no count stands here".to_owned(), "export it from Gmsh again"))
    }

    fn names(&mut self, builder: &mut Builder) -> Result<(), Wrong> {
        for _ in 0..self.count()? {
            let Some(line) = self.line() else {
                return Err(("no physical name stands here".to_owned(), "names are UTF-8 text: rename the group"));
            };
            builder.name(line)?;
        }
        Ok(())
    }

    /// Physical groups of points, curves, surfaces and volumes.
    fn entities(&mut self, builder: &mut Builder) -> Result<(), Wrong> {
        let counts = [self.size()?, self.size()?, self.size()?, self.size()?];
        for (dimension, count) in counts.into_iter().enumerate() {
            for _ in 0..count {
                let number = self.int()?;
                // A point, or the corners of a box.
                for _ in 0..if dimension == 0 { 3 } else { 6 } {
                    self.double()?;
                }
                let mut groups = Vec::new();
                for _ in 0..self.size()? {
                    groups.push(self.int()?);
                }
                if dimension > 0 {
                    for _ in 0..self.size()? {
                        self.int()?;
                    }
                }
                builder.physical.insert((dimension, number), groups);
            }
        }
        Ok(())
    }

    fn nodes_2(&mut self, builder: &mut Builder) -> Result<(), Wrong> {
        for _ in 0..self.count()? {
            let number = self.int()?.unsigned_abs();
            builder.node(number, self.place()?)?;
        }
        Ok(())
    }

    fn nodes_4(&mut self, builder: &mut Builder) -> Result<(), Wrong> {
        let [blocks, _, _, _] = [self.size()?, self.size()?, self.size()?, self.size()?];
        for _ in 0..blocks {
            let [dimension, _, parametric] = [self.int()?, self.int()?, self.int()?];
            let count = self.size()?;
            let mut numbers = Vec::new();
            for _ in 0..count {
                numbers.push(self.size()?);
            }
            for number in numbers {
                builder.node(number, self.place()?)?;
                for _ in 0..if parametric == 0 { 0 } else { dimension } {
                    self.double()?;
                }
            }
        }
        Ok(())
    }

    fn elements_2(&mut self, builder: &mut Builder) -> Result<(), Wrong> {
        let mut left = self.count()?;
        while left > 0 {
            let [form, count, tags] = [self.int()?, self.int()?, self.int()?];
            let form = Builder::form(form.unsigned_abs())?;
            let count = u64::try_from(count).unwrap_or(0);
            if count == 0 || count > left {
                let message = format!("a block of {count} elements, where {left} are left");
                return Err((message, "export it from Gmsh again"));
            }
            left -= count;
            for _ in 0..count {
                self.int()?;
                let mut group = None;
                for tag in 0..tags {
                    let number = self.int()?;
                    group = if tag == 0 && number > 0 { Some(number) } else { group };
                }
                let mut nodes = Vec::with_capacity(form.size().1);
                for _ in 0..form.size().1 {
                    nodes.push(self.int()?.unsigned_abs());
                }
                builder.element(form, &nodes, group.into_iter().collect())?;
            }
        }
        Ok(())
    }

    fn elements_4(&mut self, builder: &mut Builder) -> Result<(), Wrong> {
        let [blocks, _, _, _] = [self.size()?, self.size()?, self.size()?, self.size()?];
        for _ in 0..blocks {
            let [dimension, part, form] = [self.int()?, self.int()?, self.int()?];
            let form = Builder::form(form.unsigned_abs())?;
            let key = (usize::try_from(dimension).unwrap_or(usize::MAX), part);
            let groups = builder.physical.get(&key).cloned().unwrap_or_default();
            for _ in 0..self.size()? {
                self.size()?;
                let mut nodes = Vec::with_capacity(form.size().1);
                for _ in 0..form.size().1 {
                    nodes.push(self.size()?);
                }
                builder.element(form, &nodes, groups.clone())?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::read_msh;
    use super::super::tests::OLD;

    /// The mesh of the tests of texts, in binary, byte by byte.
    struct Writer {
        bytes: Vec<u8>,
        big: bool,
    }

    impl Writer {
        fn text(&mut self, text: &str) {
            self.bytes.extend(text.as_bytes());
        }

        fn put(&mut self, mut bytes: Vec<u8>) {
            if self.big {
                bytes.reverse();
            }
            self.bytes.extend(bytes);
        }

        fn ints(&mut self, numbers: &[i32]) {
            numbers.iter().for_each(|number| self.put(number.to_le_bytes().to_vec()));
        }

        fn sizes(&mut self, numbers: &[u64]) {
            numbers.iter().for_each(|number| self.put(number.to_le_bytes().to_vec()));
        }

        fn doubles(&mut self, numbers: &[f64]) {
            numbers.iter().for_each(|number| self.put(number.to_le_bytes().to_vec()));
        }

        fn begin(version: &str, big: bool) -> Self {
            let mut writer = Self { bytes: Vec::new(), big };
            writer.text(&format!("$MeshFormat\n{version} 1 8\n"));
            writer.ints(&[1]);
            writer.text("\n$EndMeshFormat\n$PhysicalNames\n2\n1 7 \"clamp ä\"\n2 9 \"plate\"\n$EndPhysicalNames\n");
            writer
        }
    }

    const PLACES: [(i32, [f64; 3]); 4] =
        [(1, [0.0, 0.0, 0.0]), (2, [1.0, 0.0, 0.0]), (3, [1.0, 1.0, 0.0]), (5, [0.0, 1.0, 0.0])];

    fn old(big: bool) -> Vec<u8> {
        let mut writer = Writer::begin("2.2", big);
        writer.text("$Nodes\n4\n");
        for (number, place) in PLACES {
            writer.ints(&[number]);
            writer.doubles(&place);
        }
        writer.text("\n$EndNodes\n$Elements\n3\n");
        writer.ints(&[1, 1, 2, 1, 7, 1, 5, 1]);
        writer.ints(&[2, 2, 2, 2, 9, 1, 1, 2, 3, 3, 9, 1, 1, 3, 5]);
        writer.text("\n$EndElements\n");
        writer.bytes
    }

    fn new(big: bool) -> Vec<u8> {
        let mut writer = Writer::begin("4.1", big);
        writer.text("$Entities\n");
        writer.sizes(&[1, 1, 1, 0]);
        writer.ints(&[1]);
        writer.doubles(&[0.0; 3]);
        writer.sizes(&[0]);
        writer.ints(&[4]);
        writer.doubles(&[0.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
        writer.sizes(&[1]);
        writer.ints(&[7]);
        writer.sizes(&[2]);
        writer.ints(&[1, -4]);
        writer.ints(&[1]);
        writer.doubles(&[0.0, 0.0, 0.0, 1.0, 1.0, 0.0]);
        writer.sizes(&[1]);
        writer.ints(&[9]);
        writer.sizes(&[1]);
        writer.ints(&[4]);
        // Two blocks of nodes, the second with the parameters of a curve.
        writer.text("\n$EndEntities\n$Nodes\n");
        writer.sizes(&[2, 4, 1, 5]);
        writer.ints(&[2, 1, 0]);
        writer.sizes(&[3, 1, 2, 3]);
        PLACES[..3].iter().for_each(|(_, place)| writer.doubles(place));
        writer.ints(&[1, 4, 1]);
        writer.sizes(&[1, 5]);
        writer.doubles(&[0.0, 1.0, 0.0, 0.25]);
        writer.text("\n$EndNodes\n$Elements\n");
        writer.sizes(&[2, 3, 1, 3]);
        writer.ints(&[1, 4, 1]);
        writer.sizes(&[1, 1, 5, 1]);
        writer.ints(&[2, 1, 2]);
        writer.sizes(&[2, 2, 1, 2, 3, 3, 1, 3, 5]);
        // A section that nobody needs, with what looks like the end of another.
        writer.text("\n$EndElements\n$Periodic\n\u{1}$EndNodes\u{2}\n$EndPeriodic\n");
        writer.bytes
    }

    #[test]
    fn binary_and_text_give_the_same_mesh_in_either_order_of_bytes() {
        let wanted = read_msh(OLD.as_bytes()).unwrap();
        for big in [false, true] {
            assert_eq!(read_msh(&old(big)).unwrap(), wanted);
            assert_eq!(read_msh(&new(big)).unwrap(), wanted);
        }
    }

    /// Cut anywhere, a file is refused with a message, unless only what follows the mesh is missing.
    #[test]
    fn cut_files_are_refused() {
        for whole in [old(false), new(false), old(true), new(true)] {
            let elements = whole.windows(12).position(|window| window == b"$EndElements").unwrap();
            for length in 0..elements {
                let error = read_msh(&whole[..length]).unwrap_err();
                assert!(!error.message.is_empty() && !error.remedy.is_empty(), "{length}: {error:?}");
            }
        }
    }

    #[test]
    fn mistakes_are_named() {
        let spoil = |from: &[u8], to: &[u8]| {
            let mut bytes = new(false);
            let at = bytes.windows(from.len()).position(|window| window == from).unwrap();
            bytes.splice(at..at + from.len(), to.iter().copied());
            read_msh(&bytes).unwrap_err()
        };
        let size = |number: u64| number.to_le_bytes();
        let cases = [
            (spoil(b"4.1 1 8", b"3.0 1 8"), "version 3.0"),
            (spoil(b"4.1 1 8", b"4.1 1 4"), "numbers of 4 bytes"),
            (spoil(b"8\n\x01\x00\x00\x00", b"8\n\x00\x01\x00\x00"), "order of bytes"),
            // As a transfer in text mode leaves it.
            (spoil(b"8\n\x01\x00\x00\x00", b"8\n\x01\x00\x00\r"), "order of bytes"),
            (spoil(b"$EndMeshFormat", b"$EndOther"), "`$EndMeshFormat` should be here"),
            (spoil(b"\"plate\"", b"plate"), "not a physical name"),
            (spoil(b"$EndEntities", b"EndEntities"), "`$EndEntities` should be here"),
            // The one node of the second block; the header has the same two numbers, but no zero after them.
            (
                spoil(&[size(1), size(5), size(0)].concat(), &[size(1), size(3), size(0)].concat()),
                "node 3 is there twice",
            ),
            (spoil(b"$Nodes\n\x02\x00", b"$Nodes\n\xff\xff"), "(byte"),
            (spoil(b"$Elements\n\x02", b"$Elements\n\x01"), "`$EndElements` should be here"),
        ];
        for (error, phrase) in cases {
            assert!(error.message.contains(phrase), "{error:?} has no {phrase}");
        }
        // The last triangle: its number, then its nodes.
        let far = [size(3), size(1), size(3), size(9)].concat();
        let error = spoil(&[size(3), size(1), size(3), size(5)].concat(), &far);
        assert!(error.message.contains("a node that does not exist (byte"), "{error:?}");
    }
}
