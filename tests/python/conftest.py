"""Scenes that the tests share: small, in every kind that matters."""

import os
import pathlib
import signal

import pytest

import nicolson

# A shell that starts its work in the background has SIGINT ignored, which Python then leaves as it is.
signal.signal(signal.SIGINT, signal.default_int_handler)

ROOT = pathlib.Path(__file__).resolve().parents[2]

SOLID = """
title = "block"
dimension = 2

[[body]]
counts = [6, 5]
shape.box = { lower = [0, 0], upper = [1.0, 0.8] }
smoothing = 1.0
material.neo_hookean = { density = 1000, youngs_modulus = 1e5, poissons_ratio = 0.3 }

[initial]
velocity = ["0.5*Y", "sin(2*X)"]

[[boundary]]
select.where = "X < 1e-9"
fix = ["x", "y"]

[time]
scheme = "crank_nicolson"
step = 0.01
end = 0.1

[newton]
relative_tolerance = 1e-12

[output]
plots = false

[[probe]]
name = "tip"
at = [1.0, 0.4]
"""

PAIR = """
title = "pair"
dimension = 1

[[body]]
counts = [2]
shape.box = { lower = [0], upper = [1] }
smoothing = 1.0
weights = "single"
hourglass = 0
material.linear_volumetric = { density = 2, bulk_modulus = 5 }

[time]
scheme = "velocity_verlet"
step = 0.01
end = 1
"""


@pytest.fixture
def solid():
    return nicolson.Scene.from_text(SOLID, "solid.toml")


@pytest.fixture
def pair():
    return nicolson.Scene.from_text(PAIR, "pair.toml")


@pytest.fixture
def examples():
    return ROOT / "examples"


@pytest.fixture
def binary():
    """The command line program of the same build."""
    path = os.environ.get("NICOLSON_BINARY")
    if not path:
        pytest.skip("NICOLSON_BINARY names no nicolson program to compare with")
    return path
