"""The paper's experiment: three motions unshaped, by the paper's method and by baselines, on any robot."""

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from tvist_client.arm import Arm
from tvist_client.robot import Robot
from tvist_controller.api.line import Setup
from tvist_lab.collect import collect
from tvist_lab.frequency_error import robust_over
from tvist_lab.in_process import robot_in_process
from tvist_lab.metrics import MotionResult, Runs, measure, motions, peak_after_stop
from tvist_lab.recordings import Recording
from tvist_lab.studies.paper.published import MOTIONS, pose
from tvist_protocol.info import Info

BEFORE = 0.1  # time recorded before a motion [s]
AFTER = 1.9  # recorded time after the end, in which the drives' slow loops settle [s]

ACCELERATION, JERK = 2.0, 100.0  # the paper's limits [rad/s², rad/s³]
Progress = Callable[[str], None]


@dataclass(frozen=True)
class PaperMethod:
    """A method for making a motion: a shaper, and the modes for which the shaper is designed."""

    name: str
    label: str  # name for display
    shaper: str = "none"
    modes: tuple[float, float] | None = None
    """Constant design frequency [Hz] and damping ratio [-]; None for the polynomials of the robot's calibration."""
    frozen: bool = False  # whether the shaper keeps the modes of the end pose during the whole motion
    jerk: float = JERK  # jerk limit of the motion [rad/s³]

    async def prepare(self, robot: Robot, arm: Arm, end: tuple[float, ...]) -> None:
        """Set up a robot at rest for a motion ending at a pose; even without a shaper, modes are recorded."""
        modes = self.modes
        await arm.set_estimator("polynomial")
        if self.frozen:
            start = (await robot.state()).target_q
            await arm.reset(q=end)
            await robot.advance(2)
            state = await robot.state()
            await arm.reset(q=start)
            modes = state.estimated_f_d[0], state.estimated_zeta[0]
        if modes is not None:
            await arm.set_estimator("fixed", f_d=[modes[0]], zeta=[modes[1]])
        await arm.set_shaper(self.shaper)


UNSHAPED = PaperMethod("unshaped", "unshaped")
SHAPED = PaperMethod("shaped", "TVIST-ZV", "zv")  # TVIST with the calibration's polynomials
FROZEN_AT_END = PaperMethod("zv_frozen_at_end", "ZV for the end pose", "zv", frozen=True)


def fixed(shaper: str, f_d: float, zeta: float) -> PaperMethod:
    """Return one shaper for the whole workspace, with a design frequency [Hz] and damping ratio [-]."""
    return PaperMethod(f"fixed_{shaper}", f"fixed {shaper.upper()}", shaper, (f_d, zeta))


def equal_duration(delay: float) -> PaperMethod:
    """Return a motion without shaper and model that takes as long as a shaped one with this delay [s]."""
    # A double S that reaches its limits lasts way/v + v/a + a/j, so it gets longer by as much as a/j.
    jerk = ACCELERATION / (ACCELERATION / JERK + delay)
    return PaperMethod("equal_duration_double_s", "longer double S", jerk=jerk)


@dataclass(frozen=True)
class JudgedRun:
    """One run of one motion."""

    result: MotionResult
    peak: float | None  # largest true |α| later than 10 ms after the stop [m/s²]


@dataclass
class Experiment:
    """Results of all runs."""

    info: Info
    seed: int
    runs: int
    table_1: dict[str, dict[str, float]]  # lowest mode at each pose, and the true lowest mode if known
    judged: dict[tuple[str, str], list[JudgedRun]] = field(default_factory=dict)
    """Results of all runs, by motion and method."""
    labels: dict[str, str] = field(default_factory=dict)
    first: dict[tuple[str, str], Recording] = field(default_factory=dict)
    """Recording of the first run, by motion and method, for the figures."""

    def of_table_2(self) -> dict[str, Runs]:
        """Return the unshaped and shaped runs of each motion, for Table 2."""
        kinds = ("unshaped", "shaped")
        return {
            motion: Runs(*([one.result for one in self.judged[motion, kind]] for kind in kinds))
            for motion in MOTIONS
        }

    def delay(self, motion: str) -> float:
        """Return the mean delay of the shaped motion [s]."""
        return 1e-3 * float(np.mean([judged.result.delay_ms for judged in self.judged[motion, "shaped"]]))


