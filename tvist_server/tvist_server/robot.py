"""One robot of a server: its controller, and its connections to clock, network and file."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from tvist_controller.about import info_of
from tvist_controller.controller import Controller
from tvist_controller.dispatch.admission import Admitted
from tvist_controller.dispatch.planner import Planner
from tvist_controller.host import Host
from tvist_controller.instruments.report import Sink
from tvist_controller.planning.plan import Plan
from tvist_controller.planning.snapshot import PlanningState
from tvist_controller.programs.sockets import SocketEvent
from tvist_controller.safety.payload_learning import PayloadLearning, payload_learning_of
from tvist_controller.setup import Setup
from tvist_plant.plant import Plant, RealArm
from tvist_protocol.codec import encode
from tvist_protocol.commands import Command
from tvist_protocol.replies import Refused, Reply
from tvist_protocol.stream import State, Telemetry
from tvist_server.allowed_hosts import AllowedHosts
from tvist_server.clock import TickedRobot
from tvist_server.gateways.base import Answer, Gateway
from tvist_server.gateways.sockets import ProgramSockets
from tvist_server.intake import RobotIntake
from tvist_server.kernels import warm_up
from tvist_server.lateness import LatenessMonitor
from tvist_server.plan_ahead import PlanAhead
from tvist_server.program_folder import ProgramFolder
from tvist_server.publisher import Publisher
from tvist_server.punctual import background, waited_us
from tvist_server.recording.black_box import BlackBox

if TYPE_CHECKING:
    from tvist_server.recording.recorder import Recorder

LOCAL = "127.0.0.1"  # address of this machine, from which this process's own commands come


class ServedRobot:
    """A robot of a server. It shares process, tick thread and network with other robots, and nothing else.

    Raise ValueError if the setup is invalid, RecorderError if the recording cannot be written.
    """

    def __init__(
        self,
        setup: Setup,
        record: Path | None,  # file to record into
        dump: Path,  # folder for the last second before a failure
        observe: Callable[[Controller], Sink] | None = None,  # makes another sink for messages
        programs: ProgramFolder | None = None,  # programs that clients load by name
        hosts: AllowedHosts | None = None,  # hosts that programs may connect to, besides their sender
        keep: int | None = None,  # least number of ticks in the recording; None: all
    ) -> None:
        self._programs = programs or ProgramFolder()
        lockstep = setup.clock != "realtime"
        self._realtime = not lockstep
        self._waited_us = 0.0
        plant = setup.made_plant()
        setup = setup.standing(plant)  # adopts the limits of a real robot
        self._threads: list[ThreadPoolExecutor] = []
        # When a client advances time, nothing is late, and plans are made when they are needed.
        self.controller = Controller(setup, plant, None if lockstep else self._plans_of_programs(setup))
        self.setup = setup = self.controller.setup
        if self._realtime:
            warm_up()
        info_of(self.controller)  # caches the slowest part of the description before the first tick
        self.recorder: Recorder | None = None
        if record is not None:
            from tvist_server.recording import recorder  # imports the MCAP library

            self.recorder = recorder.Recorder(
                record,
                info_of(self.controller),
                setup.to_builtins(),
                keep=keep,
                wait=lockstep,
                on_error=self.warn,
                on_moved=self.warn,
            )
        black_box = BlackBox(dump, lambda: info_of(self.controller), setup.to_builtins())
        self.publisher = Publisher()  # passes the robot's messages to the gateways
        self._looked_at = self.controller.report.tick
        sinks: list[Sink] = [] if self.recorder is None else [self.recorder]
        sinks += [] if observe is None else [observe(self.controller)]
        self.sockets = ProgramSockets(self._hear, self.warn, hosts or AllowedHosts(()))
        learning = self._studies(setup) if self._realtime and setup.adapt else payload_learning_of(setup)
        self.host = Host(
            self.controller, *sinks, black_box, self.publisher, ports=self.sockets, learning=learning,
            survives=True,
        )  # fmt: skip
        plant = self.controller.cycle.plant  # the default plant if the setup has none
        knows = plant.truth() is not None
        self.want_truth = self.publisher.want_truth if knows and not setup.truth else None
        """Takes whether a local client wants `truth`; None if it is always published or unknown."""
        self.driven = TickedRobot(
            self.host,
            self.sockets.patience,
            plant.wait if plant.can(Plant.wait) else None,
            plant.interval() if isinstance(plant, RealArm) and (plant.watched or plant.supervised) else None,
        )
        """The robot as the clock sees it."""
        self.plan_ahead = (
            None
            if lockstep
            else PlanAhead(self.host, Planner(setup), self.driven.post, self._programs.complete)
        )
        carry_out = self._carry_out if self.plan_ahead is None else self.plan_ahead.submit
        self.intake = RobotIntake(self.host, self.driven.post, carry_out, self._programs.listed)
        self.gateways: Sequence[Gateway] = ()

    def _plans_of_programs(self, setup: Setup) -> Callable[[Command, PlanningState], Callable[[], Plan]]:
        """Return a function that starts to plan a command, and returns one that waits for the plan.

        A program line starts a fixed number of ticks after its call, so a run is the same on every machine. If a
        plan takes longer, the controller waits for it and its ticks are late.
        """
        planner, thread = Planner(setup), background("tvist-program-plans")
        self._threads.append(thread)
        return lambda command, now: thread.submit(planner.plan, command, now).result

    def _studies(self, setup: Setup) -> PayloadLearning | None:
        """Return what learns the payload from motion in a thread, or None. The journal has lessons' ticks."""
        planner, thread = Planner(setup), background("tvist-studies")
        self._threads.append(thread)
        return payload_learning_of(setup, lambda work: thread.submit(work).done, planner.for_lesson)

    def open(self, gateways: Sequence[Gateway]) -> None:
        """Set this robot's gateways, which get its messages and are closed with the robot."""
        self.gateways = gateways
        self.publisher.gateways = gateways

    def request(self, command: Command) -> Reply:
        """Execute this process's command in the controller thread or (reproducibly) before the first tick."""
        return self.host.request(encode(command), LOCAL)

    def repeat(self) -> None:
        """If no tick passed since the last call, republish the state for new clients; controller's thread."""
        report = self.controller.report
        # While a robot is stepped, clients would take a repeated state for a new tick.
        if report.tick == self._looked_at:
            self.publisher.io(self.controller.io())
            self.publisher.report(report)
        self._looked_at = report.tick

    def _carry_out(self, admitted: Admitted, answer: Answer) -> None:
        client = admitted.client

        def carry_out() -> None:
            completed = self._programs.complete(admitted)
            if isinstance(completed, Refused):
                answer(completed)
            else:
                answer(self.host.carry_out(completed, attend=partial(self.driven.attend, client)))

        self.driven.post(carry_out, client)

    @property
    def newest(self) -> State | None:
        """State of the last tick, from any thread; None before the first tick."""
        report = self.controller.report
        return report.state if report.tick > 0 else None

    def close(self) -> None:
        """Close the gateways; the controller's thread has ended."""
        for thread in self._threads:
            thread.shutdown(cancel_futures=True)
        for gateway in self.gateways:
            gateway.close()

    def publish_telemetry(self) -> None:
        """Publish the server's own figures about this robot, in the controller's thread."""
        punctuality = self.driven.lateness.look()

        def tell() -> None:
            # The present `io`, not the last published one: a program may have been played since then.
            if self.driven.pace is not None:  # new clients of a silent arm still get a state
                self.repeat()
            io = self.controller.io()
            self.publisher.io(io)
            self.publisher.publish(self._telemetry(punctuality))
            if (
                self.recorder is not None and self._realtime
            ):  # recordings of equal runs in lockstep must be equal
                self.recorder.io(io)

        self.driven.post(tell)

    def _telemetry(self, on_time: LatenessMonitor) -> Telemetry:
        controller, counters, intake = self.controller, self.controller.counters, self.intake
        gateways = self.gateways
        late, lost, limited = controller.motion.streams.counters()
        refused = intake.setpoints_refused + sum(gateway.setpoints_refused for gateway in gateways)
        overload = self.driven.overload
        left_out = 0 if controller.watching is None else counters.missed_ticks
        before, self._waited_us = self._waited_us, waited_us() if self._realtime else 0.0
        return Telemetry(
            tick=controller.tick_number,
            ticks_per_second=on_time.ticks / on_time.seconds,
            late_p50_us=on_time.p50_us,
            late_p99_us=on_time.p99_us,
            late_max_us=on_time.max_us,
            missed_ticks=counters.missed_ticks,
            dropped_states=sum(gateway.dropped for gateway in gateways),
            recorder_dropped=self.recorder.dropped if self.recorder is not None else 0,
            setpoints_received=counters.setpoints_received + refused,
            setpoints_refused=counters.setpoints_refused + refused,
            setpoints_late=late,
            setpoints_lost=lost,
            setpoints_limited=limited,
            commands=counters.commands + intake.commands_refused,
            refused=counters.refused + intake.commands_refused,
            load=None if overload is None else on_time.load,
            due_ticks=None if overload is None else overload.due + left_out,
            due_per_second=None if overload is None else overload.due_per_second,
            overloaded=overload is not None and overload.overloaded,
            processor_wait_us=self._waited_us - before,
        )

    def _hear(self, news: SocketEvent) -> None:
        def hear() -> None:
            self.sockets.note(news)
            self.host.socket(news)

        self.driven.post(hear)

    def ask_gripper(self, request: bytes, answer: Callable[[bytes], None]) -> None:
        """Carry out a request to the cell's gripper before the next tick; `answer` runs in the controller's thread."""
        self.driven.post(lambda: answer(self.host.ask_gripper(request)))

    def warn(self, why: str) -> None:
        """Publish a warning to clients and the console."""
        self.driven.post(lambda: self.host.warn(why))
