from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from typing import Any, TypedDict, final

from numpy import bool_, float64, int32, int64
from numpy.typing import ArrayLike, NDArray

__version__: str

class Mistake(TypedDict):
    origin: str
    line: int | None
    column: int | None
    message: str
    remedy: str

class Tried(TypedDict):
    step: float
    cause: str

class SceneError(ValueError):
    mistakes: list[Mistake]

class SimulationFailed(RuntimeError):
    time: float
    tries: list[Tried]
    result: RunResult | None

class Forecast(TypedDict):
    particles: int
    unknowns: int
    entries: int
    mean_neighbours: float
    memory: float
    explicit_step_limit: float
    step: float
    steps: float
    linear: bool

class Progress(TypedDict):
    time: float
    end: float
    step: float
    newton_iterations: int
    rejected: int
    explicit_step_limit: float

class Step(TypedDict):
    time: float
    step: float
    newton_iterations: int
    rejected: int

class Energies(TypedDict):
    kinetic: float
    internal: float
    hourglass: float

@final
class Scene:
    @staticmethod
    def from_toml(path: str | PathLike[str]) -> Scene: ...
    @staticmethod
    def from_text(text: str, name: str = "scene", base: str | PathLike[str] | None = None) -> Scene: ...
    def set(self, key: str, value: Any) -> None: ...
    def update(self, changes: Mapping[str, Any]) -> None: ...
    def to_toml(self) -> str: ...
    def copy(self) -> Scene: ...
    def forecast(self, *, ignore_memory: bool = False) -> Forecast: ...
    @property
    def title(self) -> str: ...
    @property
    def dimension(self) -> int: ...

@final
class RunResult:
    @property
    def report(self) -> dict[str, Any]: ...
    @property
    def history(self) -> dict[str, NDArray[float64]]: ...
    @property
    def probes(self) -> dict[str, NDArray[float64]]: ...
    @property
    def state(self) -> NDArray[float64]: ...
    @property
    def out(self) -> PathLike[str] | None: ...
    @property
    def status(self) -> str: ...
    @property
    def time(self) -> float: ...
    @property
    def displacement(self) -> NDArray[float64]: ...
    @property
    def velocity(self) -> NDArray[float64]: ...
    @property
    def volume_ratio(self) -> NDArray[float64]: ...

def run(
    scene: Scene,
    out: str | PathLike[str] | None = None,
    callback: Callable[[Progress], object] | None = None,
    threads: int | None = None,
    *,
    ignore_memory: bool = False,
) -> RunResult: ...
def restart(
    path: str | PathLike[str],
    out: str | PathLike[str] | None = None,
    callback: Callable[[Progress], object] | None = None,
    threads: int | None = None,
    *,
    scene: Scene | None = None,
    changes: Mapping[str, Any] | None = None,
    force: bool = False,
    ignore_memory: bool = False,
) -> RunResult: ...
@final
class Simulation:
    def __new__(cls, scene: Scene, threads: int | None = None, *, ignore_memory: bool = False) -> Simulation: ...
    @staticmethod
    def restart(
        path: str | PathLike[str],
        threads: int | None = None,
        *,
        scene: Scene | None = None,
        changes: Mapping[str, Any] | None = None,
        force: bool = False,
        ignore_memory: bool = False,
    ) -> Simulation: ...
    def checkpoint(self, path: str | PathLike[str]) -> None: ...
    def step(self, target: float | None = None) -> Step: ...
    def run_until(self, time: float, callback: Callable[[Simulation], object] | None = None) -> int: ...
    @property
    def time(self) -> float: ...
    @property
    def end(self) -> float: ...
    @property
    def finished(self) -> bool: ...
    @property
    def state(self) -> NDArray[float64]: ...
    @property
    def displacement(self) -> NDArray[float64]: ...
    @property
    def velocity(self) -> NDArray[float64]: ...
    @property
    def volume_ratio(self) -> NDArray[float64]: ...
    @property
    def reference_positions(self) -> NDArray[float64]: ...
    @property
    def positions(self) -> NDArray[float64]: ...
    @property
    def masses(self) -> NDArray[float64]: ...
    @property
    def free(self) -> NDArray[bool_]: ...
    @property
    def particles(self) -> int: ...
    @property
    def dimension(self) -> int: ...
    @property
    def scheme(self) -> str: ...
    @property
    def stages(self) -> int: ...
    @property
    def explicit_step_limit(self) -> float: ...
    @property
    def warnings(self) -> list[str]: ...
    def energies(self) -> Energies: ...
    def rate(self, state: ArrayLike | None = None, time: float | None = None) -> NDArray[float64]: ...
    def unknowns(
        self, dt: float | None = None, earlier: Sequence[ArrayLike] | None = None
    ) -> NDArray[float64]: ...
    def residual(
        self, unknowns: ArrayLike, dt: float | None = None, earlier: Sequence[ArrayLike] | None = None
    ) -> NDArray[float64]: ...
    def tangent_matvec(
        self,
        unknowns: ArrayLike,
        vector: ArrayLike,
        dt: float | None = None,
        earlier: Sequence[ArrayLike] | None = None,
    ) -> NDArray[float64]: ...
    def tangent_csr(
        self, unknowns: ArrayLike, dt: float | None = None, earlier: Sequence[ArrayLike] | None = None
    ) -> tuple[NDArray[float64], NDArray[int32] | NDArray[int64], NDArray[int32] | NDArray[int64]]: ...
    def end_state(
        self, unknowns: ArrayLike, dt: float | None = None, earlier: Sequence[ArrayLike] | None = None
    ) -> NDArray[float64]: ...
    @property
    def mass(self) -> NDArray[float64]: ...
