"""Shell completion for the values of options, which are annotated like `Annotated[str, ROBOTS]`."""

from collections.abc import Callable, Iterable
from glob import escape, glob
from pkgutil import resolve_name
from typing import TYPE_CHECKING, get_args

from cyclopts import Parameter

if TYPE_CHECKING:
    from cyclopts.completion import CompletionContext

NAMES = ("moves", "bench", "robustness", "match")


def _offered(names: str | Callable[[], Iterable[str]], *endings: str) -> Parameter:
    """Complete names, and files with these endings; import and call `MODULE:FUNCTION` only on completion."""

    def complete(context: "CompletionContext") -> list[str]:
        typed, ends = escape(context.incomplete), (*endings, "/") if any(endings) else endings
        found: Iterable[str] = resolve_name(names)() if isinstance(names, str) else names()
        return [*found, *(file for end in ends for file in glob(f"{typed}*{end}"))]  # noqa: PTH207  a text

    return Parameter(completer=complete)


def _compared() -> list[str]:
    from tvist_lab.study.method_list import methods_in

    return [method.name for method in methods_in()]


def _poses() -> list[str]:
    from tvist_plant.description import load, robots

    return sorted({name for robot in robots() for name in load(robot).poses})


ROBOTS = _offered("tvist_plant.description:robots", ".toml")
SHAPERS = _offered("tvist_shaping:BUILT_IN.names", ".py")
COMPARED = _offered(_compared, ".py")  # shapers and baselines that studies compare
PLANTS = _offered("tvist_controller.sources.own_plants:named_plants", ".py")
WORLDS = _offered("tvist_plant.world.scene_file:scenes", ".xml")
STUDIES = _offered(lambda: NAMES, ".toml", ".py")
SOURCES = _offered(tuple, "")
PROFILES = _offered(lambda: get_args(resolve_name("tvist_server.options:ProfileName")))
POSES = _offered(_poses)
