"""Wires from digital outputs to digital inputs, which follow after a number of ticks."""

from collections import deque
from collections.abc import Sequence

from tvist_controller.cell.description import Wire, bit_of


class Wires:
    """The wires of a cell.

    Args:
        wires: The wires.
    """

    def __init__(self, wires: Sequence[Wire]) -> None:
        self._wires = [(bit_of(one.output), bit_of(one.input), one.ticks, one.inverted) for one in wires]
        self._outputs: int | None = None
        """Outputs of the last tick; None before the first."""
        # Those of one wire are in order of time, as its delay is always the same.
        self._under_way: list[deque[tuple[int, bool]]] = [deque() for _ in wires]
        self._left = 0

    def tick(self, tick: int, outputs: int) -> tuple[int, int]:
        """Return which inputs change for the next tick, and to what, as bits: a mask and values.

        Inputs change only when their wire does, so that other signals stay until then.

        Args:
            tick: Number of the tick that has been computed.
            outputs: Its digital outputs.
        """
        if outputs == self._outputs and not self._left:
            return 0, 0
        before, self._outputs = self._outputs, outputs
        mask = values = 0
        for (output, input_, ticks, inverted), waiting in zip(self._wires, self._under_way, strict=True):
            on = bool(outputs & output) != inverted
            if before is None:  # as if the outputs had been so for a long time
                mask, values = mask | input_, values | (input_ if on else 0)
            elif (before ^ outputs) & output:
                waiting.append((tick + ticks, on))
                self._left += 1
            while waiting and waiting[0][0] <= tick + 1:
                _, on = waiting.popleft()
                self._left -= 1
                mask, values = mask | input_, values & ~input_ | (input_ if on else 0)
        return mask, values
