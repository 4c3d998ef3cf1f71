"""Implicit Total Lagrangian SPH: scenes, runs, states as NumPy arrays, residual and tangent for SciPy.

    import nicolson

    scene = nicolson.Scene.from_toml("examples/piston-hyperelastic.toml")
    scene.set("time.end", 1.0)
    result = nicolson.run(scene)                  # result.report, .history, .probes, .displacement

    simulation = nicolson.Simulation(scene)
    while not simulation.finished:
        simulation.step()                         # simulation.displacement, .velocity, .volume_ratio: views

    y = simulation.unknowns()                     # the next step as a nonlinear problem
    r = simulation.residual(y)
    tangent = scipy.sparse.csr_matrix(simulation.tangent_csr(y))

    simulation.checkpoint("here.safetensors")     # and go on later, to the same bits
    simulation = nicolson.Simulation.restart("here.safetensors")
    result = nicolson.restart("results/piston", changes={"time.end": 2.0})

SI units. Computing releases the interpreter's lock and uses all cores; a process that has computed cannot be forked: use
`multiprocessing` with the start method "spawn" (a `Scene` can be pickled).
"""

from ._nicolson import RunResult, Scene, SceneError, Simulation, SimulationFailed, __version__, restart, run

__all__ = ["RunResult", "Scene", "SceneError", "Simulation", "SimulationFailed", "__version__", "restart", "run"]
