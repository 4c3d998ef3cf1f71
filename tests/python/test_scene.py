"""Scenes: round trip, changes, mistakes."""

import copy
import pathlib
import pickle

import numpy as np
import pytest

import nicolson
from nicolson import Scene, SceneError


def test_text_comes_back_as_it_was(solid):
    text = solid.to_toml()
    again = Scene.from_text(text)
    assert again.to_toml() == text
    assert (again.title, again.dimension) == ("block", 2)


def test_every_example_survives_the_round_trip(examples):
    scenes = sorted(examples.glob("*.toml"))
    assert len(scenes) > 10
    for path in scenes:
        scene = Scene.from_toml(path)
        assert scene.to_toml() == path.read_text(encoding="utf-8")
        assert Scene.from_toml(str(path)).dimension in (1, 2, 3)


def test_changes_keep_the_comments_and_the_rest(examples):
    scene = Scene.from_toml(examples / "piston-hyperelastic.toml")
    before = scene.to_toml()
    scene.set("body.0.spacing", 0.125)
    assert scene.to_toml() == before.replace("spacing = 0.25", "spacing = 0.125")
    assert scene.forecast()["particles"] == 21 * 21


@pytest.mark.parametrize(
    ("key", "value", "written"),
    [
        ("time.step", np.float64(0.005), "step = 0.005"),
        ("body.0.counts", (4, np.int64(3)), "counts = [4, 3]"),
        ("body.0.counts", np.array([4, 3]), "counts = [4, 3]"),
        ("output.plots", True, "plots = true"),
        ("title", 'quoted "text" = 1', "quoted"),
        ("title", "0.05", '"0.05"'),
        ("boundary.0.select", {"where": "Y < 0.1"}, 'where = "Y < 0.1"'),
        ("body.0.shape.box.upper", [1, 0.5], "upper = [1, 0.5]"),
    ],
)
def test_values_are_written_as_toml(solid, key, value, written):
    solid.set(key, value)
    assert written in solid.to_toml()
    assert Scene.from_text(solid.to_toml()).to_toml() == solid.to_toml()


def test_numbers_keep_their_bits(solid):
    for number in (0.1 + 0.2, 1e-300, 1 / 3, 5e-324):
        solid.set("gravity", [0.0, number])
        line = next(line for line in solid.to_toml().splitlines() if line.startswith("gravity"))
        assert float(line.split(",")[1].rstrip("] ")) == number


def test_update_changes_all_or_nothing(solid):
    before = solid.to_toml()
    with pytest.raises(SceneError):
        solid.update({"time.end": 0.2, "time.step": -1})
    assert solid.to_toml() == before
    solid.update({"time.end": 0.2, "time.step": 0.02})
    assert "end = 0.2" in solid.to_toml()


def test_copies_are_independent(solid):
    for other in (solid.copy(), copy.copy(solid), copy.deepcopy(solid), pickle.loads(pickle.dumps(solid))):
        assert other.to_toml() == solid.to_toml()
        other.set("time.end", 0.3)
        assert other.to_toml() != solid.to_toml()


def test_a_pickled_scene_finds_its_files(examples):
    scene = pickle.loads(pickle.dumps(Scene.from_toml(examples / "bracket.toml")))
    assert scene.forecast()["particles"] > 100


def test_mistakes_are_located_and_complete():
    text = "dimension = 2\n[time]\nstep = -1\nend = 1\nschema = 3\n"
    with pytest.raises(SceneError) as raised:
        Scene.from_text(text, "wrong.toml")
    assert isinstance(raised.value, ValueError)
    message = str(raised.value)
    assert "wrong.toml:" in message and "help:" in message and "^" in message
    for mistake in raised.value.mistakes:
        assert set(mistake) == {"origin", "line", "column", "message", "remedy"}
        assert mistake["line"] in range(1, 6) and mistake["message"] in message


def test_a_wrong_change_says_which(solid):
    with pytest.raises(SceneError, match="time.step=-1") as raised:
        solid.set("time.step", -1)
    assert len(raised.value.mistakes) == 1
    assert "step = 0.01" in solid.to_toml()
    with pytest.raises(SceneError):
        solid.set("body.7.spacing", 1.0)
    with pytest.raises(SceneError):
        solid.set("", 1.0)


def test_what_only_the_particles_show(solid):
    solid.set("boundary.0.select.where", "X > 99")
    for use in (nicolson.run, nicolson.Simulation, Scene.forecast):
        with pytest.raises(SceneError) as raised:
            use(solid)
        assert raised.value.mistakes


@pytest.mark.parametrize("value", [None, object(), 1j, {1: 2}, 2**70])
def test_values_without_a_place(solid, value):
    before = solid.to_toml()
    with pytest.raises((TypeError, OverflowError)):
        solid.set("title", value)
    assert solid.to_toml() == before


def test_endless_nesting_is_refused(solid):
    endless = []
    endless.append(endless)
    with pytest.raises(ValueError, match="nested"):
        solid.set("title", endless)


def test_missing_file():
    with pytest.raises(FileNotFoundError):
        Scene.from_toml(pathlib.Path("no") / "such.toml")


def test_forecast(solid):
    forecast = solid.forecast()
    assert forecast["particles"] == 30
    assert forecast["unknowns"] == 50  # five of thirty particles are clamped
    assert forecast["steps"] == 10
    assert 0 < forecast["explicit_step_limit"] < 0.1
