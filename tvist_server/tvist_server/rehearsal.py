"""What a robot does before its first tick, so that no tick loads compiled code, which takes several ticks."""

from tvist_controller.controller import Controller
from tvist_controller.line import rehearsal


def rehearse(controller: Controller) -> None:
    """Run once the line, the look-ahead of streams and the encoding of a state; the robot stands as before."""
    rehearsal.rehearse(controller.cycle)
    controller.motion.ahead.rehearse()
    _ = controller.report.encoded
