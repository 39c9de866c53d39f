"""One robot of a server: its controller, and what stands between that and clock, network and file."""

import logging
from collections.abc import Callable, Sequence
from pathlib import Path

from tvist_protocol.stream import Event, Telemetry
from tvist_server.about import info_of
from tvist_server.clock import Driven
from tvist_server.controller import Controller
from tvist_server.gateways.base import Gateway, Reply
from tvist_server.host import Host
from tvist_server.lateness import Punctuality
from tvist_server.outlet import Outlet
from tvist_server.recording.black_box import BlackBox
from tvist_server.recording.recorder import Recorder
from tvist_server.setup import Setup

log = logging.getLogger(__name__)


class ServedRobot:
    """A robot with everything that is its own: robots share a process, the tick thread and the network alone.

    It is the desk to its gateway: what arrives waits for the thread that owns the controller.

    Args:
        setup: How it starts.
        record: File to record into.
        dump: Folder for the last second before a failure.

    Raises:
        ValueError: The setup is wrong.
        RecordingError: The recording cannot be written.
    """

    def __init__(self, setup: Setup, record: Path | None, dump: Path) -> None:
        self.setup = setup
        self.controller = Controller(setup)
        lockstep = setup.clock != "realtime"
        self.recorder = None
        if record is not None:
            self.recorder = Recorder(
                record,
                info_of(self.controller),
                setup.to_builtins(),
                wait=lockstep,
                on_error=self._recorder_failed,
            )
        black_box = BlackBox(dump, lambda: info_of(self.controller), setup.to_builtins(), self.recorder)
        self.outlet = Outlet(black_box, lossless=lockstep)
        self._host = Host(self.controller, self.outlet)
        self.driven = Driven(self._host)
        """For the clock."""

    # ------------------------------------------------------------------ the desk: what its gateway asks for

    def request(self, data: bytes, reply: Reply) -> None:
        """Carry out a command; the reply comes from another thread."""
        self._post_reply(reply, lambda: self._host.request(data))

    def setpoint(self, data: bytes) -> None:
        """Take a set-point."""
        self.driven.post(lambda: self._host.setpoint(data))

    def info(self, reply: Reply) -> None:
        """Say what the robot is."""
        self._post_reply(reply, self._host.info)

    def client_seen(self, name: str) -> None:
        """A client's liveliness token is there."""
        self.driven.post(lambda: self._host.client_seen(name))

    def client_gone(self, name: str) -> None:
        """A client's liveliness token is gone."""
        self.driven.post(lambda: self._host.client_gone(name))

    def holder(self) -> str | None:
        """Client that has control; None: nobody."""
        lease = self.controller.session.lease
        return None if lease is None else lease.client

    def _post_reply(self, reply: Reply, answer: Callable[[], bytes]) -> None:
        self.driven.post(lambda: self.outlet.reply(reply, answer()))

    # ------------------------------------------------------------------ how it is doing, and its end

    @property
    def failure(self) -> str | None:
        """Why the robot ticks no more, where it does not."""
        return self._host.failure

    def telemetry(self, gateways: Sequence[Gateway], punctuality: Punctuality | None) -> Telemetry:
        """The server's own figures on this robot."""
        controller, counters = self.controller, self.controller.counters
        late, lost, limited = controller.motion.counters()
        refused = sum(gateway.setpoints_refused for gateway in gateways)
        on_time = punctuality or Punctuality(0, 1.0, 0.0, 0.0, 0.0)
        return Telemetry(
            tick=controller.tick_number,
            ticks_per_second=on_time.ticks / on_time.seconds,
            late_p50_us=on_time.p50_us,
            late_p99_us=on_time.p99_us,
            late_max_us=on_time.max_us,
            missed_ticks=counters.missed_ticks,
            dropped_states=self.outlet.dropped + sum(gateway.dropped for gateway in gateways),
            recorder_dropped=self.recorder.dropped if self.recorder is not None else 0,
            setpoints_received=counters.setpoints_received + refused,
            setpoints_refused=counters.setpoints_refused + refused,
            setpoints_late=late,
            setpoints_lost=lost,
            setpoints_limited=limited,
            commands=counters.commands,
            refused=counters.refused,
        )

    def close_recording(self) -> None:
        """Write what waits, and the index."""
        if self.recorder is not None:
            self.recorder.close()

    def discard_recording(self) -> None:
        """Remove a recording that never began: it is ours and empty, and would stand in the way of the next attempt."""
        if self.recorder is not None:
            self.recorder.close()
            self.recorder.path.unlink(missing_ok=True)

    def _recorder_failed(self, why: str) -> None:
        """Say so in the log, and to clients; it is no event of the controller's, whose replay knows no disk."""
        log.error("the recording ended: %s", why)
        tick = self.controller.tick_number + 1
        self.driven.post(lambda: self.outlet.event(Event(tick=tick, kind="warning", why=why)))
