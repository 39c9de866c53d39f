"""What a shell offers as the value of an option: names that come with the package, and files of its kind.

A command annotates such an option with one of these, `Annotated[str, ROBOTS]`; the shell asks the program at TAB.
"""

from collections.abc import Callable, Iterable
from glob import escape, glob
from typing import TYPE_CHECKING

from cyclopts import Parameter

if TYPE_CHECKING:
    from cyclopts.completion import CompletionContext


def _offered(names: Callable[[], Iterable[str]], ending: str | None = None) -> Parameter:
    def complete(context: "CompletionContext") -> list[str]:
        typed, ends = escape(context.incomplete), () if ending is None else (ending, "/")
        return [*names(), *(file for end in ends for file in glob(f"{typed}*{end}"))]  # noqa: PTH207  a text

    return Parameter(completer=complete)


# These are called when something is completed, and import what they need then, so that help stays quick.


def _robots() -> Iterable[str]:
    from tvist_plant.description import robots

    return robots()


def _poses() -> Iterable[str]:
    from tvist_plant.description import load

    return sorted({name for robot in _robots() for name in load(robot).poses})


def _shapers() -> Iterable[str]:
    from tvist_shaping import BUILT_IN

    return BUILT_IN.names()


def _compared() -> Iterable[str]:
    from tvist_lab.study.menus import UNSHAPED, names

    return (UNSHAPED, *names("bench"))


def _plants() -> Iterable[str]:
    from tvist_controller.sources.own_plants import named_plants

    return named_plants()


def _worlds() -> Iterable[str]:
    from tvist_plant.world.scene_file import scenes

    return scenes()


def _profiles() -> Iterable[str]:
    from typing import get_args

    from tvist_server.profiles import ProfileName

    return get_args(ProfileName)


ROBOTS = _offered(_robots, ".toml")
SHAPERS = _offered(_shapers, ".py")
COMPARED = _offered(_compared)
"""Shapers and baselines that ShaperBench compares."""
PLANTS = _offered(_plants, ".py")
WORLDS = _offered(_worlds, ".xml")
PROFILES = _offered(_profiles)
POSES = _offered(_poses)
