"""Checks that a robot answers, works and is ready to move, with real commands rather than a port scan."""

import asyncio
import time
from collections.abc import Callable
from contextlib import suppress

import msgspec

from tvist_client.errors import ClientError, DeniedError, NotConnectedError, UnexpectedReplyError
from tvist_client.readiness import RELIEVE, look, unlock_command
from tvist_client.robot import ENDPOINT, NAME, Robot
from tvist_client.transports.certificates import Folder
from tvist_client.transports.zenoh import robots_at
from tvist_protocol.commands import MoveJ
from tvist_protocol.errors import RefusedError, TvistError
from tvist_protocol.info import CalibrationInfo, StopReason
from tvist_protocol.keys import check_robot_name
from tvist_protocol.modes import RobotMode
from tvist_protocol.stream import Telemetry
from tvist_protocol.values import PROTOCOL_VERSION

LISTEN_S = 1.0  # shortest time over which the rate of states is measured [s]
TELEMETRY_S = 3.0  # longest wait for telemetry, which comes once a second [s]
ON_TIME = 0.9  # smallest share of the due states that counts as the full rate [-]
TOO_SLOW = 0.5  # share of the due ticks below which the robot is overloaded, whatever its telemetry says [-]
LONG_US = 20_000.0
"""Lateness above which a tick is reported [µs] if its thread waited for a processor at least half as long."""
RETRY_S = 0.5  # time between two attempts while a robot is starting [s]
STALE = "check"  # a token that no lease has


class CheckResult(msgspec.Struct, frozen=True):
    """Result of one step of the check."""

    what: str
    ok: bool
    said: str  # result of the step, for people


class CheckReport(msgspec.Struct):
    """Report of `tvist check`, also printed by `--json`."""

    ok: bool  # whether everything that was checked is in order
    endpoint: str
    robot: str  # name of the robot; empty if none was found
    robots: list[str] = []  # names of all robots found
    protocol: int | None = None  # version of the protocol that the robot uses; null if it did not answer
    state_rate_hz: float | None = None
    """States received per second of this machine's clock [Hz]; null in lockstep, or if no state came."""
    findings: list[CheckResult] = []  # one result per step; if a step fails, no further step is made
    ready: bool | None = None  # whether the robot may be moved; null if that was not checked
    robot_mode: str | None = None  # RTDE name of the robot mode; null if it was not checked or is unknown
    safety_mode: str | None = None  # RTDE name of the safety mode; null if it was not checked or is unknown
    stop: StopReason | None = None
    """The stop that keeps the robot from moving; null if there is none or it is unknown."""
    next: str | None = None  # what to do to make the robot ready; null if nothing is known to be missing
    overloaded: bool | None = None
    """Whether the robot is overloaded, as telemetry defines it; null in lockstep, or if it was not checked."""
    due_per_second: float | None = None
    """Control periods due per second [1/s]; null in lockstep, or if no state came."""
    starting: bool = False  # whether the robot is still starting; the last finding has the progress


def check(
    endpoint: str = ENDPOINT,
    name: str | None = None,
    *,
    alive: bool = False,
    security: Folder | None = None,
    namespace: str = "",
    wait: float = 0.0,
    tell: Callable[[str], object] = str,
) -> CheckReport:
    """Connect to a robot, receive a state, have a command refused, and ask whether the robot may be moved.

    Nothing is changed. `alive` only checks that the server answers and, in real time, ticks: an orchestrator must not
    kill a stopped robot. While no robot answers, or it is starting, repeat this for `wait` seconds and `tell` each
    result. Without a name, the robot is `ur5e` if present, else the first one.
    """
    deadline = time.monotonic() + wait
    while True:
        tried = _Check(endpoint, name, security, namespace, alive=alive)
        report = asyncio.run(tried.run())
        if not tried.early or time.monotonic() >= deadline:
            return report
        tell(report.findings[-1].said)
        time.sleep(RETRY_S)


