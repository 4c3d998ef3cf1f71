//! The frames of a real run, read back by VTK's own reader (skipped where Python has no VTK, unless
//! `NICOLSON_REQUIRE_READERS` is set; see `output_vtk.rs`).

use std::env;
use std::process::Command;

use super::{example, readable, run};

/// Reads every frame of the index: names, shapes, and fields that must belong together.
const CHECK: &str = r#"
import os, sys
import xml.etree.ElementTree as tree
import vtk

os.chdir(sys.argv[1])
particles, end = int(sys.argv[2]), float(sys.argv[3])
errors = []
vtk.vtkObject.GlobalWarningDisplayOff()
entries = tree.parse("fields.pvd").getroot().find("Collection").findall("DataSet")
times = [float(entry.get("timestep")) for entry in entries]
if times != sorted(set(times)) or times[0] != 0.0 or times[-1] != end:
    errors.append(f"times {times}")
first = None
for entry in entries:
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.AddObserver("ErrorEvent", lambda *_: errors.append(f"{entry.get('file')}: VTK reports an error"))
    reader.SetFileName(entry.get("file"))
    reader.Update()
    grid = reader.GetOutput()
    data = grid.GetPointData()
    if grid.GetNumberOfPoints() != particles or grid.GetNumberOfCells() != particles:
        errors.append(f"{grid.GetNumberOfPoints()} points, {grid.GetNumberOfCells()} cells")
        continue
    if grid.GetFieldData().GetArray("TimeValue").GetValue(0) != float(entry.get("timestep")):
        errors.append("TimeValue and index differ")
    shapes = {data.GetArrayName(i): data.GetArray(i).GetNumberOfComponents() for i in range(data.GetNumberOfArrays())}
    if shapes != {"pressure": 1, "jacobian": 1, "velocity": 3, "displacement": 3, "deformation_gradient": 9, "volume": 1}:
        errors.append(f"arrays {shapes}")
        continue
    moved, gradient, ratio = (data.GetArray(name) for name in ("displacement", "deformation_gradient", "jacobian"))
    reference = [tuple(x - u for x, u in zip(grid.GetPoint(a), moved.GetTuple(a))) for a in range(particles)]
    first = first or reference
    for a in range(particles):
        if max(abs(p - q) for p, q in zip(reference[a], first[a])) > 1e-12:
            errors.append(f"particle {a}: position and displacement do not belong together")
            break
        f = gradient.GetTuple(a)
        if f[8] != 1.0 or any(f[i] != 0.0 for i in (2, 5, 6, 7)):
            errors.append(f"particle {a}: F is not plane: {f}")
            break
        if not ratio.GetValue(a) > 0.0:
            errors.append(f"particle {a}: J = {ratio.GetValue(a)}")
            break
print("\n".join(errors) if errors else f"{len(entries)} frames read by VTK {vtk.vtkVersion.GetVTKVersion()}")
sys.exit(bool(errors))
"#;

#[test]
#[expect(clippy::print_stderr, reason = "a skipped check must be visible in the log of the tests")]
fn frames_of_a_run_are_read_by_vtk() {
    let directory = tempfile::Builder::new().prefix("frames für ").tempdir().expect("a directory");
    let out = directory.path().join("dam break");
    let answer = run(&example("dam-break"), &out, &["time.end=0.3", "output.interval=0.05"], &["--quiet"]);
    assert_eq!(answer.code, 0, "{}", answer.complained);
    let report = readable(&out);
    let python = env::var("NICOLSON_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let available = Command::new(&python).args(["-c", "import vtk"]).output().is_ok_and(|run| run.status.success());
    if !available {
        assert!(env::var_os("NICOLSON_REQUIRE_READERS").is_none(), "{python} cannot import vtk: pip install vtk");
        eprintln!("skipped: {python} cannot import vtk");
        return;
    }
    let check = Command::new(&python)
        .args(["-c", CHECK])
        .arg(&out)
        .args([report.particles.to_string(), report.time_reached.to_string()])
        .output()
        .expect("python");
    let (said, complained) = (String::from_utf8_lossy(&check.stdout), String::from_utf8_lossy(&check.stderr));
    assert!(check.status.success(), "{said}\n{complained}");
    assert!(said.contains("7 frames"), "{said}");
    eprintln!("{}", said.trim_end());
}
