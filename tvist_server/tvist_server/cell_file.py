"""A cell, read from a TOML file."""

import tomllib
from pathlib import Path

from msgspec.structs import replace

from tvist_controller.cell.description import Cell, CellError
from tvist_plant.user_file import read_toml
from tvist_plant.world.scene_file import scenes
from tvist_protocol.content import checked
from tvist_protocol.errors import ProtocolError


def read_cell(path: str) -> Cell:
    """Read a cell and check it.

    Raises:
        CellError: The file cannot be read, or a key is unknown, missing or out of range; the message says which.
        UserFileError: The file is not text, too large or nested too deeply.
    """
    try:
        cell = checked(read_toml(path, "cell"), Cell)
        if cell.world is not None and cell.world not in scenes():  # beside the cell's own file
            cell = replace(cell, world=str(Path(path).parent / cell.world))
        cell.check()
    except OSError as error:
        raise CellError(f"cell {path}: {error.strerror}") from error
    except tomllib.TOMLDecodeError as error:
        raise CellError(f"cell {path}: it is not valid TOML: {error}") from error
    except ProtocolError as error:
        raise CellError(f"cell {path}: {error.why}") from error
    except CellError as error:
        raise CellError(f"cell {path}: {error}") from error
    return cell
