"""Studies the motions of a robot in a thread beside the controller's thread."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from tvist_controller.safety.experience import Work


class Studies:
    """Makes studies one at a time. The robot takes their lessons at a tick that its journal records."""

    def __init__(self) -> None:
        self._thread = ThreadPoolExecutor(1, "tvist-studies")
        # If the tick thread started it, it would inherit that thread's priority.
        self._thread.submit(int)

    def later(self, work: Work) -> Callable[[], bool]:
        """Start a study; return a function that tells whether it has ended."""
        return self._thread.submit(work).done

    def close(self) -> None:
        """Finish the current study; call this after the controller's thread has ended."""
        self._thread.shutdown(cancel_futures=True)
