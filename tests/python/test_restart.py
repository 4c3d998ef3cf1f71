"""Checkpoints: what goes on has the bits of what never ended, in Python and on the command line."""

import json
import shutil
import subprocess

import numpy as np
import pytest

import nicolson
from nicolson import Scene, SceneError, Simulation

# Every kind of memory that a step leaves for the next.
KINDS = {
    "explicit": {"time.scheme": "tvd_rk2", "time.step": 1e-3, "time.end": 0.02},
    "stabilised explicit": {"time.scheme": "rkc", "time.step": 2e-3, "time.end": 0.04},
    "lagged tangent": {"newton.tangent": "lagged", "newton.relative_tolerance": 1e-9},
    "auto solver": {"linear.solver": "auto", "newton.relative_tolerance": 1e-9},
    "auto solver, larger": {"linear.solver": "auto", "body.0.counts": [24, 20], "newton.relative_tolerance": 1e-9},
    "generalised alpha": {"time.scheme": "generalised_alpha", "time.spectral_radius": 0.6},
    "two stages": {"time.scheme": "tr_bdf2", "newton.tangent": "lagged"},
    "controlled steps": {"time.scheme": "sdirk3", "time.step": 1e-3, "time.adaptive": {"tolerance": 1e-4}},
    "frames between steps": {"output.interval": 0.033},
}


@pytest.fixture(params=KINDS)
def scene(request, solid):
    solid.update(KINDS[request.param])
    return solid


def history(simulation):
    """All steps to the end."""
    steps = []
    while not simulation.finished:
        steps.append(simulation.step())
    return steps


