"""Ctrl-C, and other threads at work."""

import json
import signal
import threading
import time

import numpy as np
import pytest

import nicolson


@pytest.fixture
def heavy(solid):
    """One step of it takes long enough to be interrupted."""
    solid.update({"body.0.counts": [80, 64], "time.step": 0.002, "linear.solver": "lu"})
    return solid


def later(seconds):
    timer = threading.Timer(seconds, signal.raise_signal, [signal.SIGINT])
    timer.start()
    return timer


def test_ctrl_c_inside_a_step_leaves_the_state(heavy):
    simulation = nicolson.Simulation(heavy)
    before = simulation.state
    start = time.perf_counter()
    timer = later(0.1)
    with pytest.raises(KeyboardInterrupt):
        simulation.step()
    timer.join()
    interrupted = time.perf_counter() - start
    assert simulation.time == 0.0
    assert simulation.state.tobytes() == before.tobytes()
    start = time.perf_counter()
    simulation.step()
    # It did not wait for the end of the step, and the step can be taken after all.
    assert interrupted < time.perf_counter() - start
    assert simulation.time == 0.002


def test_ctrl_c_in_a_run_keeps_what_there_is(solid, tmp_path):
    solid.set("time.end", 1e5)
    timer = later(0.5)
    with pytest.raises(KeyboardInterrupt) as raised:
        nicolson.run(solid, out=tmp_path / "out")
    timer.join()
    result = raised.value.result
    assert result.status == "interrupted" and result.time > 0
    assert len(result.history["t"]) == result.report["steps"]["accepted"] + 1
    assert json.loads((tmp_path / "out" / "report.json").read_text())["time_reached"] == result.time


def test_ctrl_c_between_many_short_steps(solid):
    solid.set("time.end", 1e5)
    simulation = nicolson.Simulation(solid)
    timer = later(0.5)
    with pytest.raises(KeyboardInterrupt):
        simulation.run_until(1e5)
    timer.join()
    reached = simulation.time
    assert 0 < reached < 1e5
    assert np.isfinite(simulation.state).all()
    simulation.step()
    assert simulation.time > reached


def test_handler_that_uses_the_simulation_is_refused_not_stuck(heavy):
    simulation = nicolson.Simulation(heavy)
    before = signal.signal(signal.SIGINT, lambda number, frame: simulation.time)
    try:
        timer = later(0.1)
        with pytest.raises(RuntimeError, match="inside a step"):
            simulation.step()
        timer.join()
    finally:
        signal.signal(signal.SIGINT, before)
    assert simulation.time == 0.0


def test_python_goes_on_during_a_step(heavy):
    simulation, turns = nicolson.Simulation(heavy), []
    worker = threading.Thread(target=simulation.step)
    worker.start()
    while worker.is_alive():
        turns.append(time.perf_counter())
        time.sleep(0.001)
    assert len(turns) > 20 and simulation.time == 0.002
