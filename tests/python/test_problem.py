"""Rate, residual and tangent: against NumPy, against differences, against `step()`."""

import numpy as np
import pytest

import nicolson
from nicolson import Scene, SceneError

FLUID = """
title = "drop"
dimension = 2

[[body]]
counts = [6, 5]
shape.box = { lower = [0, 0], upper = [1.0, 0.8] }
material.hyperelastic_volumetric = { density = 1000, gamma = 7, wave_speed = 10 }

[stabilisation]
tau_v = 0.5
tau_p = 0.5

[initial]
velocity = ["0.5*sin(3*Y)", "0.5*sin(2*X)"]

[[boundary]]
select.where = "Y < 1e-9"
fix = ["y"]

[time]
scheme = "crank_nicolson"
step = 0.01
end = 0.1
"""

CUBE = """
title = "cube"
dimension = 3

[[body]]
counts = [3, 4, 3]
shape.box = { lower = [0, 0, 0], upper = [1.0, 1.5, 1.0] }
smoothing = 1.0
material.st_venant_kirchhoff = { density = 1000, youngs_modulus = 1e5, poissons_ratio = 0.2 }

[initial]
velocity = ["Y*Z", "0.2*X", "-X*Y"]

[time]
scheme = "midpoint"
step = 0.01
end = 0.1
"""


@pytest.fixture(params=["solid", "fluid", "cube", "conserving"])
def simulation(request, solid):
    if request.param in ("solid", "conserving"):
        scene = solid
    else:
        scene = Scene.from_text({"fluid": FLUID, "cube": CUBE}[request.param])
    if request.param == "conserving":
        scene.set("time.scheme", "energy_momentum")
    simulation = nicolson.Simulation(scene)
    simulation.step()
    return simulation


def somewhere(simulation, seed=1):
    """A point in general position, and a direction."""
    noise = np.random.default_rng(seed)
    y = simulation.unknowns()
    size = 0.02 * np.abs(y).max()
    return y + size * noise.standard_normal(y.size), size * noise.standard_normal(y.size)


def test_rate_of_two_particles_is_that_of_a_spring(pair):
    simulation = nicolson.Simulation(pair)
    kappa, density, length = 5.0, 2.0, 1.0
    assert simulation.masses.tolist() == [density * length / 2] * 2
    noise = np.random.default_rng(7)
    for _ in range(20):
        u, v = 0.1 * noise.standard_normal(2), noise.standard_normal(2)
        strain = (u[1] - u[0]) / length
        force = kappa * strain
        state = np.concatenate([u, v, np.full(2, 1 + strain)])
        rate = simulation.rate(state)
        assert rate[:2].tolist() == v.tolist()
        assert rate[2:4] == pytest.approx(np.array([force, -force]) / simulation.masses, rel=1e-12, abs=1e-14)


def test_force_is_the_gradient_of_the_energy(solid):
    """Without loads the internal energy changes by minus the power of the forces."""
    solid.update({"time.scheme": "rk4", "time.step": 1e-6, "time.end": 1.0})
    simulation = nicolson.Simulation(solid)
    simulation.step(1e-6)
    before, first = simulation.energies(), simulation.state
    simulation.step(2e-6)
    after, last = simulation.energies(), simulation.state
    middle, n = 0.5 * (first + last), simulation.particles
    acceleration = simulation.rate(middle)[2 * n : 4 * n].reshape(n, 2)
    velocity = middle[2 * n : 4 * n].reshape(n, 2)
    power = (simulation.masses[:, None] * velocity * acceleration).sum()
    stored = lambda energies: energies["internal"] + energies["hourglass"]  # noqa: E731
    assert stored(after) - stored(before) == pytest.approx(-power * 1e-6, rel=1e-6)
    assert after["kinetic"] - before["kinetic"] == pytest.approx(power * 1e-6, rel=1e-6)


def test_free_body_keeps_its_momenta():
    simulation = nicolson.Simulation(Scene.from_text(CUBE))
    simulation.step()
    n = simulation.particles
    force = simulation.masses[:, None] * simulation.rate()[3 * n : 6 * n].reshape(n, 3)
    size = np.abs(force).sum()
    assert size > 1
    assert np.abs(force.sum(axis=0)).max() < 1e-13 * size
    assert np.abs(np.cross(simulation.positions, force).sum(axis=0)).max() < 1e-13 * size


