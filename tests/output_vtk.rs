//! Every VTU file we write is read back twice: by VTK itself (the reader behind ParaView), and by an
//! independent few lines here that follow the header and inflate the blocks. Both must find the exact
//! bits that went in.
//!
//! VTK is asked through `python3 -c "import vtk"` (or the interpreter named in `NICOLSON_PYTHON`).
//! Without it that half is skipped, unless `NICOLSON_REQUIRE_READERS` is set: then it fails.

use std::borrow::Cow;
use std::env;
use std::fs;
use std::io::Read;
use std::path::Path;
use std::process::Command;

use nicolson::output::{Frame, OutOfPlane, Precision, Series, Tensor, prepare_directory};

const PROVENANCE: &str = "{\"scene\": \"dir with späce/beam.toml\", \"note\": \"a < b & c > d\"}";

/// Reads the files that `expected.txt` lists and compares every array byte by byte.
const CHECK: &str = r#"
import os, struct, sys
import xml.etree.ElementTree as tree
import vtk

errors = []
vtk.vtkObject.GlobalWarningDisplayOff()

def read(path):
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.AddObserver("ErrorEvent", lambda *_: errors.append(f"{path}: VTK reports an error"))
    reader.SetFileName(path)
    reader.Update()
    return reader.GetOutput()

def raw(array):
    return bytes(memoryview(array)) if array.GetNumberOfValues() else b""

os.chdir(sys.argv[1])
provenance = open("provenance.txt", encoding="utf-8").read()
times, compared = {}, 0
for line in open("expected.txt", encoding="utf-8"):
    file, points, time, fields = line.rstrip("\n").split("\t")
    points, times[file] = int(points), float(time)
    grid = read(file)
    if grid.GetNumberOfPoints() != points or grid.GetNumberOfCells() != points:
        errors.append(f"{file}: {grid.GetNumberOfPoints()} points, {grid.GetNumberOfCells()} cells, not {points}")
        continue
    for cell in {0, points // 2, points - 1} if points else ():
        if grid.GetCellType(cell) != vtk.VTK_VERTEX or grid.GetCell(cell).GetPointId(0) != cell:
            errors.append(f"{file}: cell {cell} is not the vertex of its point")
    if grid.GetFieldData().GetArray("TimeValue").GetValue(0) != times[file]:
        errors.append(f"{file}: wrong TimeValue")
    if grid.GetFieldData().GetAbstractArray("provenance").GetValue(0) != provenance:
        errors.append(f"{file}: wrong provenance")
    names = fields.split(",")
    if grid.GetPointData().GetNumberOfArrays() != len(names) - 1:
        errors.append(f"{file}: wrong number of arrays")
    for name in names:
        array = grid.GetPoints().GetData() if name == "Points" else grid.GetPointData().GetArray(name)
        if array is None:
            errors.append(f"{file}: no array {name}")
            continue
        expected = open(f"{file}.{name}.raw", "rb").read()
        found = raw(array)
        if found != expected:
            first = next((i for i, (a, b) in enumerate(zip(found, expected)) if a != b), "the length")
            errors.append(f"{file}: {name} differs from {first} ({len(found)} bytes, expected {len(expected)})")
        compared += 1

entries = tree.parse("fields.pvd").getroot().find("Collection").findall("DataSet")
if [entry.get("file") for entry in entries] != list(times):
    errors.append("the index lists other files")
for entry in entries:
    if not os.path.exists(entry.get("file")) or float(entry.get("timestep")) != times[entry.get("file")]:
        errors.append(f"index: {entry.attrib}")
print("\n".join(errors) if errors else f"{compared} arrays equal in VTK {vtk.vtkVersion.GetVTKVersion()}")
sys.exit(bool(errors))
"#;

/// Numbers that exercise every bit and compress neither too well nor too badly.
fn numbers(count: usize, seed: u64) -> Vec<f64> {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    (0..count)
        .map(|i| {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1u64 << 53) as f64 * 10f64.powi((i % 31) as i32 - 15)
        })
        .collect()
}

