"""The state a robot starts in, from a file: the fields of `simulation.reset`."""

import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

from msgspec import Meta, Struct

from tvist_controller.own_shapers import is_file, load_own
from tvist_controller.setup import Setup
from tvist_plant.user_file import read_bytes, read_toml
from tvist_protocol.content import checked, parse_json
from tvist_protocol.errors import ProtocolError
from tvist_protocol.values import Joints, Payload, ResetMode, Seed

ShaperChoice = Annotated[str, Meta(min_length=1, max_length=4096)]


class InitialState(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What is None is as without the file."""

    q: Joints | None = None
    """Where the arm rests, one angle a joint [rad]."""
    seed: Seed | None = None
    """Of sensor noise and gear errors."""
    payload: Payload | None = None
    """What the arm carries, whatever is declared."""
    mode: ResetMode | None = None
    """Robot mode."""
    shaper: ShaperChoice | None = None
    """Shaper: its name, or FILE.py:NAME."""

    def on(self, setup: Setup) -> Setup:
        """A start with this state instead of its own, where there is something.

        Raises:
            OwnShaperError: There is no such shaper in the file it names.
            UserFileError: It names something that is no file of that size.
        """
        if self.shaper is not None:
            setup = shaped_by(setup, self.shaper)
        given: dict[str, Any] = {
            "q": self.q,
            "seed": self.seed,
            "carried": self.payload,
            "mode": self.mode,
        }
        return replace(setup, **{name: value for name, value in given.items() if value is not None})


def shaped_by(setup: Setup, shaper: str) -> Setup:
    """A start with another shaper.

    Args:
        setup: The start.
        shaper: Name of a shaper, or FILE.py:NAME, which is then loaded.

    Raises:
        OwnShaperError: There is no such shaper in the file.
        UserFileError: It is no file of that size.
    """
    if not is_file(shaper):
        return replace(setup, shaper=shaper)
    own = load_own(shaper)
    known = setup.own_shapers if own in setup.own_shapers else (*setup.own_shapers, own)
    return replace(setup, shaper=own.name, own_shapers=known)


class InitialStateError(ValueError):
    """A file holds no state to start in; the sentence says why."""


def read_state(path: str) -> InitialState:
    """Read a TOML file, or a JSON file where its name ends so.

    Raises:
        InitialStateError: It cannot be read, or a field is unknown or out of range.
        UserFileError: It is no file with a text of that size, or is nested too deeply.
    """
    try:
        is_json = Path(path).suffix == ".json"
        content = parse_json(read_bytes(path, "state")) if is_json else read_toml(path, "state")
        return checked(content, InitialState)
    except OSError as error:
        raise InitialStateError(f"state {path}: {error.strerror}") from error
    except tomllib.TOMLDecodeError as error:
        raise InitialStateError(f"state {path}: it is no TOML: {error}") from error
    except ProtocolError as error:
        raise InitialStateError(f"state {path}: {error.why}") from error
