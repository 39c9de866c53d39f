"""`tvist kernels`: compile ahead what a robot calls at every tick."""

import time

from tvist_cli.failure import Failure, told
from tvist_cli.output import say
from tvist_cli.serving import compile_shown


def kernels(*, processes: int | None = None) -> None:
    """Compile what a robot computes at every tick and in its plans for this processor, so that no start has to.

    The first tvist serve after an installation or an update does the same. Machine code is kept beside the sources, or
    in the user's cache folder where those cannot be written, or in the folder that NUMBA_CACHE_DIR names.

    Args:
        processes: Number of processes that compile at once [one on each processor].
    """
    if processes is not None and processes < 1:
        raise Failure(f"processes is {processes}: must be at least 1", code=2)
    from tvist_server.kernels import KernelsError

    began = time.monotonic()
    with told(KernelsError):
        compile_shown(processes)
    say(f"everything is compiled, after {time.monotonic() - began:.0f} s")
