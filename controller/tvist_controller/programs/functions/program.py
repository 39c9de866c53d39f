"""Functions of the program itself: messages, time, client statements, stops."""

from typing import Annotated

from tvist_controller.programs.access import OWN_TOKEN
from tvist_controller.programs.arguments import Flag, Text, above_zero, readable, shown, whole, within, word
from tvist_controller.programs.blended_moves import Turns
from tvist_controller.programs.functions.group import FunctionGroup
from tvist_plant.plant import PERIOD
from tvist_protocol.commands import PowerOff
from tvist_protocol.stream import PopupKind
from tvist_urscript import Array, Fault, Struct, Value, costs, to_str

LONGEST_TEXT = 350  # number of list elements that fit into a text
LONGEST_SLEEP = 1e6  # longest time of `sleep` [s]


class MessageFunctions(FunctionGroup):
    """Messages to users, and waiting."""

    title = "Messages and time"

    @costs(30)
    def textmsg(self, s1: Value, s2: Value = "") -> None:
        """Write a line to the log, which clients of the primary interface receive."""
        text = readable(f"{self._written(s1)}{self._written(s2)}")
        self._arm.then(lambda: self._access.emit("text", why=text))

    @costs(30)
    def varmsg(self, name: Text, value: Value) -> None:
        """Write a variable's name and value to the log, as `textmsg`."""
        self.textmsg(f"{name} = ", value)

    @costs(20)
    def popup(
        self,
        s: Value,
        title: Value = "Popup",
        warning: Flag = False,
        error: Flag = False,
        blocking: Flag = False,
    ) -> Turns:
        """Show a message; with `blocking`, wait until it is closed."""
        text, head = readable(self._written(s)), readable(self._written(title))
        kind: PopupKind = "error" if error else "warning" if warning else "message"
        yield from self._arm.finish()
        self._parts.popups.show(text, head, kind, blocking=blocking)
        while blocking and self._parts.popups.shown:
            yield

    def _written(self, value: Value) -> str:
        if isinstance(value, Array):
            self._arm.spend(3 * min(value.size, LONGEST_TEXT))
        return to_str(value)

    def time(self, mode: Annotated[int, whole(0, 2)] = 0) -> Struct:
        """Return the time since the start as `struct(sec, nanosec)`; the time of day (2) is unavailable."""
        if mode != 0:
            raise Fault(f"time: mode is {mode}; this controller has no clock of the day, so it must be 0")
        sec, nanosec = divmod(round(self._access.latest().timestamp * 1e9), 10**9)
        return Struct(("sec", "nanosec"), (sec, nanosec))

    def sync(self) -> Turns:
        """Wait for the next tick."""
        yield from self._arm.finish()
        yield

    def sleep(self, t: Annotated[float, within(0.0, LONGEST_SLEEP)]) -> Turns:
        """Wait for a time [s]; at least one tick if the time is at least half a tick."""
        yield from self._arm.finish()
        for _ in range(round(t / PERIOD)):
            yield


class StatementFunctions(FunctionGroup):
    """Statements added by clients."""

    title = "Statements from clients"

    def interpreter_mode(self, clearQueueOnEnter: Flag = True, clearOnEnd: Flag = True) -> Turns:
        """Carry out statements that clients send to port 30020, until one calls `end_interpreter`.

        They can use and define functions and variables of the program.
        """
        yield from self._arm.finish()
        yield from self._parts.statements.carry_out(clear_queue=clearQueueOnEnter, clear_at_end=clearOnEnd)

    def end_interpreter(self) -> None:
        """Make `interpreter_mode` return after the present statement."""
        self._parts.statements.end()

    def clear_interpreter(self) -> None:
        """Clear all statements with their variables, functions and threads."""
        self._parts.statements.clear()


class SafetyFunctions(FunctionGroup):
    """Stops, and watchdogs for clients."""

    title = "Safety"

    @costs(10)
    def protective_stop(self) -> Turns:
        """Make a protective stop, which pauses the program, or ends it if nothing follows. Secondary programs wait."""
        motion = self._access.motion
        motion.protect("the program asked for a protective stop")
        while motion.activity.protective and not self._arm.ends:
            yield

    @costs(10)
    def powerdown(self) -> Turns:
        """Power the arm off, which ends the program; the controller stays on."""
        yield from self._arm.finish()
        self._access.send(PowerOff(token=OWN_TOKEN), None)
        yield

    @costs(5)
    def rtde_set_watchdog(
        self,
        variable_name: object,
        min_frequency: Annotated[float, above_zero(500.0)],
        action: Annotated[str, word("pause", "stop", "ignore")] = "pause",
    ) -> None:
        """Pause or stop the program when a client writes an RTDE input less often than a frequency [Hz]."""
        if not isinstance(variable_name, str):
            raise Fault(f"variable_name is {shown(variable_name)}: it must be the name of an input variable")
        self._parts.watchdogs.watch(variable_name, min_frequency, action)
