"""Answers to clients while robots are starting."""

from collections.abc import Callable
from functools import partial

from tvist_protocol.codec import encode
from tvist_protocol.replies import Refused
from tvist_server.gateways.base import Answer, QueryHandler

Tell = Callable[[int, int], None]  # takes the number of compiled kernels and of all kernels
Prepare = Callable[[Tell], None]  # does the slow work that precedes the creation of robots


class Starting(QueryHandler):
    """Refuses every query to robots that are starting, and reports the progress."""

    def __init__(self) -> None:
        self._how_far = ""

    def note(self, done: int, total: int) -> None:
        self._how_far = f"{done} of {total} kernels are compiled; "

    def request(self, data: bytes, answer: Answer) -> None:  # noqa: ARG002  whatever it is
        answer(self._refused())

    def info(self, answer: Callable[[Callable[[], bytes]], None]) -> None:
        answer(partial(encode, self._refused()))

    def _refused(self) -> Refused:
        return Refused(code="starting", where="", why=f"the robot is starting: {self._how_far}try again")
