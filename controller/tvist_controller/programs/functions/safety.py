"""Functions for protective stops and watchdogs."""

from tvist_controller.programs.access import Access
from tvist_controller.programs.arguments import positive, shown
from tvist_controller.programs.arm import ProgramArm
from tvist_controller.programs.journey import Turns
from tvist_controller.programs.moves import OWN_TOKEN
from tvist_controller.programs.watchdogs import Watchdogs
from tvist_protocol.commands import PowerOff
from tvist_urscript import Fault, costs


class SafetyFunctions:
    """Stops the robot, or has it stopped when a client falls silent.

    Args:
        access: The robot.
        arm: Its arm.
        watchdogs: Watchdogs of its programs.
    """

    def __init__(self, access: Access, arm: ProgramArm, watchdogs: Watchdogs) -> None:
        self._access, self._arm, self._watchdogs = access, arm, watchdogs

    @costs(10)
    def protective_stop(self) -> Turns:
        """Make a protective stop, which pauses the program here, or ends it if nothing follows; secondary ones wait."""
        motion = self._access.motion
        motion.protect("the program asked for a protective stop")
        while motion.activity.protective and not self._arm.ends:
            yield

    @costs(10)
    def powerdown(self) -> Turns:
        """Switch the arm's power off, which ends the program; the controller stays on."""
        yield from self._arm.finish()
        self._access.send(PowerOff(token=OWN_TOKEN), None)
        yield

    @costs(5)
    def rtde_set_watchdog(
        self, variable_name: object, min_frequency: object, action: object = "pause"
    ) -> None:
        """Pause or stop the program when a client writes an input of RTDE less often than a frequency [Hz]."""
        if action not in {"pause", "stop", "ignore"}:
            raise Fault(f'action is {shown(action)}: it must be "pause", "stop" or "ignore"')
        if not isinstance(variable_name, str):
            raise Fault(f"variable_name is {shown(variable_name)}: it must be the name of an input variable")
        self._watchdogs.watch(variable_name, positive("min_frequency", min_frequency, 500.0), str(action))
