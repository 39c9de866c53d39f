"""A router in a process."""

from tests.conformance.served import Served


class Router(Served):
    program = ("-m", "tvist_cli", "router")

    def __init__(self, *options, endpoint=None, around=()):
        super().__init__(*options, name=None, endpoint=endpoint, around=around)
