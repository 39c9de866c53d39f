"""`tvist serve`: run a robot."""

import gc
from typing import Annotated, Any

from cyclopts import Parameter

from tvist_cli.failure import Misuse
from tvist_cli.robot_options import configuration, with_robot_options


@with_robot_options()
def serve(
    *,
    compile_only: Annotated[
        list[int] | None, Parameter(name="--compile", consume_multiple=(0, 1), allow_repeating=False)
    ] = None,
    config: str | None = None,
    **given: Any,
) -> None:
    """Run one or more robots on the network until Control+C, SIGTERM, SIGQUIT or the terminal closes.

    The first start after an installation or update compiles the robot's computations and plans for this processor. The
    machine code is kept in the user's cache folder, or in the folder that NUMBA_CACHE_DIR names.

    Args:
        compile_only: Compile now and serve nothing, so that later starts are quick; a number sets the number
            of processes [one for each processor].
        config: Read any of the other options from this TOML file; options on the command line take precedence.
        given: Fields of `ServeConfig`.
    """
    from tvist_cli.serving import compile_all, serve_robots

    gc.freeze()  # what is imported lives until the end
    gc.enable()
    if compile_only is None:
        serve_robots(configuration(given, config))
    elif given or config is not None:
        raise Misuse("--compile serves nothing: leave the other options out")
    else:
        compile_all(*compile_only)
