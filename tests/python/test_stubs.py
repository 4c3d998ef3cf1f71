"""The type stubs say what is there."""

import ast
import pathlib

import pytest

import nicolson
from nicolson import _nicolson

STUBS = pathlib.Path(nicolson.__file__).parent / "_nicolson.pyi"


def public(names):
    return {name for name in names if not name.startswith("_")}


@pytest.fixture
def classes():
    tree = ast.parse(STUBS.read_text(encoding="utf-8"))
    return {node.name: node for node in tree.body if isinstance(node, ast.ClassDef)}


def test_package_is_typed():
    assert (STUBS.parent / "py.typed").exists()


@pytest.mark.parametrize("name", ["Scene", "RunResult", "Simulation"])
def test_members(classes, name):
    members = {node.name for node in classes[name].body if isinstance(node, ast.FunctionDef)}
    assert public(members) == public(vars(getattr(nicolson, name)))


def test_module(classes):
    for name in public(nicolson.__all__):
        assert getattr(nicolson, name) is getattr(_nicolson, name)
        assert getattr(nicolson, name).__doc__
    assert public(vars(_nicolson)) == public(nicolson.__all__)
    assert {"SceneError", "SimulationFailed"} <= set(classes)


def test_keys(classes, solid):
    def keys(name):
        return {node.target.id for node in classes[name].body if isinstance(node, ast.AnnAssign)}

    heard = []
    nicolson.run(solid, callback=lambda step: heard.append(step) or True)
    simulation = nicolson.Simulation(solid)
    assert keys("Forecast") == set(solid.forecast())
    assert keys("Progress") == set(heard[0])
    assert keys("Step") == set(simulation.step())
    assert keys("Energies") == set(simulation.energies())
