"""Thread that studies the motions of a robot next to the controller's thread."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from tvist_controller.safety.experience import Work


class Studies:
    """Makes studies one after the other. The robot takes their lessons at a tick that its journal names."""

    def __init__(self) -> None:
        self._thread = ThreadPoolExecutor(1, "tvist-studies")
        # Begun by the tick thread, it would inherit its priority.
        self._thread.submit(int)

    def later(self, work: Work) -> Callable[[], bool]:
        """Have a study made; returns what tells whether it has ended."""
        return self._thread.submit(work).done

    def close(self) -> None:
        """Finish the current study; to be called after the controller's thread has ended."""
        self._thread.shutdown(cancel_futures=True)
