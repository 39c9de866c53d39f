"""One run of the program on a robot, from its upload to its end."""

import contextlib
import socket
import threading
import time
from collections.abc import Callable, Sequence

import numpy as np

from tvist_plant.drives import DriveCommand
from tvist_plant.plant import Halt, RobotReport
from tvist_plant.robot_tables import ArmLimits
from tvist_protocol.modes import RuntimeState
from tvist_server.moving.checks import REMOTE, REPLACED, halt_by_modes, halt_by_program, remote_trouble
from tvist_server.moving.interfaces import PATIENCE, PRIMARY, query_dashboard
from tvist_server.moving.program import (
    ALONE,
    ENDED,
    LEFT_OUT,
    PLAYED,
    RUN,
    STATE,
    ProgramState,
    Window,
    program,
)
from tvist_server.moving.servo_lag import ServoLag, ServoSetpoints
from tvist_server.watching.address import RobotAddress
from tvist_server.watching.watched_robot import WatchedRobot

DECELERATION = 5.0  # smallest deceleration of the fastest joint when the program brakes [rad/s²]
BRAKES = 0.125  # time to brake from the speed cap [s], if this needs more than `DECELERATION`
SETTLES = 25
"""Number of rows to await from the waiting program before the first set-point: its start delays some rows."""
GRACE = 5  # number of rows after the program's end in which the modes may still show the reason
STANDS = 10  # number of rows with the same played set-point after which another program is assumed to run
HEEDS = 250
"""Number of ignored set-points after which the program is not `follow.script`, which follows the first."""
BEGINS = 5.0  # longest time for the program to start [s]
TELL_EVERY = 10.0  # shortest time between two reports about late set-points [s]
LOOK_EVERY = 0.2  # longest time until the upload thread notices that it should end [s]


class ProgramRun:
    """Runs the program once, on a connected robot."""

    def __init__(
        self,
        robot: WatchedRobot,
        place: RobotAddress,
        number: int,
        limits: ArmLimits,
        lag: ServoLag | None,  # lag of its `servoj`; None: unknown
        check: Callable[[], str | None],  # returns why the robot accepts no program now; for any thread
    ) -> None:
        self._robot, self._number, self._window = robot, number, Window()
        self._stands, speed = robot.newest["target_q"], max(limits.velocity)
        here = np.array(self._stands)
        self._setpoints = ServoSetpoints(here, lag, fastest=speed, reach=np.array(limits.position))
        self._begun, self._plays = time.monotonic(), False
        self._waiting, self._settled, self._ending = False, 0, 0
        self._follows, self._played, self._still = False, 0, 0
        self.ready = False
        """Whether the program follows `add`. It changes only between two ticks, so that no command is lost."""
        self.halt: Halt | None = None  # why this run has ended or cannot start
        self._told, self._told_at = (0, 0, 0), 0.0
        robot.write(self._window.values(0))  # so that set-points of an earlier run are not played
        deceleration = min(max(DECELERATION, speed / BRAKES), *limits.acceleration)
        text = program(number, speed=speed, deceleration=deceleration)
        self._upload = Upload(place, text, check)

    @property
    def last(self) -> Sequence[float] | None:
        """The newest set-point, shape (6,) [rad]; None before the first."""
        return self._window.newest

    def add(self, command: DriveCommand, *, played: bool) -> None:
        """Take a tick's command. If `played`, add its set-point, or the posture until the program follows."""
        if self.ready:
            setpoint = self._setpoints.next(command).tolist()
            if played:
                self._window.add(setpoint)
        elif played and (self._follows or (self._waiting and self._settled > SETTLES)):
            stands = self.last or self._stands  # the first set-point is the posture that was checked
            self._setpoints.begin(np.array(stands))
            self._window.add(stands)
        self.ready = self._follows

    def write(self) -> None:
        """Send the newest set-points."""
        if self._window.number:
            self._robot.write(self._window.values(self._number))

    def end(self) -> None:
        """Make the program brake and end."""
        self._robot.write(self._window.values(-self._number))
        self._upload.close()
        self._waiting = self._follows = self.ready = False

    def take(self, report: RobotReport) -> str | None:
        """Update the program's state from a row; return a message for users, if any."""
        state, played, ended, number, alone, left_out = (
            int(self._robot.newest[f"output_int_register_{place}"][0])
            for place in (STATE, PLAYED, ENDED, RUN, ALONE, LEFT_OUT)
        )
        self.halt = self.halt or halt_by_modes(report.modes)
        ours = number == self._number
        if not self._plays:
            self._plays = ours and report.modes[2] == RuntimeState.PLAYING
            if self.halt is None and self._upload.trouble is not None:
                self.halt = Halt(self._upload.trouble, report.modes[1])
            elif self.halt is None and time.monotonic() - self._begun > BEGINS:
                why = f"the program has not started within {BEGINS:g} s: look for a message on its teach pendant"
                self.halt = Halt(f"{why}, then power on here", report.modes[1])
            return None
        self._still = self._still + 1 if state == ProgramState.FOLLOWING and played == self._played else 0
        self._played = played
        ends = halt_by_program(ended if ours else 0, report.modes)
        waits = state == ProgramState.WAITING and self._window.number > HEEDS
        if ends is None and (not ours or waits or self._still >= STANDS):
            ends = Halt(REPLACED, report.modes[1])
        self._ending = 0 if ends is None else self._ending + 1
        if self._ending > GRACE:
            self.halt = self.halt or ends
        self._follows = (state == ProgramState.FOLLOWING or self._follows) and self.halt is None
        self._waiting = state == ProgramState.WAITING and self.halt is None
        self._settled += state == ProgramState.WAITING
        return self._tell_missed((alone, left_out, self._setpoints.limited))

    def _tell_missed(self, missed: tuple[int, int, int]) -> str | None:
        now = time.monotonic()
        if missed == self._told or now - self._told_at < TELL_EVERY:
            return None
        self._told, self._told_at = missed, now
        return (
            f"since the program began, the robot had no set-point in {missed[0]} periods and went on by itself, and "
            f"{missed[1]} set-points came too late to be played (look at the network and at the load of this machine); "
            f"{missed[2]} were cut to the joints' range or the speed cap by more than 1 mrad (move more slowly)"
        )


class Upload:
    """Sends a program in its own thread; stays connected, as some robots end programs whose sender leaves."""

    def __init__(self, place: RobotAddress, text: str, check: Callable[[], str | None]) -> None:
        self._place, self._text, self._check = place, text, check
        self.trouble: str | None = None  # why the program cannot run
        self._closed = threading.Event()
        self.thread = threading.Thread(target=self._run, name="tvist-upload", daemon=True)
        self.thread.start()

    def close(self) -> None:
        """Close the connection."""
        self._closed.set()

    def _run(self) -> None:
        self.trouble = remote_trouble(query_dashboard(self._place, [REMOTE]))
        if self.trouble is not None or self._closed.is_set():
            return
        where = self._place.beside(PRIMARY)
        try:
            with socket.create_connection((where.host, where.port), PATIENCE) as connection:
                self.trouble = self._check()  # an upload would end a program that has started meanwhile
                if self.trouble is not None or self._closed.is_set():
                    return
                connection.sendall(self._text.encode())
                connection.settimeout(LOOK_EVERY)
                while not self._closed.is_set():
                    with contextlib.suppress(TimeoutError):
                        if not connection.recv(1 << 16):
                            return
        except OSError as error:
            self.trouble = f"its port {where.port} takes no program: {error.strerror or error}"
