"""Reads program files: URScript, or those of PolyScope with installation and variables files beside them."""

import zlib
from functools import lru_cache
from pathlib import Path

from tvist_plant.user_file import LARGEST, UserFileError, read_bytes, xml
from tvist_server.polyscope.installation import Installation
from tvist_server.polyscope.nodes import NONE, Choices
from tvist_server.polyscope.script import script_of

_GZIP, _XML = b"\x1f\x8b", b"<"


def read_program(path: Path, choices: Choices = NONE) -> str:
    """Return the text of a program, translated if PolyScope saved it.

    Raises UserFileError if it is no program or has nodes that cannot be translated, OSError if it cannot be read.
    """
    return text_of(path, read_bytes(path, "program"), choices)


def text_of(path: Path, data: bytes, choices: Choices = NONE) -> str:
    """Return the text of a program from the content of its file; see `read_program`."""
    data = unpacked(f"program {path}", data)
    try:
        if data.lstrip().startswith(_XML):
            return script_of(path.stem, xml(data), lambda name: _installation(path, name), choices)
        return data.decode("utf-8-sig")
    except UserFileError as error:
        raise UserFileError(f"program {path}: {error}") from error
    except UnicodeDecodeError as error:
        raise UserFileError(
            f"program {path} is not text in UTF-8 at byte {error.start}: save it as UTF-8"
        ) from error


def unpacked(what: str, data: bytes) -> bytes:
    """Return the content of a file that may be packed by gzip."""
    if not data.startswith(_GZIP):
        return data
    unpack = zlib.decompressobj(wbits=zlib.MAX_WBITS | 16)
    try:
        data = unpack.decompress(data, LARGEST)
    except zlib.error as error:
        raise UserFileError(f"{what} is packed, and cannot be unpacked: {error}; copy it again") from error
    if not (unpack.eof or unpack.unconsumed_tail):
        raise UserFileError(f"{what} is packed, and its end is missing: copy it again")
    if unpack.unconsumed_tail:
        raise UserFileError(f"{what} has more than {LARGEST >> 20} MiB when it is unpacked")
    return data


def _installation(program: Path, name: str) -> Installation:
    """Return the installation of a name beside a program or one folder above; empty if there is none."""
    for folder in program.parents[:2]:
        path = folder / f"{Path(name).name}.installation"
        if path.is_file():
            variables = path.with_suffix(".variables")
            values = read_bytes(variables, "variables") if variables.is_file() else b""
            return _parsed(path, read_bytes(path, "installation"), values)
    return Installation()


@lru_cache(maxsize=1)  # the programs of a folder share it
def _parsed(path: Path, data: bytes, variables: bytes) -> Installation:
    what = f"installation {path}"
    try:
        tree, values = xml(unpacked(what, data)), unpacked(f"variables of {what}", variables)
        return Installation.of(tree, _values(values))
    except ValueError as error:
        raise UserFileError(f"{what}: {error}") from error


def _values(data: bytes) -> dict[str, str]:
    """Return the variables of a variables file: XML, or lines in older ones."""
    if data.lstrip().startswith(_XML):
        return {one.get("name") or "": one.get("value") or "" for one in xml(data).iter("variable")}
    lines = (line.partition("=") for line in data.decode(errors="replace").splitlines())
    return {name: value for name, equals, value in lines if equals and not name.startswith("#")}
