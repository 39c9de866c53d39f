"""Processor time per tick: plant, filter, control cycle (Figure 6), whole line; compared with MuJoCo's."""

from collections.abc import Mapping

from benchmarks.figure import Figure, Tell, figure, in_alternation
from tvist_controller.api.line import body
from tvist_lab.bench import moving
from tvist_lab.bench.moving import Run
from tvist_lab.in_process import free_setup
from tvist_plant.plant import PERIOD
from tvist_plant.world.mujoco_arm import MujocoArm

REPETITIONS = 20


class _Mujoco(MujocoArm):
    """MuJoCo's arm without its measurements, which are not part of a tick here."""

    step = MujocoArm.move  # type: ignore[assignment]


def line(tell: Tell) -> dict[str, Figure]:
    """Measure a tick of the control line and of its parts."""
    tell("the line and its parts beside MuJoCo")
    parts = {
        "plant": ("2 ms of the flexible arm", moving.plant_tick()),
        "filter": ("the filter zv with its estimator", _filter_tick()),
        "cycle": ("Figure 6 with zv: trajectory to plant", moving.cycle_tick()),
        "line": ("the line with zv: messages to encoded state", moving.line_tick("zv")),
        "line_auto": ("the line with auto", moving.line_tick("auto")),
        "line_elastic": ("the line with elastic", moving.line_tick("elastic")),
    }
    figures, found = _beside_mujoco(parts)
    ours, theirs = ([1e6 * PERIOD / taken for taken in found[name]] for name in ("line", "mujoco"))
    ahead, arms = "robots that a core computes in real time", "arms that a core computes with MuJoCo"
    return {**figures, "realtime_factor": figure(ahead, "", ours, arms, theirs)}


def streams(tell: Tell) -> dict[str, Figure]:
    """Measure a tick of the control line while it receives set-points."""
    tell("streams of set-points beside MuJoCo")
    said = "the line with zv and set-points at {} Hz"
    parts = {f"stream_{rate}_hz": (said.format(rate), moving.stream_tick(500 // rate)) for rate in (500, 125)}
    return _beside_mujoco(parts)[0]


def _beside_mujoco(parts: Mapping[str, tuple[str, Run]]) -> tuple[dict[str, Figure], dict[str, list[float]]]:
    setup = free_setup(truth=False)
    mujoco = moving.arm_tick(_Mujoco(setup.description, body(setup.payload)))
    runs = {"mujoco": mujoco, **{key: run for key, (_, run) in parts.items()}}
    found = in_alternation(runs, REPETITIONS)
    figures = {
        f"{key}_us_per_tick": figure(said, "µs", found[key], "MuJoCo's tick", found["mujoco"])
        for key, (said, _) in parts.items()
    }
    return figures, found


def _filter_tick() -> Run:
    tvist, references = moving.line_filter(free_setup(truth=False)), moving.motion()

    def shape() -> None:
        for q in references:
            tvist.filter(q)

    def run() -> float:
        tvist.reset(references[0])
        return moving.us_per_tick(shape)

    return run
