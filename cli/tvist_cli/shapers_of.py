"""Load shapers given on the command line by name or as FILE.py:NAME."""

from typing import TYPE_CHECKING

from tvist_cli.failure import Misuse, failing_on

if TYPE_CHECKING:
    from tvist_controller.sources.own_shapers import OwnShaper
    from tvist_shaping import Shaper


def loaded(shaper: str) -> "tuple[str, tuple[OwnShaper, ...]]":
    """Return a shaper's name and, if it comes from a file, the loaded shaper."""
    from tvist_controller.sources.own_files import is_file

    if not is_file(shaper):
        return shaper.lower(), ()
    own = load_given(shaper)
    return own.name, (own,)


def load_given(place: str) -> "OwnShaper":
    """Load the shaper FILE.py:NAME."""
    from tvist_controller.sources.own_files import OwnFileError
    from tvist_controller.sources.own_shapers import load_own

    with failing_on(OwnFileError, exit_code=2):
        return load_own(place)


def of_impulses(shaper: str) -> "Shaper":
    """Load an impulse shaper by name or FILE.py:NAME. Refuse others: no mode determines their delay."""
    from tvist_shaping import SHAPERS, Shaper

    name, own = loaded(shaper)
    found = own[0].shaper if own else SHAPERS.get(name)
    if not isinstance(found, Shaper):
        if own:
            raise Misuse(f"shaper {shaper} has no impulses of one mode: give one that has")
        raise Misuse(f"shaper is {name!r}: must be FILE.py:NAME or one of {', '.join(SHAPERS)}")
    return found