def test_residual_is_what_its_formula_says(solid):
    simulation = nicolson.Simulation(solid)
    simulation.step()
    n, dt, free = 2 * simulation.particles, 0.01, simulation.free
    y, _ = somewhere(simulation)
    state, rate = simulation.state, simulation.rate()
    s = 0.5 * dt
    base = state + s * rate
    end = base.copy()
    end[n : 2 * n] = 0.0
    velocity = np.zeros_like(simulation.velocity)
    velocity[free] = y
    end[n : 2 * n] = velocity.ravel()
    end[:n] = base[:n] + s * velocity.ravel()
    acceleration = simulation.rate(end, simulation.time + dt)[n : 2 * n].reshape(-1, 2)[free]
    expected = simulation.mass * (y - base[n : 2 * n].reshape(-1, 2)[free] - s * acceleration)
    residual = simulation.residual(y)
    assert np.abs(residual - expected).max() < 1e-12 * np.abs(expected).max()
    assert np.abs(simulation.end_state(y)[: 2 * n] - end[: 2 * n]).max() < 1e-15


def test_mass_belongs_to_the_unknowns(solid):
    simulation = nicolson.Simulation(solid)
    assert simulation.free.shape == (30, 2) and simulation.free.sum() == 50
    expected = np.broadcast_to(simulation.masses[:, None], (30, 2))[simulation.free]
    assert np.array_equal(simulation.mass, expected)
    assert simulation.unknowns().shape == simulation.mass.shape


def test_matrix_and_action_agree(simulation):
    sparse = pytest.importorskip("scipy.sparse")
    y, direction = somewhere(simulation)
    data, indices, indptr = simulation.tangent_csr(y)
    assert indices.dtype == indptr.dtype == np.int32 and data.dtype == np.float64
    matrix = sparse.csr_matrix((data, indices, indptr))
    assert matrix.shape == (y.size, y.size) and matrix.has_sorted_indices
    action = simulation.tangent_matvec(y, direction)
    assert np.linalg.norm(matrix @ direction - action) < 1e-12 * np.linalg.norm(action)


def test_residual_is_differentiable_with_this_tangent(simulation):
    y, direction = somewhere(simulation)
    start, slope = simulation.residual(y), simulation.tangent_matvec(y, direction)
    # The limiter of the upwinding bends within small jumps of a pair.
    scale = 0.01 if simulation.mass.size > simulation.free.sum() else 1.0
    steps = scale * np.array([1.0, 0.5, 0.25, 0.125])
    remainders = [np.linalg.norm(simulation.residual(y + e * direction) - start - e * slope) for e in steps]
    orders = np.log2(np.array(remainders[:-1]) / remainders[1:])
    assert np.all(np.abs(orders - 2) < 0.1), orders
    # The test can fail: a tangent from elsewhere leaves a first-order remainder.
    wrong = simulation.tangent_matvec(y + 3 * direction, direction)
    first = [np.linalg.norm(simulation.residual(y + e * direction) - start - e * wrong) for e in steps[-2:]]
    assert np.log2(first[0] / first[1]) < 1.5


@pytest.mark.parametrize(
    "changes",
    [
        {"time.scheme": "crank_nicolson"},
        {"time.scheme": "backward_euler"},
        {"time.scheme": "theta", "time.theta": 0.7},
        {"time.scheme": "midpoint"},
        {"time.scheme": "generalised_alpha", "time.spectral_radius": 0.6},
        {"time.scheme": "energy_momentum"},
        {"time.scheme": "static", "gravity": [0.0, -9.81]},
    ],
    ids=lambda changes: changes["time.scheme"],
)
def test_solution_is_that_of_the_step(solid, changes):
    """Newton's method with SciPy's factors finds the states of `step()`, three steps in a row."""
    linalg = pytest.importorskip("scipy.sparse.linalg")
    sparse = pytest.importorskip("scipy.sparse")
    solid.update(changes)
    simulation = nicolson.Simulation(solid)
    for _ in range(3):
        y = simulation.unknowns()
        for _ in range(12):
            tangent = sparse.csr_matrix(simulation.tangent_csr(y))
            y = y - linalg.spsolve(tangent.tocsc(), simulation.residual(y))
        found = simulation.end_state(y)
        start = simulation.state
        simulation.step()
        moved = np.abs(simulation.state - start).max()
        assert moved > 1e-4
        assert np.abs(found - simulation.state).max() < 1e-9 * moved


