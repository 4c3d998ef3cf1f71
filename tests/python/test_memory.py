"""Scenes that do not fit into memory are refused before anything is built."""

import os
import subprocess
import sys

import pytest

import nicolson

# In a process of its own, with a limit on its address space.
BEGIN = """
import resource, sys
import nicolson

def small(megabytes):
    resource.setrlimit(resource.RLIMIT_AS, (megabytes << 20, resource.getrlimit(resource.RLIMIT_AS)[1]))

def refused(call, *words):
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    try:
        call()
    except nicolson.SceneError as error:
        assert all(word in str(error) for word in words), str(error)
        assert len(error.mistakes) == 1, error.mistakes
        assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 50_000
        return
    raise SystemExit("not refused")

scene = nicolson.Scene.from_text(sys.stdin.read())
"""

HUGE = """
scene.set("body.0.counts", [3200, 3200])
small(2000)
words = "1.02e7 particles need about ", " GB of memory, and 2.1 GB are available", "ignore_memory=True"
refused(lambda: nicolson.run(scene, out="out"), *words)
refused(lambda: nicolson.Simulation(scene), *words)
refused(scene.forecast, *words)
import os
assert os.listdir() == []
"""

RESTART = """
nicolson.Simulation(scene).checkpoint("here")
small(2000)
changes = {"body.0.counts": [3200, 3200]}
for go_on in (nicolson.restart, nicolson.Simulation.restart):
    refused(lambda: go_on("here", changes=changes, force=True), "1.02e7 particles", "ignore_memory=True")
"""

# The factor that is asked for would not fit, and it is not made before the first step.
IGNORED = """
scene.update({"body.0.counts": [200, 200], "linear.solver": "lu"})
small(1000)
refused(lambda: nicolson.Simulation(scene), "4.00e4 particles", "1.0 GB are available")
simulation = nicolson.Simulation(scene, ignore_memory=True)
assert simulation.particles == 40000
simulation.checkpoint("here")
refused(lambda: nicolson.Simulation.restart("here"), "4.00e4 particles")
assert nicolson.Simulation.restart("here", ignore_memory=True).particles == 40000
refused(scene.forecast, "4.00e4 particles")
assert scene.forecast(ignore_memory=True)["particles"] == 40000
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="limits as Linux has them")
@pytest.mark.parametrize("script", [HUGE, RESTART, IGNORED], ids=["huge", "restart", "ignored"])
def test_little_memory(solid, tmp_path, script):
    # Every thread reserves address space for itself.
    environment = os.environ | {"RAYON_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MALLOC_ARENA_MAX": "1"}
    command = [sys.executable, "-c", BEGIN + script]
    subprocess.run(command, input=solid.to_toml(), text=True, cwd=tmp_path, env=environment, check=True, timeout=120)


def test_limits_are_for_one_call(solid):
    """The scene itself keeps no limit."""
    assert nicolson.run(solid, ignore_memory=True).state.tobytes() == nicolson.run(solid).state.tobytes()
