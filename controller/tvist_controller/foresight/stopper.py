"""Prediction of the control line's motion, and the quickest way to end it."""

import math
from contextlib import suppress
from dataclasses import replace

import numpy as np

from tvist_controller.foresight.stops import LONG_STOP, MAX_AHEAD, LineSimulation, StopPlan, StopPlanner
from tvist_controller.line.cycle import ControlCycle
from tvist_controller.line.differentiator import Floats
from tvist_controller.line.limits import torque_along
from tvist_controller.line.line_mode import LineMode
from tvist_controller.trajectory import AnyStop, BrakingForecast, Path, StuckError, Trajectory
from tvist_plant.plant import PERIOD
from tvist_shaping.base import Filter

EVEN = 1e-12  # differences between steps below this are rounding errors [rad]


class Stopper:
    """Predicts and stops the motion of a control line."""

    def __init__(self, cycle: ControlCycle) -> None:
        self._cycle = cycle
        self.stops = StopPlanner(cycle.description, cycle.dynamics)
        self._wanted = math.inf

    def simulate_until_rest(
        self, tvist: Filter | None = None, trajectory: Trajectory | None = None
    ) -> Floats | None:
        """Simulate the motion until rest if no command comes, optionally with another filter or trajectory.

        Returns the last two shaped references played, then all until rest, shape (k, n) [rad]; None if rest
        is more than `MAX_AHEAD` ticks ahead or the trajectory gets stuck. Stops bypass filters.
        """
        ahead = LineSimulation(*self._cycle.fork(tvist, trajectory))
        with suppress(StuckError):
            ahead.until(MAX_AHEAD)
        return np.array(ahead.references) if ahead.rests else None

    def stop(self, deceleration: float | None) -> StopPlan | None:
        """Come to rest as quickly as permitted; `deceleration` None means the largest that torque permits.

        A motion stays on its path, is never ahead of the uninterrupted motion, and rests no later. If no stop
        within the torque limits does that, the motion runs to its end through the filter. A stream has no
        known path, so it stops clear of all bodies. If a stop in progress is as quick, it continues; returns
        None.
        """
        cycle, wanted = self._cycle, math.inf if deceleration is None else deceleration
        if cycle.mode in {LineMode.STOPPING, LineMode.RUNNING_OUT} and wanted <= self._wanted:
            return None
        plan = self.plan_stop(deceleration)
        self._wanted = wanted
        if plan is None or (plan.trajectory is None and cycle.mode is LineMode.RUNNING_OUT):
            return None
        if plan.trajectory is None:
            cycle.begin(cycle.trajectory, LineMode.RUNNING_OUT)
        else:
            cycle.begin(plan.trajectory, LineMode.STOPPING)
        return plan

    def brake(self, trajectory: Trajectory) -> None:
        """Let the reference follow the arm while brakes stop it; no other stop replaces this trajectory."""
        self._cycle.begin(trajectory, LineMode.STOPPING)
        self._wanted = math.inf  # like a request for the hardest stop

    def plan_stop(self, deceleration: float | None) -> StopPlan | None:
        """Return the quickest permitted stop from the present state without starting it; see `stop`."""
        forecast, path = self._cycle.trajectory.forecast, self._cycle.trajectory.path
        if forecast is not None:
            return self._on_path(forecast, deceleration)
        return self._by_joints(deceleration) if path is None else self._on_curve(path, deceleration)

    def _by_joints(self, deceleration: float | None) -> StopPlan | None:
        cycle, guard, present = self._cycle, self._cycle.guard, self._cycle.trajectory
        stop = self.stops.by_joints(cycle.newest, deceleration, guard.clear if guard else lambda _: True)
        # Replace a running stop only by a harder one, since each new stop begins with a ramp.
        braking = cycle.mode is LineMode.STOPPING or present.acceleration > 0.0
        if braking and (stop is None or stop.acceleration <= present.acceleration):
            return None
        if stop is None:  # no stop is clear and within the torque limits
            hardest = self.stops.highest
            stop = self.stops.stop(cycle.newest, hardest) if guard is None else guard.fallback()
        return self._plan(stop, deceleration, stop.duration, stop.end)

    def _on_path(self, forecast: BrakingForecast, deceleration: float | None) -> StopPlan | None:
        cycle, forecast = self._cycle, self._shaped(forecast)
        # Try the cheapest search first: bounds only, then simulation of a stop's duration, then of the whole motion.
        state, newest, stopping = cycle.along.published, cycle.along.position, cycle.mode is LineMode.STOPPING
        stop = self.stops.on_path(state, newest, forecast, deceleration)
        if stop is not None:
            return self._plan(stop, deceleration, stop.duration, stop.end)
        ahead = LineSimulation(*cycle.fork())
        # Unless the motion may turn back, simulating a stop's duration is enough.
        ahead.until(MAX_AHEAD if forecast.turns else 0)
        stop = self.stops.under(ahead, state, forecast, deceleration)
        if stop is not None:
            return self._plan(stop, deceleration, stop.duration, stop.end)
        ahead.until(MAX_AHEAD)
        quickest: AnyStop | None
        asked: Floats | None = None
        lasts, runs_out = math.inf, StopPlan(None, None, deceleration is not None, None, None)
        if ahead.rests:
            asked = torque_along(cycle.dynamics, np.array(ahead.references))
            quickest = self.stops.under(ahead, state, forecast, deceleration, asked)
            lasts = max((ahead.last - 1) * PERIOD, 0.0)
            runs_out = self._plan(None, deceleration, lasts, ahead.references[-1])
        else:  # too long: any stop ends sooner
            quickest = self.stops.on_path(state, newest, forecast, deceleration, certain=False)
        if quickest is None and forecast.path.posture_of is not None and lasts > LONG_STOP and not stopping:
            slowed = self.stops.slowed(ahead, state, forecast, deceleration, asked)
            quickest = slowed if slowed is not None and slowed.duration < lasts else None
        if quickest is not None:
            return self._plan(quickest, deceleration, quickest.duration, quickest.end)
        return None if stopping else runs_out

    def _on_curve(self, path: Path, deceleration: float | None) -> StopPlan | None:
        """Stop a motion on a curve by slowing its time down along the shaped way, which is simulated."""
        cycle, stopping = self._cycle, self._cycle.mode is LineMode.STOPPING
        ahead = LineSimulation(*cycle.fork())
        stop = self.stops.on_curve(ahead, cycle.along.published, path, deceleration)
        lasts = max((ahead.last - 1) * PERIOD, 0.0) if ahead.rests else math.inf
        if stop is not None and stop.duration < lasts:
            return self._plan(stop, deceleration, stop.duration, stop.end)
        return None if stopping else self._plan(None, deceleration, lasts, ahead.references[-1])

    def _plan(self, stop: AnyStop | None, wanted: float | None, duration: float, end: Floats) -> StopPlan:
        kept = None if stop is None else stop.acceleration
        way = float(np.abs(end - self._cycle.position).max())
        return StopPlan(stop, kept, wanted is not None and kept != wanted, max(duration, 0.0), way)

    def _shaped(self, forecast: BrakingForecast) -> BrakingForecast:
        """Return the forecast of the shaped motion, from that of the unshaped motion."""
        cycle = self._cycle
        if cycle.mode is LineMode.STOPPING:
            return forecast
        peak, direction = cycle.filter.peak, forecast.path.direction
        known = peak == 1.0 and not cycle.filter.fading and forecast.steady > 0.0
        if known:  # the filter's output is delayed, so it still contains earlier decelerations
            steps = np.diff(cycle.filter.window() @ direction)
            known = bool((np.diff(steps) >= -EVEN * float(direction @ direction)).all())
        return replace(
            forecast,
            braking=peak * forecast.braking,
            jerk=peak * forecast.jerk,
            steady=forecast.steady if known else 0.0,
            turns=peak > 1.0,
        )
