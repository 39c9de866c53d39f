"""A served robot: controller, clock, gateways and recorder put together, until somebody ends it."""

import asyncio
import contextlib
import gc
import logging
import signal
import sys
from collections.abc import Callable
from threading import Thread

from tvist_plant.plant import PERIOD
from tvist_protocol.stream import Telemetry
from tvist_server.about import info_of
from tvist_server.clock import Clock, Lockstep, Punctuality, Realtime
from tvist_server.config import ConfigError, ServeConfig
from tvist_server.controller import Controller
from tvist_server.gateways.exposure import ExposureError, guarded
from tvist_server.gateways.zenoh import ZenohGateway
from tvist_server.host import Host
from tvist_server.outlet import Outlet
from tvist_server.recording.recorder import Recorder

log = logging.getLogger(__name__)

Reply = Callable[[bytes], None]

LEAVE = 0.6
"""How long clients may take at the end to read what waits for them [s]."""


class Server:
    """One robot on the network.

    Args:
        config: How it is served.

    Raises:
        ConfigError: The configuration is wrong.
        RecordingError: The recording cannot be written.
        GatewayError: An endpoint cannot be listened on.
    """

    def __init__(self, config: ServeConfig) -> None:
        setup = config.setup()
        try:
            listen, guard = guarded(
                config.listen, [setup.name], security=config.security, insecure=config.insecure
            )
        except ExposureError as error:
            raise ConfigError(str(error)) from error
        try:
            self.controller = Controller(setup)
        except ValueError as error:
            raise ConfigError(str(error)) from error
        lockstep = setup.clock != "realtime"
        self.recorder = None
        if config.record is not None:
            self.recorder = Recorder(
                config.record,
                info_of(self.controller),
                setup.to_builtins(),
                wait=lockstep,
                on_error=self._recorder_failed,
            )
        self._outlet = Outlet(self.recorder, lossless=lockstep)
        self._host = Host(self.controller, self._outlet)
        self.clock: Clock
        if lockstep:
            self.clock = Lockstep(self._host, self._outlet.repeat)
        else:
            self.clock = Realtime(self._host, PERIOD, config.speed)
        self.left = True
        """After `close`: whether the network is left. Zenoh may still wait for a client that has stopped reading."""
        try:
            self._gateway = ZenohGateway(
                setup.name, listen, self, lockstep=lockstep, truth=setup.truth, guard=guard
            )
        except Exception:
            if self.recorder is not None:
                self.recorder.close()
                # It is ours and empty; left there it would stand in the way of the next attempt.
                self.recorder.path.unlink(missing_ok=True)
            raise

    # ------------------------------------------------------------------ the desk: what gateways ask for

    def request(self, data: bytes, reply: Reply) -> None:
        """Carry out a command; the reply comes from another thread."""
        self.clock.post(lambda: self._outlet.reply(reply, self._host.request(data)))

    def setpoint(self, data: bytes) -> None:
        """Take a set-point."""
        self.clock.post(lambda: self._host.setpoint(data))

    def info(self, reply: Reply) -> None:
        """Say what the robot is."""
        self.clock.post(lambda: self._outlet.reply(reply, self._host.info()))

    def client_seen(self, name: str) -> None:
        """A client's liveliness token is there."""
        self.clock.post(lambda: self._host.client_seen(name))

    def client_gone(self, name: str) -> None:
        """A client's liveliness token is gone."""
        self.clock.post(lambda: self._host.client_gone(name))

    # ------------------------------------------------------------------ life

    def start(self) -> None:
        """Begin to tick and to answer."""
        # What lives now lives to the end: the collector need not look at it again.
        gc.collect()
        gc.freeze()
        sys.setswitchinterval(1e-4)
        self._outlet.start([self._gateway])
        self.clock.start()

    def close(self) -> None:
        """End in order: no more ticks, the recording closed, what waits handed on, as far as clients take it."""
        self._outlet.hurry()
        self.clock.close()
        if self.recorder is not None:
            self.recorder.close()
        leaving = Thread(target=self._leave, name="tvist-leave", daemon=True)
        leaving.start()
        leaving.join(LEAVE)
        self.left = not leaving.is_alive()
        gc.unfreeze()

    def _leave(self) -> None:
        """Leave the network. A client that has stopped reading can hold this up for ten seconds."""
        self._outlet.close()
        with contextlib.suppress(Exception):
            self._gateway.close()

    async def run(self, ready: Callable[[], None]) -> None:
        """Serve until SIGINT or SIGTERM, or until the controller fails; then `failure` says why.

        Args:
            ready: Called once the robot ticks and answers.
        """
        loop, ended = asyncio.get_running_loop(), asyncio.Event()
        for number in (signal.SIGINT, signal.SIGTERM):
            loop.add_signal_handler(number, ended.set)
        self.start()
        ready()
        while not ended.is_set() and self.failure is None:
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(ended.wait(), 1.0)
            self._outlet.telemetry(self._telemetry(self.clock.punctuality()))
        self.close()

    @property
    def failure(self) -> str | None:
        """Why the robot ticks no more, where it does not."""
        return self._host.failure

    def _telemetry(self, punctuality: Punctuality | None) -> Telemetry:
        controller, counters = self.controller, self.controller.counters
        late, lost, limited = controller.motion.counters()
        on_time = punctuality or Punctuality(0, 1.0, 0.0, 0.0, 0.0)
        return Telemetry(
            tick=controller.tick_number,
            ticks_per_second=on_time.ticks / on_time.seconds,
            late_p50_us=on_time.p50_us,
            late_p99_us=on_time.p99_us,
            late_max_us=on_time.max_us,
            missed_ticks=counters.missed_ticks,
            dropped_states=self._outlet.dropped,
            recorder_dropped=self.recorder.dropped if self.recorder is not None else 0,
            setpoints_received=counters.setpoints_received + self._gateway.setpoints_refused,
            setpoints_refused=counters.setpoints_refused + self._gateway.setpoints_refused,
            setpoints_late=late,
            setpoints_lost=lost,
            setpoints_limited=limited,
            commands=counters.commands,
            refused=counters.refused,
        )

    @staticmethod
    def _recorder_failed(why: str) -> None:
        log.error("the recording ended: %s", why)