/// A frame and what a reader must find: name and values with all components.
struct Case {
    file: &'static str,
    time: f64,
    dim: usize,
    points: usize,
    precision: Precision,
}

const CASES: [Case; 6] = [
    Case { file: "frames/line.vtu", time: 0.0, dim: 1, points: 20_000, precision: Precision::Double },
    Case { file: "frames/plane.vtu", time: 1.0 / 3.0, dim: 2, points: 20_000, precision: Precision::Double },
    Case { file: "frames/space.vtu", time: 2.5e-7, dim: 3, points: 20_000, precision: Precision::Double },
    Case { file: "frames/single precision.vtu", time: 1e9, dim: 3, points: 20_000, precision: Precision::Single },
    // Points fill three blocks, scalars one block, to the last byte.
    Case { file: "frames/full_blocks.vtu", time: 1e10, dim: 2, points: 131_072, precision: Precision::Double },
    Case { file: "frames/empty.vtu", time: 1e300, dim: 3, points: 0, precision: Precision::Double },
];

/// Components per point in the file, from the definition rather than from the code under test.
fn padded(values: &[f64], dim: usize, order: u32, diagonal: f64) -> Vec<f64> {
    let per_point = dim.pow(order);
    let place = |component: usize| -> Option<usize> {
        let (i, j) = if order == 1 { (0, component) } else { (component / 3, component % 3) };
        let inside = i < dim && j < dim;
        inside.then_some(if order == 1 { j } else { i * dim + j })
    };
    let mut all = Vec::new();
    for point in values.chunks(per_point) {
        for component in 0..3usize.pow(order) {
            let on_diagonal = order == 2 && component % 4 == 0;
            let outside = if on_diagonal { diagonal } else { 0.0 };
            all.push(place(component).map_or(outside, |index| point[index]));
        }
    }
    all
}

/// Writes the case into `directory` and returns the arrays that must come back, as bytes.
fn write_case(case: &Case, directory: &Path) -> Vec<(&'static str, Vec<u8>)> {
    let (dim, points) = (case.dim, case.points);
    let positions = numbers(dim * points, 1);
    let mut pressure = numbers(points, 2);
    if points > 10 {
        pressure[3] = f64::NAN;
        pressure[4] = f64::NEG_INFINITY;
        pressure[5] = -0.0;
    }
    let (velocity, gradient, strain) =
        (numbers(dim * points, 3), numbers(dim * dim * points, 4), numbers(dim * dim * points, 5));
    let stress = numbers(9 * points, 6);
    let tensor = |name, values, out_of_plane| Tensor { name, values: Cow::Borrowed(values), out_of_plane };
    let frame = Frame {
        time: case.time,
        dim,
        positions: &positions,
        scalars: vec![("pressure", Cow::Borrowed(&pressure)), ("density", Cow::Owned(numbers(points, 7)))],
        vectors: vec![("velocity", Cow::Borrowed(&velocity))],
        tensors: vec![
            tensor("deformation_gradient", &gradient[..], OutOfPlane::Identity),
            tensor("strain", &strain[..], OutOfPlane::Zero),
            tensor("cauchy_stress", &stress[..], OutOfPlane::Given),
        ],
        provenance: PROVENANCE,
    };
    let path = directory.join(case.file);
    frame.write(&path, case.precision).unwrap();
    let first = fs::read(&path).unwrap();
    frame.write(&path, case.precision).unwrap();
    assert_eq!(first, fs::read(&path).unwrap(), "the bytes of a frame must not change");

    let double = |values: Vec<f64>| values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>();
    let field = |values: Vec<f64>| match case.precision {
        Precision::Double => double(values),
        Precision::Single => values.iter().flat_map(|&value| (value as f32).to_le_bytes()).collect(),
    };
    vec![
        ("Points", double(padded(&positions, dim, 1, 0.0))),
        ("pressure", field(pressure.clone())),
        ("density", field(numbers(points, 7))),
        ("velocity", field(padded(&velocity, dim, 1, 0.0))),
        ("deformation_gradient", field(padded(&gradient, dim, 2, 1.0))),
        ("strain", field(padded(&strain, dim, 2, 0.0))),
        ("cauchy_stress", field(stress.clone())),
    ]
}