def judge(recording: Recording) -> JudgedRun:
    """Measure the one motion of a recording."""
    motion = motions(recording)[0]
    peak = peak_after_stop(recording, motion) if ("truth_tool_acceleration" in recording) else None
    return JudgedRun(measure(recording, motion), peak)


async def table_1(robot: Robot, arm: Arm) -> dict[str, dict[str, float]]:
    """Return frequency and damping of the lowest mode at the paper's three poses."""
    table = {}
    await arm.set_estimator("polynomial")
    for name in ("Q1", "Q2", "Q3"):
        reset = await arm.reset(q=pose(name)) or 0
        with collect(robot) as collected:
            await robot.advance(5)
            state = await robot.until(reset + 5)
        table[name] = {"f_d_hz": state.estimated_f_d[0], "zeta": state.estimated_zeta[0]}
        if collected.truths:
            truth = collected.truths[-1]
            table[name] |= {"true_f_d_hz": truth.f_d[0], "true_zeta": truth.zeta[0]}
    return table


async def run(robot: Robot, arm: Arm, motion: str, method: PaperMethod, seed: int) -> Recording:
    """Record one motion from rest to rest, and the time after it."""
    start, end = (pose(name) for name in MOTIONS[motion])
    period = 1.0 / (await robot.info()).rate_hz
    await arm.reset(q=start, seed=seed)
    await robot.advance(1)
    await method.prepare(robot, arm, end)
    reset = await arm.reset(q=start, seed=seed) or 0
    await robot.advance(1)
    await robot.until(reset + 1)  # the answer may arrive before states of earlier ticks
    with collect(robot) as collected:
        await robot.advance(round(BEFORE / period))
        await arm.move_j(end, jerk=method.jerk)
        await robot.advance(round(AFTER / period))
    return collected.recording()


async def experiment(
    robot: Robot, arm: Arm, *, runs: int, seed: int, baselines: bool, progress: Progress, judged: bool = True
) -> Experiment:
    """Run and repeat every motion with every method, each time with other noise and gear errors."""
    done = Experiment(info=await robot.info(), seed=seed, runs=runs, table_1=await table_1(robot, arm))
    for motion in MOTIONS:
        for method in (UNSHAPED, SHAPED):
            await _repeat(robot, arm, done, motion, method, progress, judged=judged)
        if baselines:
            for method in fixed_baselines(done.info, done.delay(motion)):
                await _repeat(robot, arm, done, motion, method, progress, judged=judged)
    return done


def simulate(
    setup: Setup, *, runs: int, seed: int, baselines: bool = False, progress: Progress = lambda _: None
) -> Experiment:
    """Run every motion with every method on a robot in this process; see `experiment`."""

    async def whole() -> Experiment:
        async with robot_in_process(setup) as robot, robot.control("paper") as arm:
            return await experiment(robot, arm, runs=runs, seed=seed, baselines=baselines, progress=progress)

    return asyncio.run(whole())


def fixed_baselines(info: Info, delay: float) -> Sequence[PaperMethod]:
    """Return the baselines to compare with the paper's method."""
    if info.calibration is None:
        return [equal_duration(delay)]
    f_d, zeta = info.calibration.f_d_range, info.calibration.zeta_range
    robust = [fixed(name, *robust_over(name, f_d, zeta)) for name in ("mzv", "ei2", "ei3")]
    return [equal_duration(delay), FROZEN_AT_END, *robust]


def count(runs: int, *, baselines: bool) -> int:
    """Return the total number of runs."""
    return len(MOTIONS) * runs * (7 if baselines else 2)


async def _repeat(
    robot: Robot,
    arm: Arm,
    done: Experiment,
    motion: str,
    method: PaperMethod,
    progress: Progress,
    *,
    judged: bool,
) -> None:
    key = (motion, method.name)
    done.labels[method.name] = method.label
    for number in range(done.runs):
        recording = await run(robot, arm, motion, method, seed=1000 * done.seed + number)
        done.first.setdefault(key, recording)
        if judged:
            done.judged.setdefault(key, []).append(judge(recording))
        progress(f"{motion} {method.label}")
