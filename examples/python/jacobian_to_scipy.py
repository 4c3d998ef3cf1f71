# %% [markdown]
# # The analytic Jacobian in SciPy
#
# One implicit step of a bending block is a nonlinear problem `R(y) = 0` in the velocities at its end. nicolson has a
# solver of its own, `simulation.step()`. Here SciPy solves the same problem with our residual and our tangent, in two
# ways, and both must arrive at the state of `step()`.
#
#     pip install . scipy
#     python examples/python/jacobian_to_scipy.py

# %%
import numpy as np
import scipy.optimize
import scipy.sparse
import scipy.sparse.linalg

import nicolson

scene = nicolson.Scene.from_text("""
    title = "bending block"
    dimension = 2
    gravity = [0, -9.81]

    [[body]]
    counts = [21, 6]
    shape.box = { lower = [0, 0], upper = [2.0, 0.5] }
    smoothing = 1.0
    material.neo_hookean = { density = 1000, youngs_modulus = 3e5, poissons_ratio = 0.3 }

    [[boundary]]
    select.where = "X < 1e-9"
    fix = ["x", "y"]

    [time]
    scheme = "crank_nicolson"
    step = 0.05
    end = 1.0

    [newton]
    relative_tolerance = 1e-12
""")
simulation = nicolson.Simulation(scene)
simulation.run_until(0.3)
print(simulation)
print(f"step {0.05 / simulation.explicit_step_limit:.0f} times the explicit limit")

# %% [markdown]
# ## A dense Jacobian: `scipy.optimize.root(method="hybr")`
#
# Fine for a few hundred unknowns. The residual is divided by the mass, so that its entries are velocities.

# %%
mass = simulation.mass
start = simulation.unknowns()


def residual(y):
    return simulation.residual(y) / mass


def tangent(y):
    return scipy.sparse.csr_matrix(simulation.tangent_csr(y))


def jacobian(y):
    return tangent(y).toarray() / mass[:, None]


solution = scipy.optimize.root(residual, start, jac=jacobian, method="hybr", options={"xtol": 1e-13})
print(f"hybr: {solution.nfev} residuals, {solution.njev} Jacobians, |R| = {np.abs(residual(solution.x)).max():.1e} m/s")

# %% [markdown]
# ## A Krylov method with our tangent as preconditioner
#
# `newton_krylov` takes directional differences of the residual; the factors of one tangent, from the start of the step,
# make it converge in a few products. (With `simulation.tangent_matvec` the products are exact, and no matrix is needed.)

# %%
factors = scipy.sparse.linalg.splu(tangent(start).tocsc())
inverse = scipy.sparse.linalg.LinearOperator((start.size, start.size), matvec=lambda v: factors.solve(mass * v))
evaluations = 0


def counted(y):
    global evaluations
    evaluations += 1
    return residual(y)


krylov = scipy.optimize.newton_krylov(counted, start, inner_M=inverse, f_tol=1e-11, method="lgmres")
print(f"newton_krylov: {evaluations} residuals, |R| = {np.abs(residual(krylov)).max():.1e} m/s")

# %% [markdown]
# ## The same state as `step()`

# %%
by_hybr, by_krylov = simulation.end_state(solution.x), simulation.end_state(krylov)
before = simulation.state
report = simulation.step()
moved = np.abs(simulation.state - before).max()
distance_hybr = np.abs(by_hybr - simulation.state).max() / moved
distance_krylov = np.abs(by_krylov - simulation.state).max() / moved
print(f"step(): {report['newton_iterations']} Newton iterations")
print(f"distance to its state over the change in the step: hybr {distance_hybr:.1e}, newton_krylov {distance_krylov:.1e}")
assert distance_hybr < 1e-9 and distance_krylov < 1e-9
