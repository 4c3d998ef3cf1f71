"""Whole runs: the same bits as the command line, callbacks, failures."""

import csv
import json
import subprocess
import threading

import numpy as np
import pytest

import nicolson
from nicolson import Scene, SimulationFailed


def columns(path):
    with open(path, newline="", encoding="utf-8") as file:
        titles, *rows = list(csv.reader(file))
    return titles, np.array(rows, dtype=float)


def run_binary(binary, scene, directory, *options):
    path = directory / "scene.toml"
    path.write_text(scene.to_toml(), encoding="utf-8")
    out = directory / "out"
    subprocess.run([binary, "run", str(path), "--out", str(out), "--quiet", *options], check=True)
    return out


def test_same_bits_as_the_command_line(solid, binary, tmp_path):
    solid.set("output.interval", 0.05)
    out = run_binary(binary, solid, tmp_path)
    result = nicolson.run(solid, out=tmp_path / "python")
    names = ["history.csv", "probes.csv"]
    for name in names:
        assert (out / name).read_bytes() == (tmp_path / "python" / name).read_bytes()
    for table, name in ((result.history, names[0]), (result.probes, names[1])):
        titles, rows = columns(out / name)
        assert list(table) == titles
        for title, column in zip(titles, rows.T, strict=True):
            assert table[title].tolist() == column.tolist()
    with open(out / "report.json", encoding="utf-8") as file:
        report = json.load(file)
    for key in ("status", "time_reached", "steps", "newton", "energy", "probes", "particles"):
        assert result.report[key] == report[key]


def test_steps_are_those_of_the_run(solid):
    solid.set("output.interval", 0.033)  # frames cut some steps short
    result = nicolson.run(solid)
    simulation = nicolson.Simulation(solid)
    times = [0.0]
    while not simulation.finished:
        times.append(simulation.step()["time"])
    assert times == result.history["t"].tolist()
    assert len(times) > 11
    assert simulation.state.tobytes() == result.state.tobytes()


def test_results_in_memory_and_on_disk_agree(solid, tmp_path):
    inside, outside = nicolson.run(solid), nicolson.run(solid, out=tmp_path / "out", threads=2)
    assert inside.out is None and outside.out == tmp_path / "out"
    assert inside.state.tobytes() == outside.state.tobytes()
    assert (tmp_path / "out" / "report.json").exists()
    tip = inside.report["probes"]["tip"]["displacement"]
    assert [inside.probes["tip.ux"][-1], inside.probes["tip.uy"][-1]] == tip


def test_result_is_complete(solid):
    result = nicolson.run(solid)
    assert result.status == result.report["status"] == "completed"
    assert result.time == 0.1
    assert result.displacement.shape == result.velocity.shape == (30, 2)
    assert result.volume_ratio.shape == (30,)
    assert np.shares_memory(result.displacement, result.state)
    assert not result.state.flags.writeable
    assert result.history["total"][0] > 0


def test_history_can_be_off(solid):
    solid.set("output.history", False)
    result = nicolson.run(solid)
    assert result.history == {} and len(result.probes["t"]) == 11


def test_callback_hears_every_step_in_its_thread(solid):
    heard = []
    result = nicolson.run(solid, callback=lambda step: heard.append((step, threading.get_ident())))
    assert [step["time"] for step, _ in heard] == result.history["t"][1:].tolist()
    assert {thread for _, thread in heard} == {threading.get_ident()}
    assert all(step["newton_iterations"] >= 1 and step["end"] == 0.1 for step, _ in heard)


def test_callback_stops_the_run(solid, tmp_path):
    result = nicolson.run(solid, out=tmp_path / "out", callback=lambda step: step["time"] > 0.035)
    assert result.status == "interrupted"
    assert len(result.history["t"]) == 5
    assert json.loads((tmp_path / "out" / "report.json").read_text())["status"] == "interrupted"


def test_exception_in_a_callback_comes_out(solid, tmp_path):
    class Enough(Exception):
        pass

    def callback(step):
        if step["time"] > 0.025:
            raise Enough

    with pytest.raises(Enough) as raised:
        nicolson.run(solid, out=tmp_path / "out", callback=callback)
    assert len(raised.value.result.history["t"]) == 4
    assert (tmp_path / "out" / "report.json").exists()


def test_callback_may_use_nicolson(solid):
    times = []
    nicolson.run(solid, callback=lambda step: times.append(nicolson.run(solid).time) or len(times) == 2)
    assert times == [0.1, 0.1]


def failing(solid):
    """A load that no step can bear."""
    solid.update({"initial.velocity": ["-3e3*X", "0"], "newton.max_iterations": 3, "time.minimum_step": 0.009})
    return solid


def test_failure_brings_what_there_is(solid, tmp_path):
    with pytest.raises(SimulationFailed) as raised:
        nicolson.run(failing(solid), out=tmp_path / "out")
    error = raised.value
    assert isinstance(error, RuntimeError) and error.time == error.result.time
    assert error.result.status == "failed" and str(error) == error.result.report["message"]
    assert json.loads((tmp_path / "out" / "report.json").read_text())["status"] == "failed"


def test_failed_step_leaves_the_state(solid):
    simulation = nicolson.Simulation(failing(solid))
    before = simulation.state
    with pytest.raises(SimulationFailed) as raised:
        simulation.step()
    assert raised.value.time == 0 and raised.value.result is None
    assert raised.value.tries and all(tried["step"] > 0 and tried["cause"] for tried in raised.value.tries)
    assert simulation.state.tobytes() == before.tobytes()


def test_disk_that_refuses(solid, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises((OSError, ValueError)):
        nicolson.run(solid, out=tmp_path / "file" / "out")


def test_threads_zero(solid):
    with pytest.raises(ValueError, match="threads=0"):
        nicolson.run(solid, threads=0)


def test_example_runs(examples):
    scene = Scene.from_toml(examples / "bar-smooth.toml")
    scene.set("time.end", 0.2)
    result = nicolson.run(scene)
    assert result.report["newton"]["iterations"] == result.report["steps"]["accepted"]
    assert result.report["energy"]["max_relative_drift"] < 1e-12
