"""Have every kernel compiled that a served robot calls, by driving one in process. Run while an image is built."""  # noqa: INP001  a script

from tvist_controller.loopback import LoopbackHost
from tvist_controller.planner import Planner
from tvist_protocol.codec import decode_reply, encode
from tvist_protocol.commands import MoveJ, TakeControl
from tvist_protocol.replies import Accepted, Done, Reply
from tvist_protocol.simulation import SimulationStep
from tvist_server.config import from_mapping

host = LoopbackHost(from_mapping({"clock": "lockstep", "truth": True}, "configuration").setup())


def ask(command: TakeControl | MoveJ | SimulationStep) -> Reply:
    """The reply to a command."""
    return decode_reply(host.request("build", encode(command)))


control = ask(TakeControl(client="build"))
assert isinstance(control, Accepted)
assert control.token is not None
assert isinstance(ask(MoveJ(token=control.token, q=(0.1, -3.0, 0.0, -1.5, 0.0, 0.0))), Accepted)
assert isinstance(ask(SimulationStep(token=control.token, ticks=500)), Done)

# What plans motions in space, for arms with and without closed-form inverse kinematics.
for robot in ("ur5e", "one-joint"):
    Planner(from_mapping({"robot": robot}, "configuration").setup()).rehearse()