def test_dt_is_free(solid):
    simulation = nicolson.Simulation(solid)
    y = simulation.unknowns(0.02)
    default, own = simulation.residual(y), simulation.residual(y, 0.02)
    assert not np.allclose(default, own)
    assert np.array_equal(simulation.residual(y, dt=0.01), default)
    for dt in (0.0, -1.0, float("nan"), float("inf")):
        with pytest.raises(SceneError, match="positive"):
            simulation.residual(y, dt)


# An end that moves as time goes on.
MOVED = """
[[boundary]]
select.where = "X > 0.999"
displacement = { x = "0.05*sin(10*t)" }
"""

STAGES = {"tr_bdf2": 2, "sdirk3": 3, "crank_nicolson": 1, "rk4": 0}


@pytest.mark.parametrize("scheme", STAGES)
def test_number_of_stages(solid, scheme):
    solid.set("time.scheme", scheme)
    simulation = nicolson.Simulation(solid)
    assert simulation.stages == STAGES[scheme]
    y = np.zeros(50)
    too_many = [y] * max(STAGES[scheme], 1)
    words = "explicit" if scheme == "rk4" else f"has {STAGES[scheme]}: give the unknowns of at most {STAGES[scheme] - 1}"
    for call in (
        lambda: simulation.residual(y, 0.01, too_many),
        lambda: simulation.unknowns(0.01, too_many),
        lambda: simulation.end_state(y, 0.01, earlier=too_many),
        lambda: simulation.tangent_csr(y, 0.01, earlier=too_many),
    ):
        with pytest.raises(SceneError, match=words):
            call()
    if STAGES[scheme] > 1:
        with pytest.raises(SceneError, match="3 values for 50 unknowns"):
            simulation.residual(y, 0.01, [np.zeros(3)])
        with pytest.raises(nicolson.SimulationFailed):
            simulation.residual(y, 0.01, [np.full(50, np.nan)])
        # What failed is not taken for the problem that is posed.
        assert np.isfinite(simulation.residual(y, 0.01)).all()


@pytest.fixture(params=["tr_bdf2", "sdirk3"])
def staged(request, solid):
    """A simulation of a scheme of several stages, under way."""
    solid.set("time.scheme", request.param)
    simulation = nicolson.Simulation(solid)
    simulation.step()
    return simulation


def newton(simulation, earlier, dt=None):
    """The solution of a stage, by SciPy's factors of our tangent."""
    linalg, sparse = pytest.importorskip("scipy.sparse.linalg"), pytest.importorskip("scipy.sparse")
    y = simulation.unknowns(dt, earlier)
    for _ in range(12):
        tangent = sparse.csr_matrix(simulation.tangent_csr(y, dt, earlier))
        y = y - linalg.spsolve(tangent.tocsc(), simulation.residual(y, dt, earlier))
    return y


@pytest.mark.parametrize("text", ["solid", "moved", "fluid", "cube"])
@pytest.mark.parametrize("scheme", ["tr_bdf2", "sdirk3"])
def test_stage_after_stage_is_the_step(solid, text, scheme):
    scene = solid if text in ("solid", "moved") else Scene.from_text({"fluid": FLUID, "cube": CUBE}[text])
    if text == "moved":
        scene = Scene.from_text(scene.to_toml() + MOVED)
    scene.update({"time.scheme": scheme, "newton.relative_tolerance": 1e-12})
    simulation = nicolson.Simulation(scene)
    for _ in range(3):
        earlier = []
        while len(earlier) < simulation.stages:
            earlier.append(newton(simulation, earlier))
        *earlier, last = earlier
        found, start = simulation.end_state(last, earlier=earlier), simulation.state
        simulation.step()
        moved = np.abs(simulation.state - start).max()
        assert moved > 1e-4
        assert np.abs(found - simulation.state).max() < 1e-9 * moved


def test_krylov_solver_finds_the_stages(staged):
    """Without a matrix: SciPy's own method on the residual alone."""
    optimize = pytest.importorskip("scipy.optimize")
    earlier = []
    for _ in range(staged.stages):
        scale = staged.mass.max()
        fun = lambda y: staged.residual(y, earlier=earlier) / scale  # noqa: B023, E731
        earlier.append(optimize.newton_krylov(fun, staged.unknowns(earlier=earlier), f_tol=1e-12))
    found, start = staged.end_state(earlier.pop(), earlier=earlier), staged.state
    staged.step()
    assert np.abs(found - staged.state).max() < 1e-9 * np.abs(staged.state - start).max()