/// The value of an XML attribute in the element that declares an array.
fn attribute<'a>(element: &'a str, name: &str) -> &'a str {
    let start = element.find(&format!(" {name}=\"")).unwrap() + name.len() + 3;
    &element[start..start + element[start..].find('"').unwrap()]
}

/// Inflates the array `name` as the VTK file format describes it, checking every header on the way.
fn inflate(file: &[u8], name: &str) -> Vec<u8> {
    let marker = b"<AppendedData encoding=\"raw\">";
    let section = file.windows(marker.len()).position(|window| window == marker).unwrap();
    let underscore = section + file[section..].iter().position(|&byte| byte == b'_').unwrap() + 1;
    let header = String::from_utf8_lossy(&file[..underscore]).into_owned();
    let name = format!("Name=\"{name}\"");
    let element = header.lines().find(|line| line.contains(&name)).unwrap();
    assert_eq!(attribute(element, "format"), "appended");
    let mut at = underscore + attribute(element, "offset").parse::<usize>().unwrap();
    let mut word = || {
        at += 8;
        u64::from_le_bytes(file[at - 8..at].try_into().unwrap()) as usize
    };
    let (blocks, block, last) = (word(), word(), word());
    let sizes: Vec<usize> = (0..blocks).map(|_| word()).collect();
    let mut bytes = Vec::new();
    for (index, size) in sizes.into_iter().enumerate() {
        let before = bytes.len();
        flate2::read::ZlibDecoder::new(&file[at..at + size]).read_to_end(&mut bytes).unwrap();
        at += size;
        let expected = if index + 1 == blocks && last != 0 { last } else { block };
        assert_eq!(bytes.len() - before, expected);
    }
    bytes
}

#[test]
fn what_we_write_is_what_vtk_and_we_read() {
    let directory = tempfile::Builder::new().prefix("vtk späce ").tempdir().unwrap();
    let directory = directory.path();
    prepare_directory(&directory.join("frames")).unwrap();
    let mut series = Series::new(&directory.join("fields.pvd"));
    let mut listing = String::new();
    for case in &CASES {
        let expected = write_case(case, directory);
        series.append(case.time, &directory.join(case.file)).unwrap();
        let file = fs::read(directory.join(case.file)).unwrap();
        for (name, bytes) in &expected {
            assert!(inflate(&file, name) == *bytes, "{}: {name} differs", case.file);
            fs::write(directory.join(format!("{}.{name}.raw", case.file)), bytes).unwrap();
        }
        let names: Vec<_> = expected.iter().map(|(name, _)| *name).collect();
        listing += &format!("{}\t{}\t{:e}\t{}\n", case.file, case.points, case.time, names.join(","));
    }
    fs::write(directory.join("expected.txt"), listing).unwrap();
    fs::write(directory.join("provenance.txt"), PROVENANCE).unwrap();
    check_with_vtk(directory);
}

/// Runs [`CHECK`] where Python has VTK.
#[expect(clippy::print_stderr, reason = "a skipped check must be visible in the log of the tests")]
fn check_with_vtk(directory: &Path) {
    let python = env::var("NICOLSON_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let available = Command::new(&python).args(["-c", "import vtk"]).output().is_ok_and(|run| run.status.success());
    if !available {
        assert!(env::var_os("NICOLSON_REQUIRE_READERS").is_none(), "{python} cannot import vtk: pip install vtk");
        eprintln!("skipped: {python} cannot import vtk, so the files were checked by our own reader only");
        return;
    }
    let run = Command::new(&python).args(["-c", CHECK]).arg(directory).output().unwrap();
    let (said, complained) = (String::from_utf8_lossy(&run.stdout), String::from_utf8_lossy(&run.stderr));
    assert!(run.status.success(), "{said}\n{complained}");
    eprintln!("{}", said.trim_end());
}
