"""Shapers from the user's own files."""

import importlib.util
import inspect
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from tvist_controller.api.line import MotionLimits, paper_payload
from tvist_lab.recordings import Floats
from tvist_lab.study.line import PAPER
from tvist_lab.study.method import SampleMethod, Task
from tvist_lab.study.recipes import Recipe
from tvist_lab.study.shaping import ShaperFaultError
from tvist_plant.plant import PERIOD
from tvist_plant.user_file import named
from tvist_protocol.values import Payload
from tvist_shaping.estimators.base import Estimator

MODES = 4  # number of modes that a shaper from a file receives


class CandidateError(ValueError):
    """A file contains no shaper; the message tells why."""


@dataclass(frozen=True)
class TickInfo:
    """Information that a shaper gets at every tick."""

    period: float  # tick [s]
    joints: int  # number of joints of the arm; `q_ref` has as many entries
    limits: MotionLimits
    """Limits of the reference, for every joint: velocity [rad/s], acceleration [rad/s²], jerk [rad/s³]."""
    payload: Payload  # declared payload: mass [kg], com [m], inertia [kg m²]
    robot: str  # model of the arm
    f_d: Floats
    """Damped frequencies of the lowest modes, estimated at the last shaped reference [Hz], shape (4,)."""
    zeta: Floats  # damping ratios of the same modes [-], shape (4,)


@dataclass(frozen=True)
class FromFile(SampleMethod):
    """A shaper from the user's own file."""

    path: str
    recipe: Recipe
    name: str
    label: str

    def stepper(self, task: Task) -> "UserShaper":
        """Return a new shaper, reset."""
        description, move = task.description, task.move
        estimator = self.recipe.estimator(description, move.mass, MODES)
        info = TickInfo(
            period=PERIOD,
            joints=description.joints,
            limits=PAPER,
            payload=paper_payload(description, move.mass),
            robot=description.robot.model,
            f_d=np.zeros(MODES),
            zeta=np.zeros(MODES),
        )
        try:
            made = load_shaper(Path(self.path))()
        except CandidateError:
            raise
        except Exception as error:
            raise ShaperFaultError(f"raises {named(error)} in its constructor") from error
        return UserShaper(made, info, estimator, np.array(move.start), np.array(description.limits.position))


class UserShaper:
    """A user's shaper in operation."""

    def __init__(self, made: Any, info: TickInfo, estimator: Estimator, start: Floats, reach: Floats) -> None:
        self._made, self._info, self._estimator, self._reach = made, info, estimator, reach
        self._q_star, self._tick = start.copy(), 0
        if hasattr(made, "reset"):
            try:
                made.reset(start.copy())
            except Exception as error:
                raise ShaperFaultError(f"its reset raises {named(error)}") from error

    @property
    def delay(self) -> float | None:
        """The declared delay [s]; None if there is none."""
        try:
            declared = getattr(self._made, "delay", None)
        except Exception as error:
            raise ShaperFaultError(f"raises {named(error)} when asked for its delay") from error
        return float(declared) if isinstance(declared, int | float | np.floating) else None

    def step(self, q: Floats) -> Floats:
        """Shape one sample."""
        f_d, zeta = self._estimator.estimate(self._q_star)
        info = replace(self._info, f_d=f_d.copy(), zeta=zeta.copy())
        where = f"at tick {self._tick}"
        try:
            given = self._made.step(q.copy(), info)
        except Exception as error:
            raise ShaperFaultError(f"raises {named(error)} {where}") from error
        try:
            q_star = np.array(given, dtype=float)
        except (TypeError, ValueError):
            raise ShaperFaultError(
                f"gives {type(given).__name__} {where}: must be {q.size} numbers"
            ) from None
        if q_star.shape != q.shape:
            raise ShaperFaultError(f"gives shape {q_star.shape} {where}: must be {q.shape}")
        if not np.isfinite(q_star).all():
            raise ShaperFaultError(f"gives {q_star.tolist()} {where}: must be finite")
        if (np.abs(q_star) > self._reach).any():
            joint = int(np.argmax(np.abs(q_star) - self._reach))
            raise ShaperFaultError(
                f"gives {q_star[joint]:g} rad for joint {joint + 1} {where}: "
                f"must be within ±{self._reach[joint]:.4g} rad"
            )
        self._q_star, self._tick = q_star, self._tick + 1
        return q_star.copy()


_loaded: dict[Path, Callable[[], Any]] = {}


def load_shaper(path: Path) -> Callable[[], Any]:
    """Return a function creating the file's shaper: the class with `step` or a function returning the module.

    The file is run once in each process, so its module's state persists from motion to motion. Raises
    CandidateError if the file cannot be run, or does not contain exactly one shaper.
    """
    file = path.resolve()
    if file not in _loaded:
        _loaded[file] = _load(path)
    return _loaded[file]


def _load(path: Path) -> Callable[[], Any]:
    if not path.is_file():
        raise CandidateError(f"shaper {path}: there is no such file")
    module = run_file(path, "shaper", CandidateError)
    classes = [
        value
        for value in vars(module).values()
        if inspect.isclass(value)
        and value.__module__ == module.__name__
        and callable(getattr(value, "step", None))
    ]
    if len(classes) > 1:
        found = ", ".join(value.__name__ for value in classes)
        raise CandidateError(
            f"shaper {path}: contains several classes with a method step, {found}: keep only one"
        )
    if classes:
        try:
            classes[0]()
        except Exception as error:
            raise CandidateError(
                f"shaper {path}: {classes[0].__name__}() raises {named(error)}: must need no arguments"
            ) from error
        return classes[0]
    if inspect.isfunction(getattr(module, "step", None)):
        return lambda: module
    raise CandidateError(
        f"shaper {path}: contains neither a class with a method step(q_ref, info) nor a function step"
    )


def run_file(path: Path, kind: str, wrong: type[ValueError]) -> ModuleType:
    """Run a user's Python file, and return its module; raise an error of type `wrong` if that fails."""
    name = f"tvist_{kind}_{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path.resolve())
    if spec is None or spec.loader is None:
        raise wrong(f"{kind} {path}: must be a Python file, *.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        raise wrong(f"{kind} {path}: running it raises {named(error)}") from error
    return module
