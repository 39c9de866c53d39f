"""A delay line with fractional delays, so that impulses can lie between two ticks.

If delays were rounded to ticks, the shaped reference would jump whenever a delay changes by one tick (Fig. 7 of the
paper). Lagrange interpolation through four samples makes it smooth. It has no state, so a delay may change at every
tick without a transient, and it reproduces cubics exactly (for fractional delays, see Laakso et al., 1996).
"""

import numpy as np
import numpy.typing as npt

from tvist_kernels.compiling import compiled
from tvist_shaping._types import Floats, Forkable
from tvist_shaping.errors import DelayError, ShapingError

_MARGIN = 3  # samples needed beyond a delay: two older ones for interpolation, and the newest with delay 0


@compiled
def gather(buffer: Floats, newest: int, A: Floats, delays: Floats, first: Floats, out: Floats) -> int:
    """Compute a weighted sum of delayed samples; the formula is in `DelayLine.gather`.

    The buffer is a ring, shape (capacity, joints); `newest` is the row of the newest sample. Return -1, or the index of
    the first delay that exceeds the buffer; `out` is then unchanged.
    """
    capacity, joints = buffer.shape
    for j in range(A.shape[0]):
        if not 0.0 <= delays[j] <= capacity - _MARGIN:
            return j
    for j in range(A.shape[0]):
        delay = delays[j]
        whole = int(delay)
        # Interpolate between nodes at the delays start … start + 3, with the delay between the second and the third.
        # Below one tick there is no newer sample, so the delay is between the first and the second.
        start = max(whole - 1, 0)
        s = delay - start
        w0 = -(s - 1.0) * (s - 2.0) * (s - 3.0) / 6.0
        w1 = s * (s - 2.0) * (s - 3.0) / 2.0
        w2 = -s * (s - 1.0) * (s - 3.0) / 2.0
        w3 = s * (s - 1.0) * (s - 2.0) / 6.0
        near, n0 = newest - whole, newest - start
        near += capacity if near < 0 else 0
        n0 += capacity if n0 < 0 else 0
        n1 = n0 - 1 if n0 > 0 else capacity - 1
        n2 = n1 - 1 if n1 > 0 else capacity - 1
        n3 = n2 - 1 if n2 > 0 else capacity - 1
        for k in range(joints):
            x = buffer[near, k]
            if delay != whole:
                # The weights sum to 1. Applied to differences, they preserve a constant to the last bit.
                x += (
                    w0 * (buffer[n0, k] - x)
                    + w1 * (buffer[n1, k] - x)
                    + w2 * (buffer[n2, k] - x)
                    + w3 * (buffer[n3, k] - x)
                )
            if j == 0:
                first[k] = x
                out[k] = x
            else:
                out[k] += A[j] * (x - first[k])
    return -1


class DelayLine(Forkable):
    """The latest samples of a reference, which can be read at any fractional delay.

    Attributes:
        joints: Number of entries of a sample.
        capacity: Number of samples in the buffer.
        max_delay: Longest delay that can be read [ticks].
        still: Number of newest samples that are equal to the last bit, at least 1. It may exceed the capacity.
        ring: Ring buffer of samples, shape (capacity, joints).
        head: Row of the newest sample in it.
        scratch: Scratch of `gather`, shape (joints,).
    """

    def __init__(self, joints: int, capacity: int) -> None:
        """Create a line filled with zeros.

        Args:
            joints: Number of entries of a sample, >= 1.
            capacity: Number of samples in the buffer, >= 4; the longest delay is three ticks less.

        Raises:
            ShapingError: joints or capacity is too small.
        """
        for name, value, least in (("joints", joints, 1), ("capacity", capacity, _MARGIN + 1)):
            if value < least:
                raise ShapingError(f"{name} is {value}: must be at least {least}")
        self.joints, self.capacity = joints, capacity
        self.max_delay = capacity - _MARGIN
        self.ring: Floats = np.zeros((capacity, joints))
        self.scratch: Floats = np.zeros(joints)
        self.head = 0
        self.fill(self.scratch)

    def fill(self, q: npt.ArrayLike) -> None:
        """Fill the line as if the reference had always been at q.

        Args:
            q: Sample, shape (joints,), finite.

        Raises:
            ShapingError: q has another shape.
        """
        sample = self._sample(q)
        self.ring[:] = sample
        self.still, self._bits = self.capacity, sample.tobytes()

    def push(self, q: npt.ArrayLike) -> None:
        """Append the newest sample, and drop the oldest.

        Args:
            q: Sample, shape (joints,), finite.

        Raises:
            ShapingError: q has another shape.
        """
        sample = self._sample(q)
        head = self.head = (self.head + 1) % self.capacity
        self.ring[head] = sample
        bits = sample.tobytes()  # the fastest comparison
        self.still = self.still + 1 if bits == self._bits else 1
        self._bits = bits

    def pushed(self, samples: Floats, head: int) -> None:
        """Update the state after a kernel has appended samples to the ring."""
        rows = [sample.tobytes() for sample in samples[-self.capacity :]]
        equal = 0
        for bits in reversed(rows):
            if bits != rows[-1]:
                break
            equal += 1
        goes_on = equal == len(rows) and rows[0] == self._bits
        self.still = self.still + len(samples) if goes_on else equal
        self.head, self._bits = head, rows[-1]

    def newest(self, count: int) -> Floats:
        """Return the latest samples, oldest first, shape (count, joints); count is at most the capacity."""
        return self.ring[(self.head - np.arange(count - 1, -1, -1)) % self.capacity]

    def take_over(self, other: "DelayLine") -> None:
        """Copy the content of another line; if the other line is shorter, its oldest sample fills the rest.

        Args:
            other: The line to copy from; it is not changed.

        Raises:
            ShapingError: The other line contains samples of a different shape.
        """
        kept = min(self.capacity, other.capacity)
        samples = other.newest(kept)
        self.fill(samples[0])
        self.ring[:kept] = samples
        self.head = kept - 1
        self._bits = other._bits  # noqa: SLF001  one of its own kind
        self.still = other.still if other.still < other.capacity else max(other.still, self.capacity)

    def gather(self, A: Floats, delays: Floats, out: Floats) -> None:
        """Convolve the reference with impulses, eq. (10) of the paper.

            y = x(d_1) + Σ_{j>1} A_j (x(d_j) - x(d_1))

        This equals Σ A_j x(d_j) for ΣA = 1, in a form that returns a constant reference as exactly the same floats. A
        whole delay uses the sample itself; a delay between two samples uses the cubic through the four nearest
        samples; a delay below one tick uses the cubic through the newest four. (A cubic may overshoot the samples: by
        at most 1/8 of their range, or 1/3 below one tick, and negligibly if the reference is smooth.)

        Args:
            A: Amplitudes [-], shape (N,), sum 1.
            delays: Delays d_j [ticks], shape (N,), each 0 to `max_delay`.
            out: Array that receives y, shape (joints,).

        Raises:
            DelayError: A delay is not a number or not from 0 to `max_delay`; `out` is not changed.
        """
        refused = gather(self.ring, self.head, A, delays, self.scratch, out)
        if refused >= 0:
            raise DelayError(float(delays[refused]), self.max_delay)

    def _sample(self, q: npt.ArrayLike) -> Floats:
        sample = np.asarray(q, dtype=float)
        if sample.shape != (self.joints,):
            raise ShapingError(f"q has shape {sample.shape}: must be ({self.joints},)")
        return sample
