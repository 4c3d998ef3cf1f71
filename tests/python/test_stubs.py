"""The type stubs say what is there."""

import ast
import inspect
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


def parameters(function):
    """Names in order, those by name only after `*`."""
    arguments = function.args
    names = [argument.arg for argument in [*arguments.posonlyargs, *arguments.args]]
    return [name for name in names if name not in ("self", "cls")] + [a.arg for a in arguments.kwonlyargs]


@pytest.mark.parametrize("name", ["Scene", "Simulation"])
def test_parameters(classes, name):
    stubs = {node.name: node for node in classes[name].body if isinstance(node, ast.FunctionDef)}
    checked = 0
    for member, stub in stubs.items():
        value = getattr(nicolson, name) if member == "__new__" else getattr(getattr(nicolson, name), member)
        if callable(value):
            there = [p for p in inspect.signature(value).parameters if p != "self"]
            assert parameters(stub) == there, member
            checked += 1
    assert checked > 5


def test_functions():
    stubs = {node.name: node for node in ast.parse(STUBS.read_text(encoding="utf-8")).body if hasattr(node, "args")}
    assert set(stubs) == {"run", "restart"}
    for name, stub in stubs.items():
        assert parameters(stub) == list(inspect.signature(getattr(nicolson, name)).parameters)


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
