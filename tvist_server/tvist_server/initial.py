"""The state a robot starts in, from a file: the fields of `simulation.reset`."""

import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

from msgspec import Struct

from tvist_plant.user_file import read_bytes, read_toml
from tvist_protocol.content import checked, parse_json
from tvist_protocol.errors import ProtocolError
from tvist_protocol.values import Joints, Name, Payload, ResetMode, Seed
from tvist_server.setup import Setup


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
    shaper: Name | None = None
    """Shaper."""

    def on(self, setup: Setup) -> Setup:
        """A start with this state instead of its own, where there is something."""
        given: dict[str, Any] = {
            "q": self.q,
            "seed": self.seed,
            "carried": self.payload,
            "mode": self.mode,
            "shaper": self.shaper,
        }
        return replace(setup, **{name: value for name, value in given.items() if value is not None})


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
