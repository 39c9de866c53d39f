"""Configurations from files and other maps of values."""

import tomllib

from tvist_plant import user_file
from tvist_protocol.content import checked
from tvist_protocol.errors import ProtocolError
from tvist_server.config import ConfigError, ServeConfig

_INSTEAD = {
    "name": "leave name out, since several robots are named after their files",
    "robot": "add it to the list of robots",
}
"""What to do with a key that excludes `robots`."""


def from_mapping(content: object, source: str) -> ServeConfig:
    """Check a mapping of values and convert it.

    Raises:
        ConfigError: A key is unknown, a value is out of range, or one key excludes another.
    """
    if isinstance(content, dict) and content.get("robots") is not None:
        for key in ("name", "robot"):
            if content.get(key) is not None:
                raise ConfigError(f"{source}: robots and {key} exclude each other: {_INSTEAD[key]}")
    try:
        return checked(content, ServeConfig)
    except ProtocolError as error:
        raise ConfigError(f"{source}: {error.why}") from error


def read_toml(path: str) -> dict[str, object]:
    """Return the unchecked content of a configuration file.

    Raises:
        ConfigError: The file cannot be read, or is not TOML.
        UserFileError: The file is not text, too large or nested too deeply.
    """
    try:
        return user_file.read_toml(path, "configuration")
    except OSError as error:
        raise ConfigError(f"configuration {path}: {error.strerror}") from error
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(f"configuration {path}: it is not valid TOML: {error}") from error
