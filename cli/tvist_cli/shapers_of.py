"""Load shapers that a command line names, or gives as FILE.py:NAME."""

from typing import TYPE_CHECKING

from tvist_cli.failure import told

if TYPE_CHECKING:
    from tvist_controller.own_shapers import OwnShaper


def loaded(shaper: str) -> "tuple[str, tuple[OwnShaper, ...]]":
    """Return the name of a shaper, and the shaper loaded from its file, if any.

    Args:
        shaper: A name in any case, or FILE.py:NAME.

    Raises:
        Failure: The file contains no such shaper.
    """
    from tvist_controller.own_shapers import is_file

    if not is_file(shaper):
        return shaper.lower(), ()
    own = load_given(shaper)
    return own.name, (own,)


def load_given(place: str) -> "OwnShaper":
    """Load the shaper of FILE.py:NAME.

    Raises:
        Failure: The file contains no such shaper, or no file is named.
    """
    from tvist_controller.own_shapers import OwnShaperError, load_own

    with told(OwnShaperError, code=2):
        return load_own(place)
