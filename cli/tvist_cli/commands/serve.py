"""`tvist serve`: run a robot."""

from typing import Annotated, Any

from cyclopts import Parameter

from tvist_cli.failure import Failure
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

    The first start after an installation or an update compiles what a robot computes at every tick and in its plans for
    this processor. Machine code is kept in the user's cache folder, or in the folder that NUMBA_CACHE_DIR names.

    Args:
        compile_only: Only compile, so that no start has to, in as many processes as the number says [one on each
            processor]; serve nothing.
        config: TOML file with any of the other options; options on the command line take precedence.
        given: Fields of `ServeConfig`.
    """
    from tvist_cli.serving import compile_all, serve_robots

    if compile_only is None:
        serve_robots(configuration(given, config))
    elif given or config is not None:
        raise Failure("--compile serves nothing: leave the other options out", code=2)
    else:
        compile_all(*compile_only)
