"""Shell completion for the values of options, which are annotated like `Annotated[str, ROBOTS]`."""

from collections.abc import Iterable
from glob import escape, glob
from typing import TYPE_CHECKING, get_args

from cyclopts import Parameter

if TYPE_CHECKING:
    from cyclopts.completion import CompletionContext

NAMES = ("moves", "bench", "robustness", "match")


def _names(kind: str) -> Iterable[str]:
    """Return the names of a kind; modules are imported only on completion, so that help stays quick."""
    found: Iterable[str]
    match kind:
        case "robot":
            from tvist_plant.description import robots

            found = robots()
        case "pose":
            from tvist_plant.description import load

            found = sorted({name for robot in _names("robot") for name in load(robot).poses})
        case "shaper":
            from tvist_shaping import BUILT_IN

            found = BUILT_IN.names()
        case "compared":
            from tvist_lab.study.method_list import methods_in

            found = [one.name for one in methods_in()]
        case "plant":
            from tvist_controller.sources.own_plants import named_plants

            found = named_plants()
        case "study":
            found = NAMES
        case "source":
            found = ()
        case "world":
            from tvist_plant.world.scene_file import scenes

            found = scenes()
        case _:
            from tvist_server.options import ProfileName

            found = get_args(ProfileName)
    return found


def _offered(kind: str, *endings: str) -> Parameter:
    def complete(context: "CompletionContext") -> list[str]:
        typed, ends = escape(context.incomplete), (*endings, "/") if any(endings) else endings
        return [*_names(kind), *(file for end in ends for file in glob(f"{typed}*{end}"))]  # noqa: PTH207  a text

    return Parameter(completer=complete)


ROBOTS = _offered("robot", ".toml")
SHAPERS = _offered("shaper", ".py")
COMPARED = _offered("compared", ".py")  # shapers and baselines that studies compare
PLANTS = _offered("plant", ".py")
WORLDS = _offered("world", ".xml")
STUDIES = _offered("study", ".toml", ".py")
SOURCES = _offered("source", "")
PROFILES = _offered("profile")
POSES = _offered("pose")