class _Check:
    def __init__(
        self, endpoint: str, name: str | None, security: Folder | None, namespace: str, *, alive: bool
    ) -> None:
        self.endpoint, self.name, self.namespace = endpoint, name, namespace
        self.security, self.alive = security, alive
        self.report = CheckReport(ok=False, endpoint=endpoint, robot=name or "")
        self.robot: Robot
        self.missed = ""  # how many control periods were missed
        self.early = False  # whether the check came too early: the robot may appear later

    async def run(self) -> CheckReport:
        report, step = self.report, "connect"
        try:
            if self.name is not None:
                check_robot_name(self.name)
            report.robots = robots = await robots_at(self.endpoint, self.security, self.namespace)
            report.robot = self.name or (robots[0] if robots and NAME not in robots else NAME)
            async with await Robot.connect(
                self.endpoint, report.robot, security=self.security, namespace=self.namespace
            ) as self.robot:
                others = ", ".join(other for other in robots if other != report.robot)
                beside = f"; also there: {others}" if others else ""
                report.findings.append(CheckResult(step, True, f"{report.robot} at {self.endpoint}{beside}"))
                steps = [("info", self.info), ("state", self.state)]
                if not self.alive:
                    steps += [("refusal", self.refusal), ("ready", self.ready), ("load", self.load)]
                for step, run in steps:
                    report.findings.append(CheckResult(step, True, await run()))
            report.ok = True
        except TvistError as error:
            said = str(error)
            if isinstance(error, RefusedError) and error.reply.code == "starting":
                report.starting, step, said = True, "start", error.reply.why
            self.early = report.starting or (step == "connect" and isinstance(error, NotConnectedError))
            report.findings.append(CheckResult(step, False, said))
        return report

    async def info(self) -> str:
        info = await self.robot.info()
        self.report.protocol = info.protocol
        if info.protocol != PROTOCOL_VERSION:
            raise UnexpectedReplyError(
                f"the robot speaks protocol {info.protocol}, this client {PROTOCOL_VERSION}: update the older one"
            )
        watched = "" if info.watched is None else f"; {info.watched} is only watched"
        return (
            f"{info.model}, {len(info.joints)} joints, clock {info.clock}, protocol {info.protocol}"
            f"{watched}{_doubt(info.calibration)}"
        )

    async def state(self) -> str:
        robot, info = self.robot, await self.robot.info()
        if info.clock != "realtime":
            if info.tick == 0:
                return "none yet, since a client must step the time and none has done so"
            return f"tick {(await robot.state()).tick}; no rate, since a client steps the time"
        if info.watched is not None and info.robot_mode == RobotMode.DISCONNECTED:
            return f"it stands still, since {info.watched} is not connected"
        heard: list[Telemetry] = []
        stop = robot.on_telemetry(heard.append)
        try:
            rate, ticks = await _rate(robot)
            self.report.state_rate_hz = rate
            with suppress(TimeoutError):
                async with asyncio.timeout(TELEMETRY_S):
                    while not heard:
                        await robot.advance(1)
        finally:
            stop()
        last = heard[-1] if heard else None
        self.report.due_per_second = due = info.rate_hz if last is None else last.due_per_second
        if due is None:  # an older server, whose speed is unknown
            return f"{rate:.1f} Hz"
        self.report.overloaded = ticks < TOO_SLOW * due or (last is not None and last.overloaded)
        said = f"{rate:.1f} Hz of {due:g} due"
        if not self.report.overloaded and rate < ON_TIME * due:
            said = f"{said}, {100.0 * rate / due:.0f} %{_remedy(last, due)}"
        if last is not None and last.due_ticks:
            self.missed = (
                f"; since its start it has missed {last.missed_ticks} of {last.due_ticks} control periods"
            )
        if last is not None and LONG_US < last.late_max_us < 2.0 * last.processor_wait_us:
            self.missed += (
                f"; a tick began {last.late_max_us / 1e3:.0f} ms late, as its thread waited for a processor: on Linux, "
                "kernel.sched_autogroup_enabled=0 or --realtime-priority helps"
            )
        return f"{said}{self.missed}"

    async def refusal(self) -> str:
        # A move to the present posture moves nothing, even if it is obeyed; nor does any before the first tick.
        robot, info = self.robot, await self.robot.info()
        ticks = info.clock == "realtime" or info.tick > 0
        here = tuple((await robot.state()).target_q) if ticks else (0.0,) * len(info.joints)
        try:
            await robot.request(MoveJ(token=STALE, q=here))
        except RefusedError as error:
            if error.reply.code in {"stale_token", "no_control"}:
                return f"a command without control is refused: {error.reply.code}"
            raise
        except DeniedError:
            return "commands are not delivered: this certificate has the role viewer"
        raise ClientError("a command with an invalid token was accepted: the server does not check control")

    async def ready(self) -> str:
        report = self.report
        found = await look(
            self.robot, unlock_command(self.endpoint, report.robot, self.security, self.namespace)
        )
        report.ready, report.stop, report.next = found.ready, found.stop, found.next or None
        report.robot_mode, report.safety_mode = found.robot_mode, found.safety_mode
        if not found.ready:
            raise ClientError(found.sentence)
        if found.robot_mode is None:
            return "as far as is known before its first tick"
        return f"robot_mode {found.robot_mode}, safety_mode {found.safety_mode}"

    async def load(self) -> str:
        report = self.report  # the step `state` has measured this
        if report.overloaded is None:
            return "unknown: a client steps the time, or the server is older"
        if report.overloaded:
            rates = f"{report.state_rate_hz:.1f} states/s received of {report.due_per_second:g} due"
            raise ClientError(f"it is overloaded: {rates}{self.missed}. Next: {RELIEVE}")
        return "not overloaded"


def _remedy(last: Telemetry | None, due: float) -> str:
    """Return the remedy for a low rate of states; it depends on whether robot or network is the cause."""
    if last is not None and last.ticks_per_second >= ON_TIME * due:
        return (
            f": the robot itself makes {last.ticks_per_second:.0f} ticks/s; next, look at the network and at the "
            "load of this machine"
        )
    return f": next, {RELIEVE}"


def _doubt(calibration: CalibrationInfo | None) -> str:
    """Return a warning about the calibration in use; empty if the calibration is in order."""
    if calibration is not None and calibration.fits_arm is False:
        return f"; calibration {calibration.name!r} was measured on a different arm: the frequencies will be wrong"
    if calibration is not None and not calibration.fits_payload:
        mass = f"{calibration.payload_mass:g} kg"
        return f"; calibration {calibration.name!r} was made with {mass}, not with the declared payload"
    return ""


async def _rate(robot: Robot) -> tuple[float, float]:
    """Return received states and ticks per second, measured between two states at least `LISTEN_S` apart."""
    loop, seen = asyncio.get_running_loop(), list[tuple[int, float]]()
    stop = robot.on_state(lambda state: seen.append((state.tick, loop.time())))
    try:
        await robot.advance(1)
        await asyncio.sleep(LISTEN_S)
        await robot.advance(1)
    finally:
        stop()
    (first, began), (last, ended) = seen[0], seen[-1]
    return (len(seen) - 1) / (ended - began), (last - first) / (ended - began)
