"""Views of the state: shared memory, read-only, valid whatever comes after."""

import gc
import threading
import weakref

import numpy as np
import pytest

import nicolson


def address(array):
    return array.__array_interface__["data"][0]


def test_parts_lie_side_by_side_in_one_memory(solid):
    simulation = nicolson.Simulation(solid)
    n = simulation.particles * 2
    state = simulation.state
    assert state.shape == (5 * simulation.particles,)
    assert address(simulation.displacement) == address(state)
    assert address(simulation.velocity) == address(state) + 8 * n
    assert address(simulation.volume_ratio) == address(state) + 16 * n
    for part in (simulation.displacement, simulation.velocity, simulation.volume_ratio):
        assert np.shares_memory(part, state) and not part.flags.owndata
    assert simulation.displacement.shape == simulation.velocity.shape == (30, 2)
    assert simulation.volume_ratio.shape == (30,)


def test_looking_allocates_nothing(solid):
    solid.set("body.0.counts", [60, 50])
    simulation = nicolson.Simulation(solid)
    addresses = {address(simulation.displacement) for _ in range(100)}
    assert len(addresses) == 1


def test_views_cannot_be_written(solid):
    simulation = nicolson.Simulation(solid)
    views = (simulation.state, simulation.displacement, simulation.reference_positions, simulation.masses)
    for view in views:
        with pytest.raises(ValueError, match="read-only"):
            view[0] = 1.0
        with pytest.raises(ValueError, match="WRITEABLE"):
            view.flags.writeable = True
        base = view
        while isinstance(base.base, np.ndarray):
            base = base.base
            with pytest.raises(ValueError, match="WRITEABLE"):
                base.flags.writeable = True


def test_a_view_keeps_its_moment(solid):
    simulation = nicolson.Simulation(solid)
    view = simulation.displacement
    copy = view.copy()
    for _ in range(5):
        simulation.step()
    assert np.array_equal(view, copy)
    assert not np.array_equal(simulation.displacement, copy)
    assert not np.shares_memory(simulation.displacement, view)


def test_a_view_outlives_the_simulation(solid):
    simulation = nicolson.Simulation(solid)
    simulation.step()
    view = simulation.velocity
    copy = view.copy()
    gone = weakref.ref(view.base)
    del simulation
    gc.collect()
    junk = [np.full(view.size, float(i)) for i in range(1000)]
    assert np.array_equal(view, copy) and len(junk) == 1000
    del view
    gc.collect()
    assert gone() is None


def test_looking_does_not_change_the_bits(solid):
    watched, alone = nicolson.Simulation(solid), nicolson.Simulation(solid)
    kept = []
    while not watched.finished:
        kept.append(watched.state)
        watched.step()
        alone.step()
        watched.residual(watched.unknowns(0.01), 0.01)
        watched.tangent_csr(watched.unknowns(0.01), 0.01)
        watched.rate()
    assert watched.state.tobytes() == alone.state.tobytes()
    assert len({view.tobytes() for view in kept}) == len(kept)


def test_positions(solid):
    simulation = nicolson.Simulation(solid)
    simulation.step()
    expected = simulation.reference_positions + simulation.displacement
    assert np.array_equal(simulation.positions, expected)
    assert simulation.masses.sum() == pytest.approx(1000 * 0.8, rel=1e-13)


def test_threads_take_turns(solid):
    solid.set("time.end", 0.4)
    alone = nicolson.Simulation(solid)
    while not alone.finished:
        alone.step()
    shared, errors, sums = nicolson.Simulation(solid), [], []

    def work():
        try:
            for _ in range(10):
                shared.step()
                sums.append(shared.displacement.sum())
                shared.energies()
        except Exception as error:  # noqa: BLE001
            errors.append(error)

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not errors and len(sums) == 40
    assert shared.time == alone.time and shared.state.tobytes() == alone.state.tobytes()


def test_number_of_threads_changes_no_bit(solid):
    states = set()
    for threads in (1, 2, 3, None):
        simulation = nicolson.Simulation(solid, threads=threads)
        simulation.run_until(0.05)
        states.add(simulation.state.tobytes())
    assert len(states) == 1


def test_run_until(solid):
    simulation = nicolson.Simulation(solid)
    assert simulation.run_until(0.025) == 3 and simulation.time == 0.025
    assert simulation.run_until(0.02) == 0
    seen = []
    steps = simulation.run_until(0.1, callback=lambda this: seen.append(this.displacement) or len(seen) == 2)
    assert steps == len(seen) == 2
    with pytest.raises(ValueError, match="later target"):
        simulation.step(0.01)
    with pytest.raises(ValueError, match="later target"):
        simulation.step(float("nan"))
    simulation.run_until(0.1)
    assert simulation.finished
    with pytest.raises(ValueError, match="later target"):
        simulation.step()
    assert simulation.step(0.2)["time"] == pytest.approx(0.11)
