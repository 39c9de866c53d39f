"""One robot of a server: its controller, and what stands between that and clock, network and file."""

from collections.abc import Sequence
from pathlib import Path

from tvist_protocol.stream import Event, Telemetry
from tvist_server.about import info_of
from tvist_server.admission import Admitted
from tvist_server.clock import Driven
from tvist_server.controller import Controller
from tvist_server.gateways.base import Gateway, Reply
from tvist_server.host import Host
from tvist_server.lateness import Punctuality
from tvist_server.outlet import Outlet
from tvist_server.plan_ahead import PlanAhead
from tvist_server.planning.planner import Planner
from tvist_server.reception import Reception
from tvist_server.recording.black_box import BlackBox
from tvist_server.recording.recorder import Recorder
from tvist_server.setup import Setup


class ServedRobot:
    """A robot with everything that is its own: robots share a process, the tick thread and the network alone.

    It is the desk to its gateways: what they hand in is admitted in their threads and waits for the one that owns the
    controller.

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
        info_of(self.controller)  # what takes longest in it is found once, before the first tick
        lockstep = setup.clock != "realtime"
        self.recorder = None
        if record is not None:
            self.recorder = Recorder(
                record,
                info_of(self.controller),
                setup.to_builtins(),
                wait=lockstep,
                on_error=self._warn,
                on_moved=self._warn,
            )
        black_box = BlackBox(dump, lambda: info_of(self.controller), setup.to_builtins(), self.recorder)
        self.outlet = Outlet(black_box, lossless=lockstep)
        self._host = Host(self.controller, self.outlet)
        self.driven = Driven(self._host)
        """For the clock."""
        # Where a client lets time pass nothing is late, and plans are made where they are used.
        self._plan_ahead = None if lockstep else PlanAhead(self._host, Planner(setup), self.driven.post)
        carry_out = self._carry_out if self._plan_ahead is None else self._plan_ahead.submit
        self._reception = Reception(self._host, self.driven.post, carry_out)

    # ------------------------------------------------------------------ the desk: what its gateways ask for

    def request(self, data: bytes, reply: Reply) -> None:
        """Carry out a command; the reply comes from another thread, or at once where the command is turned away."""
        self._reception.request(data, reply, lambda answer: self.outlet.reply(reply, answer))

    def setpoint(self, data: bytes) -> None:
        """Take a set-point."""
        self._reception.setpoint(data)

    def info(self, reply: Reply) -> None:
        """Say what the robot is."""
        self.driven.post(lambda: self.outlet.reply(reply, self._host.info()))

    def client_seen(self, client: str, session: str = "") -> None:
        """A client's liveliness token is there."""
        self._reception.client_seen(client, session)

    def client_gone(self, client: str, session: str = "") -> None:
        """A client's liveliness token is gone, or its session."""
        self._reception.client_gone(client, session)

    def session_gone(self, session: str) -> None:
        """A session has ended."""
        self._reception.session_gone(session)

    def holder(self) -> str | None:
        """Client that has control; None: nobody."""
        lease = self._host.standing.lease
        return None if lease is None else lease.client

    def repeat(self) -> None:
        """Tell how the robot stands, while no time passes, for those who come late; in the controller's thread."""
        self.outlet.repeat(self.controller.latest, self.controller.io())

    def _carry_out(self, admitted: Admitted, reply: Reply) -> None:
        client = admitted.client

        def attend() -> bool:
            return self.driven.attend(client)

        self.driven.post(lambda: reply(self._host.carry_out(admitted, attend=attend)), client)

    # ------------------------------------------------------------------ how it is doing, and its end

    def start(self) -> None:
        """Begin to plan; before its clock starts."""
        if self._plan_ahead is not None:
            self._plan_ahead.start()

    def end_planning(self) -> None:
        """Plan nothing more."""
        if self._plan_ahead is not None:
            self._plan_ahead.end()

    def stop_planning(self) -> None:
        """Wait for the plan that is being made; before its clock ends."""
        if self._plan_ahead is not None:
            self._plan_ahead.close()

    @property
    def failure(self) -> str | None:
        """Why the robot ticks no more, where it does not."""
        return self._host.failure

    def tell_telemetry(self, gateways: Sequence[Gateway], punctuality: Punctuality | None) -> None:
        """Put the server's own figures on this robot, from the controller's thread.

        Args:
            gateways: The robot's.
            punctuality: Of its ticks; None where a client lets time pass.
        """
        self.driven.post(lambda: self.outlet.telemetry(self._telemetry(gateways, punctuality)))

    def _telemetry(self, gateways: Sequence[Gateway], punctuality: Punctuality | None) -> Telemetry:
        controller, counters, reception = self.controller, self.controller.counters, self._reception
        late, lost, limited = controller.motion.counters()
        refused = reception.setpoints_refused + sum(gateway.setpoints_refused for gateway in gateways)
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
            commands=counters.commands + reception.commands_refused,
            refused=counters.refused + reception.commands_refused,
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

    def _warn(self, why: str) -> None:
        """Tell clients, and with them the console; it is no event of the controller's, whose replay knows no disk."""

        def tell() -> None:
            self.outlet.event(Event(tick=self.controller.tick_number + 1, kind="warning", why=why))

        self.driven.post(tell)
