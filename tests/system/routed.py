"""A router as a process, and a client behind it."""

from tests.conformance.served import Served
from tests.conformance.wire import Wire


class Router(Served):
    """`tvist router`, as a user starts it; it has no robot, so it may run beside other tests."""

    program = ("-m", "tvist_cli", "router")

    def __init__(self, *options, endpoint=None, around=()):
        super().__init__(*options, name=None, endpoint=endpoint, around=around)

    def needs_the_machine(self, options):  # noqa: ARG002  as of any process
        return False


def far(endpoint, robot, namespace):
    """A client of a robot in a namespace."""
    return Wire(endpoint, robot, {"namespace": namespace} if namespace else ())
