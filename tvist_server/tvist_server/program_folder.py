"""Folder with programs that clients load by name."""

from pathlib import Path, PurePosixPath

import msgspec

from tvist_controller.dispatch.admission import Admitted
from tvist_plant.user_file import UserFileError, read_bytes
from tvist_protocol.codec import decode, encode
from tvist_protocol.info import Info
from tvist_protocol.programs import MAX_SCRIPT, ProgramLoad
from tvist_protocol.replies import Refused
from tvist_server.polyscope.files import text_of

SCRIPT, URP = ".script", ".urp"
"""File endings. A script is URScript text; a .urp file is the same, or a program saved by PolyScope."""


class ProgramFolder:
    """Programs in a folder (None: no programs), which is read each time a client loads or lists programs."""

    def __init__(self, path: Path | None = None) -> None:
        self.path = path

    @classmethod
    def of(cls, path: Path, robot: str) -> "ProgramFolder":
        """Return a robot's folder: the subfolder of `path` named after the robot, if any, else `path`."""
        own = path / robot
        return cls(own if own.is_dir() else path)

    def names(self) -> list[str]:
        """Return the names of the files; none if there is no folder."""
        if self.path is None:
            return []
        try:
            return sorted(entry.name for entry in self.path.iterdir() if entry.suffix in {SCRIPT, URP})
        except OSError:
            return []

    def read(self, name: str) -> str | None:
        """Return a program's text, ignoring folders in `name`; None: no file. UserFileError if no program."""
        file = PurePosixPath(name).name
        candidates = [file, file.removesuffix(URP) + SCRIPT] if file.endswith(URP) else [file]
        for candidate in candidates:
            if self.path is None or (path := self.path / candidate).suffix not in {SCRIPT, URP}:
                continue
            try:
                data = read_bytes(path, "program")
            except FileNotFoundError:
                continue
            except (OSError, ValueError) as error:  # a name may contain characters that no file name can
                raise UserFileError(f"program {str(path)!r} cannot be read: {error}") from error
            return _checked(path, text_of(path, data))
        return None

    def complete(self, admitted: Admitted) -> Admitted | Refused:
        """If a command loads a program of the folder, add the program's text, so that the journal has it."""
        command = admitted.command
        if not isinstance(command, ProgramLoad) or command.text is not None:
            return admitted
        try:
            text = self.read(command.name)
        except UserFileError as error:
            return Refused(code="out_of_range", where="name", why=str(error))
        if text is None:
            return admitted
        command = msgspec.structs.replace(command, text=text)
        return admitted._replace(command=command, content=msgspec.to_builtins(command))

    def listed(self, info: bytes) -> bytes:
        """Add the names of the files to `programs` of an encoded `info`."""
        if not (names := self.names()):
            return info
        content = decode(Info, info)
        return encode(msgspec.structs.replace(content, programs=sorted({*content.programs, *names})))


def _checked(path: Path, text: str) -> str:
    if not text.strip() or len(text) > MAX_SCRIPT:
        raise UserFileError(
            f"program {path} has {len(text)} characters: a program has at least one and at most {MAX_SCRIPT}"
        )
    return text