def test_goes_on_to_the_same_bits(scene, tmp_path):
    whole = Simulation(scene)
    steps, path = history(whole), tmp_path / "here.safetensors"
    first = Simulation(scene)
    done = [first.step() for _ in range(len(steps) // 2)]
    first.checkpoint(path)
    # Writing changes nothing.
    assert done + history(first) == steps
    assert first.state.tobytes() == whole.state.tobytes()
    second = Simulation.restart(path, threads=2)
    assert (second.time, second.scheme) == (done[-1]["time"], whole.scheme)
    assert done + history(second) == steps
    assert second.state.tobytes() == whole.state.tobytes()
    # And so does a whole run, without books of what was before.
    result = nicolson.restart(path)
    assert result.history["t"].tolist() == [step["time"] for step in steps[len(done) :]]
    assert result.state.tobytes() == whole.state.tobytes()
    assert result.report["steps"]["accepted"] == len(steps)


def test_lagged_tangent_needs_what_it_remembers(solid, tmp_path):
    """The test above can fail: the state alone leads to other bits."""
    solid.update(KINDS["lagged tangent"])
    whole = Simulation(solid)
    history(whole)
    first = Simulation(solid)
    for _ in range(5):
        first.step()
    first.checkpoint(tmp_path / "here")
    solid.set("newton.max_iterations", 29)
    second = Simulation.restart(tmp_path / "here", scene=solid, force=True)
    history(second)
    assert second.state.tobytes() != whole.state.tobytes()
    assert np.abs(second.state - whole.state).max() < 1e-6


def test_checkpoints_of_checkpoints(solid, tmp_path):
    whole = Simulation(solid)
    history(whole)
    simulation, path = Simulation(solid), tmp_path / "here"
    while not simulation.finished:
        simulation.step()
        simulation.checkpoint(path)
        simulation = Simulation.restart(path)
    assert simulation.state.tobytes() == whole.state.tobytes()


def test_run_of_the_command_line_goes_on_in_python(scene, binary, tmp_path):
    scene.set("checkpoint", {"every_steps": 3, "keep": 100})
    file, out = tmp_path / "scene.toml", tmp_path / "out"
    file.write_text(scene.to_toml(), encoding="utf-8")
    subprocess.run([binary, "run", str(file), "--out", str(out), "--quiet"], check=True)
    whole = nicolson.run(scene)
    checkpoints = sorted((out / "checkpoints").iterdir())
    assert len(checkpoints) >= 3
    for path in (checkpoints[0], checkpoints[-2]):
        simulation = Simulation.restart(path)
        assert 0 < simulation.time < simulation.end
        history(simulation)
        assert simulation.state.tobytes() == whole.state.tobytes()
        assert nicolson.restart(path).state.tobytes() == whole.state.tobytes()
    # In its place: the files end as those of the run in one piece.
    names = ["history.csv", "probes.csv", "fields.pvd"]
    before = [(out / name).read_bytes() for name in names]
    result = nicolson.restart(checkpoints[0], out=out)
    assert [(out / name).read_bytes() for name in names] == before
    assert result.state.tobytes() == whole.state.tobytes()
    assert json.loads((out / "report.json").read_text())["provenance"]["parent_checkpoint"] == str(checkpoints[0])


def test_command_line_goes_on_from_python(solid, binary, tmp_path):
    whole = nicolson.run(solid, out=tmp_path / "whole")
    simulation, path = Simulation(solid), tmp_path / "here.safetensors"
    for _ in range(5):
        simulation.step()
    simulation.checkpoint(path)
    out = tmp_path / "out"
    subprocess.run([binary, "restart", str(path), "--out", str(out), "--quiet"], check=True)
    report = json.loads((out / "report.json").read_text())
    assert report["probes"] == whole.report["probes"] and report["steps"]["accepted"] == 10
    assert any("begin at the checkpoint" in warning for warning in report["warnings"])
    rows = (tmp_path / "whole" / "probes.csv").read_text().splitlines()
    assert (out / "probes.csv").read_text().splitlines() == [rows[0], *rows[7:]]
    # It would take the place of files that it knows nothing of.
    (tmp_path / "whole" / "here").write_bytes(path.read_bytes())
    before = (tmp_path / "whole" / "history.csv").read_bytes()
    place = [binary, "restart", str(tmp_path / "whole" / "here"), "--quiet"]
    answer = subprocess.run(place, capture_output=True, text=True, check=False)
    assert answer.returncode == 2 and "written by hand" in answer.stderr and "--out" in answer.stderr
    assert (tmp_path / "whole" / "history.csv").read_bytes() == before


@pytest.mark.parametrize("go_on", [Simulation.restart, nicolson.restart])
def test_changes(solid, tmp_path, go_on):
    simulation, path = Simulation(solid), tmp_path / "here"
    simulation.run_until(0.05)
    simulation.checkpoint(path)

    def end(result):
        if isinstance(result, Simulation):
            history(result)
        return result.time

    # These may change.
    assert end(go_on(path, changes={"time.end": 0.07, "output.history": False})) == 0.07
    # Others are refused with what differs, unless forced.
    for given in ({"changes": {"time.step": 0.005}}, {"scene": changed(solid, "time.step", 0.005)}):
        with pytest.raises(SceneError, match=r"time\.step: 0\.01 → 0\.005") as raised:
            go_on(path, **given)
        assert "force=True" in str(raised.value)
        assert end(go_on(path, **given, force=True)) == 0.1
    with pytest.raises(SceneError, match="state of 12 particles"):
        go_on(path, changes={"body.0.counts": [4, 3]}, force=True)
    with pytest.raises(SceneError, match="before the checkpoint"):
        go_on(path, changes={"time.end": 0.02})
    with pytest.raises(SceneError, match="nonsense"):
        go_on(path, changes={"time.nonsense": 1})


def changed(scene, key, value):
    copy = scene.copy()
    copy.set(key, value)
    return copy


@pytest.mark.parametrize("go_on", [Simulation.restart, nicolson.restart])
def test_what_is_no_checkpoint(solid, tmp_path, go_on):
    with pytest.raises(FileNotFoundError):
        go_on(tmp_path / "nothing")
    (tmp_path / "text").write_text("no checkpoint")
    with pytest.raises(SceneError, match="not a checkpoint"):
        go_on(tmp_path / "text")
    with pytest.raises(SceneError, match="no checkpoint that can be read"):
        go_on(tmp_path)
    simulation = Simulation(solid)
    simulation.checkpoint(tmp_path / "here")
    content = bytearray((tmp_path / "here").read_bytes())
    content[len(content) // 2] ^= 4
    (tmp_path / "here").write_bytes(content)
    with pytest.raises(SceneError):
        go_on(tmp_path / "here")


def test_damaged_checkpoints_of_a_directory_are_passed_over_with_a_warning(solid, tmp_path):
    solid.set("checkpoint", {"every_steps": 2, "keep": 10})
    whole = nicolson.run(solid, out=tmp_path)
    newest = sorted((tmp_path / "checkpoints").iterdir())[-1]
    newest.write_bytes(newest.read_bytes()[:1000])
    with pytest.warns(UserWarning, match="passed over"):
        simulation = Simulation.restart(tmp_path)
    assert simulation.time == pytest.approx(0.08)
    history(simulation)
    assert simulation.state.tobytes() == whole.state.tobytes()


def test_disk_that_refuses(solid, tmp_path):
    simulation = Simulation(solid)
    with pytest.raises(OSError, match="nowhere"):
        simulation.checkpoint(tmp_path / "nowhere" / "here")
    simulation.checkpoint(tmp_path / "here")
    before = (tmp_path / "here").read_bytes()
    simulation.checkpoint(tmp_path / "here")
    # The same state gives the same bytes, and nothing else is left behind.
    assert (tmp_path / "here").read_bytes() == before
    assert [path.name for path in tmp_path.iterdir()] == ["here"]


def test_numpy_reads_a_checkpoint(solid, tmp_path):
    """Eight bytes of length, a header in JSON, the arrays."""
    simulation = Simulation(solid)
    simulation.step()
    simulation.checkpoint(tmp_path / "here")
    content = (tmp_path / "here").read_bytes()
    length = int.from_bytes(content[:8], "little")
    header = json.loads(content[8 : 8 + length])
    begin, end = header["state/values"]["data_offsets"]
    values = np.frombuffer(content[8 + length :][begin:end])
    assert values.tobytes() == simulation.state.tobytes()


def test_files_of_the_scene_are_found_again(examples, tmp_path, monkeypatch):
    for name in ("bracket.toml", "bracket.stl"):
        shutil.copy(examples / name, tmp_path / name)
    scene = Scene.from_toml(tmp_path / "bracket.toml")
    scene.set("time.end", 1e-4)
    Simulation(scene).checkpoint(tmp_path / "here")
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    assert Simulation.restart("../here").particles > 10
    with open(tmp_path / "bracket.stl", "ab") as file:
        file.write(b"\n")
    with pytest.raises(SceneError, match=r"bracket\.stl: its content has changed"):
        Simulation.restart("../here")
