"""A router in a process, and clients behind it."""

from tests.conformance.served import Served
from tests.conformance.wire import Wire


class Router(Served):
    """`tvist router` in a process."""

    program = ("-m", "tvist_cli", "router")

    def __init__(self, *options, endpoint=None, around=()):
        super().__init__(*options, name=None, endpoint=endpoint, around=around)


def far(endpoint, robot, namespace):
    """Return a client of a robot in a namespace."""
    return Wire(endpoint, robot, {"namespace": namespace} if namespace else ())
