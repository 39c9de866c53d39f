"""The end of an RTDE connection that also writes: it claims inputs, and sends their values."""

from collections.abc import Mapping, Sequence
from struct import Struct

from tvist_server.rtde.client import RtdeClient, RtdeError
from tvist_server.rtde.codec import PackageKind, package, words
from tvist_server.rtde.wire import Field, Wire


class CommandingClient(RtdeClient):
    """Reads one robot's outputs, and writes its inputs.

    Args:
        needed: See `RtdeClient`.
        optional: See `RtdeClient`.
        inputs: Types of the inputs to claim, by name; none is a vector.
    """

    def __init__(
        self, needed: Mapping[str, Field], optional: Mapping[str, Field], inputs: Mapping[str, Wire]
    ) -> None:
        super().__init__(needed, optional)
        self._inputs = inputs
        self._written = Struct(">B" + "".join(wire.value for wire in inputs.values()))
        self._claimed = 0

    def _begin_rows(self) -> bytes:
        return words(PackageKind.SETUP_INPUTS, b"", self._inputs)

    def _answered(self, kind: int, payload: bytes) -> bytes:
        if kind == PackageKind.SETUP_INPUTS:
            self._take_claim(payload)
            return super()._begin_rows()
        return super()._answered(kind, payload)

    def _take_claim(self, payload: bytes) -> None:
        """Check that all inputs are ours.

        Raises:
            RtdeError: Some are not; the message says what to do.
        """
        found = payload[1:].decode("ascii", "replace").removesuffix(",").split(",")
        if len(found) != len(self._inputs):
            raise RtdeError(f"it names {len(found)} types for {len(self._inputs)} inputs")
        by_word: dict[str, list[str]] = {}
        for name, word in zip(self._inputs, found, strict=True):
            by_word.setdefault(word, []).append(name)
        if names := by_word.get("IN_USE"):
            raise RtdeError(
                f"another client holds its inputs {names[0]} to {names[-1]}: end that client, such as a fieldbus, a "
                "driver or another tvist, and start again"
            )
        if names := by_word.get("NOT_FOUND"):
            raise RtdeError(
                f"it does not know its inputs {names[0]} to {names[-1]}: update its software to one with 48 registers"
            )
        for name, wire in self._inputs.items():
            if name not in by_word.get(wire.name, ()):
                raise RtdeError(f"its input {name} is not of type {wire.name}")
        self._claimed = payload[0]

    def write(self, numbers: Sequence[float]) -> bytes:
        """Return a package with the values of all inputs, in their order, once the connection has started."""
        return package(PackageKind.DATA, self._written.pack(self._claimed, *numbers))