def test_tangent_of_every_stage_is_the_derivative(staged):
    noise, earlier = np.random.default_rng(3), []
    for stage in range(staged.stages):
        y = staged.unknowns(earlier=earlier)
        size = 0.02 * np.abs(y).max()
        y, direction = y + size * noise.standard_normal(y.size), size * noise.standard_normal(y.size)
        slope = staged.tangent_matvec(y, direction, earlier=earlier)
        e = 1e-4
        ends = [staged.residual(y + sign * e * direction, earlier=earlier) for sign in (1, -1)]
        difference = (ends[0] - ends[1]) / (2 * e)
        assert np.linalg.norm(difference - slope) < 1e-7 * np.linalg.norm(slope), stage
        # The test can fail: another step has another tangent.
        other = staged.tangent_matvec(y, direction, 0.011, earlier)
        assert np.linalg.norm(difference - other) > 1e-4 * np.linalg.norm(slope)
        # Any point will do for what comes after.
        earlier.append(y)


def test_stages_are_what_their_formula_says(staged):
    """The residual from rates alone, at points that solve nothing."""
    noise, n, dt, free = np.random.default_rng(5), 2 * staged.particles, 0.01, staged.free
    if staged.stages == 2:
        gamma = 2 - np.sqrt(2)
        shift, nodes = gamma / 2, [gamma, 1]
        weights = [[gamma / 2], [np.sqrt(2) / 4, np.sqrt(2) / 4]]
        rates = [staged.rate()]
    else:
        g = 0.435866521508459
        shift, nodes = g, [g, (1 + g) / 2, 1]
        weights = [[], [(1 - g) / 2], [-1.5 * g * g + 4 * g - 0.25, 1.5 * g * g - 5 * g + 1.25]]
        rates = []
    state, s, earlier = staged.state, shift * dt, []
    for node, row in zip(nodes, weights, strict=True):
        y = staged.unknowns(dt, earlier)
        y = y + 0.02 * np.abs(y).max() * noise.standard_normal(y.size)
        base = state + dt * sum((w * rate for w, rate in zip(row, rates, strict=True)), np.zeros_like(state))
        velocity = np.zeros_like(staged.velocity)
        velocity[free] = y
        at = base.copy()
        at[n : 2 * n] = velocity.ravel()
        at[:n] = np.where(free.ravel(), base[:n] + s * velocity.ravel(), state[:n])
        reached = staged.end_state(y, dt, earlier)
        assert np.abs(reached[: 2 * n] - at[: 2 * n]).max() < 1e-14
        rate = staged.rate(at, staged.time + node * dt)
        expected = staged.mass * (y - (base + s * rate)[n : 2 * n].reshape(-1, 2)[free])
        residual = staged.residual(y, dt, earlier)
        assert np.abs(residual - expected).max() < 1e-11 * np.abs(expected).max()
        rates.append(rate)
        earlier.append(y)


def test_stages_leave_the_simulation_alone(solid):
    solid.set("time.scheme", "sdirk3")
    watched, alone = nicolson.Simulation(solid), nicolson.Simulation(solid)
    while not watched.finished:
        y = watched.unknowns(0.01)
        watched.tangent_csr(y, 0.01, [y])
        watched.end_state(y, 0.01, [y, y])
        watched.step()
        alone.step()
    assert watched.state.tobytes() == alone.state.tobytes()


def test_wrong_lengths_and_states(solid):
    simulation = nicolson.Simulation(solid)
    y = simulation.unknowns()
    for call in (
        lambda: simulation.residual(y[1:]),
        lambda: simulation.tangent_matvec(y, y[1:]),
        lambda: simulation.tangent_csr(np.zeros(0)),
        lambda: simulation.rate(np.zeros(3)),
        lambda: simulation.end_state(y[1:]),
    ):
        with pytest.raises(ValueError, match="values"):
            call()
    with pytest.raises((TypeError, ValueError)):
        simulation.residual("nonsense")
    with pytest.raises(nicolson.SimulationFailed) as raised:
        simulation.residual(np.full(y.size, np.nan))
    assert raised.value.time == pytest.approx(0.01)
    with pytest.raises(nicolson.SimulationFailed):
        simulation.rate(np.full(150, np.nan))
    simulation.step()
    assert simulation.time == 0.01


def test_anything_that_is_numbers(solid):
    simulation = nicolson.Simulation(solid)
    y = simulation.unknowns()
    expected = simulation.residual(y)
    for same in (list(y), y.reshape(25, 2), np.repeat(y, 2)[::2], y[::-1][::-1]):
        assert np.array_equal(simulation.residual(same), expected)
