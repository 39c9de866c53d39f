"""Random sequences of commands with programs among them, and guarantees that hold for programs besides."""

from collections import Counter
from collections.abc import Callable

from tests.search import space
from tests.search.scripts import Author
from tests.search.sequences import SENT, Sequence

from tvist_protocol import programs as p
from tvist_protocol.io import SetRegisters
from tvist_protocol.replies import Refused
from tvist_protocol.transitions import Activity

DRIVEN = frozenset({Activity.MOVING, Activity.PAUSED, Activity.GUIDED})
"""Activities in which a motion with a number is running."""
STOPPERS = frozenset({"stop", "stop_j", "stop_l", "power_off", "lose", "release", "program_stop", "reset"})
"""Commands after which no motion begins until another command asks for one."""
_STARTING = {"move", "stream", "program_run", "program_load", "program_play", *space.SENT}
STARTERS = frozenset(_STARTING - STOPPERS)  # commands that ask for motions


class ProgramSequence(Sequence):
    """A sequence in which programs are started, replaced, paused, played and stopped; see `Sequence`."""

    _texts = 0
    _seen = 0  # number of events that were looked at
    _still = False  # whether no motion may begin, since a stop was commanded
    _earlier: frozenset[int] = frozenset()
    """Motions that were asked for before that, which may begin with the next tick's events."""
    _number: int | None = None  # number of the motion that began last

    @property
    def sent(self):
        """Commands and their relative frequencies."""
        return _SENT

    def note(self, name, reply):
        if not isinstance(reply, Refused) and name in STOPPERS | STARTERS:
            self._still = name in STOPPERS
            self._earlier = frozenset(self.robot.numbers)

    def text(self, *, secondary=False):
        """Return another program, and keep it for the story."""
        self._texts += 1
        author = Author(self.description, self.robot.references[-1], self._random)
        name = f"p{self._texts}"
        text = author.secondary(name) if secondary else author.program(name)
        self.done.append(text)
        return text

    def load_program(self):
        text = self.text()
        self.robot.send(p.ProgramLoad, name=f"p{self._texts}", text=text)
        return self.robot.send(p.ProgramPlay)

    def write(self):
        values = (int(self._random.integers(9)),)
        return self.robot.send(SetRegisters, bank="input_int", first=0, values=values)

    def _tick(self, count):
        controller = self.robot.controller
        for _ in range(count):
            self._playing = controller.programs.state == "PLAYING"
            self._rested, self._declared = controller.cycle.mode.at_rest, controller.declared
            super()._tick(1)

    def _watch(self):
        controller = self.robot.controller
        for event in self.robot.events[self._seen :]:
            self._hear(event)
        self._seen = len(self.robot.events)
        if self._rested and controller.declared is not self._declared:  # see `payload`
            meeting = controller.motion.collisions.meeting(self.robot.references[-1])
            self._excused |= meeting is not None
        super()._watch()
        orphan = controller.motion.motions.running and self._number not in self.robot.numbers
        if orphan and controller.programs.state == "STOPPED" and controller.motion.activity in DRIVEN:
            raise self._broken("a program has ended, and its motion goes on")

    def _hear(self, event):
        if event.kind != "motion_started":
            return
        self._number, self._ahead = event.id, None
        if self._still and event.id not in self._earlier:
            raise self._broken("a motion began after a stop")
        if event.id not in self.robot.numbers and not self._playing:
            raise self._broken("a motion began while no program was playing")

    def _come_back(self):
        self._ahead = None
        self.note("program_stop", self.robot.send(p.ProgramStop))
        self._tick(1)
        self._tick_until_rest()
        self._still = False
        super()._come_back()
        started, stopped = (
            Counter(event.program for event in self.robot.events if event.kind == kind)
            for kind in ("program_started", "program_stopped")
        )
        if started != stopped:
            raise self._broken(f"programs {dict(started)} ended as {dict(stopped)}")


def _noted(name, send):
    def noted(it):
        reply = send(it)
        it.note(name, reply)
        return reply

    return noted


_PROGRAMS: dict[str, tuple[float, Callable[[ProgramSequence], object]]] = {
    "program_run": (30.0, lambda it: it.robot.send(p.ProgramRun, text=it.text())),
    "program_beside": (3.0, lambda it: it.robot.send(p.ProgramRun, text=it.text(secondary=True))),
    "program_load": (6.0, ProgramSequence.load_program),
    "program_play": (10.0, lambda it: it.robot.send(p.ProgramPlay)),
    "program_pause": (5.0, lambda it: it.robot.send(p.ProgramPause)),
    "program_stop": (3.0, lambda it: it.robot.send(p.ProgramStop)),
    "registers": (2.0, ProgramSequence.write),
}
_READY = {"power_on": 20.0, "unlock": 15.0, "restart_safety": 6.0}
"""Frequencies of the commands after which programs can be started again, which faults keep from starting."""
_ALL = SENT | _PROGRAMS
_SENT = {name: (_READY.get(name, weight), _noted(name, send)) for name, (weight, send) in _ALL.items()}
