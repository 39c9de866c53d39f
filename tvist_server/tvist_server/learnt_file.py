"""The file in which a robot keeps what it has learnt of its motions."""

from collections.abc import Callable, Sequence
from hashlib import sha256
from pathlib import Path
from typing import Literal

import msgspec
from msgspec import Struct

from tvist_controller.experience.motion_student import LearntMotion, MotionStudent
from tvist_controller.host import Host
from tvist_controller.setup import Setup
from tvist_plant.fingerprint import fingerprint
from tvist_plant.user_file import UserFileError, read_bytes
from tvist_protocol.content import checked, parse_json
from tvist_protocol.errors import ProtocolError


class LearntFileError(ValueError):
    """What was learnt cannot be used; the message names the file and says why."""


class _Content(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    version: Literal[1] = 1
    robot: str
    """Fingerprint of the arm."""
    calibration: str
    """Digest of the calibration."""
    motions: tuple[LearntMotion, ...]


class LearntFile:
    """The file of one robot.

    Args:
        path: Its path; the file need not exist, but its folder must.
        setup: The robot's initial setup.

    Raises:
        LearntFileError: The file cannot be read, or belongs to another arm.
    """

    def __init__(self, path: Path, setup: Setup) -> None:
        self._path, self._description = path, setup.description
        self._robot = fingerprint(setup.description)
        calibration = msgspec.json.encode(setup.calibration, order="sorted")
        self._calibration = sha256(calibration).hexdigest()[:16]
        self.ignored: str | None = None
        """Why nothing of the file is used; None if it is."""
        self.motions: tuple[LearntMotion, ...] = self._read()
        """What was learnt in earlier runs."""

    def write(self, motions: Sequence[LearntMotion]) -> None:
        """Write the file anew, in one step, so that a robot that ends meanwhile leaves a whole one.

        Raises:
            OSError: It cannot be written.
        """
        content = _Content(robot=self._robot, calibration=self._calibration, motions=tuple(motions))
        beside = self._path.with_name(f".{self._path.name}.new")
        beside.write_bytes(msgspec.json.format(msgspec.json.encode(content), indent=1) + b"\n")
        beside.replace(self._path)

    def student(self, tell: Callable[[str], None]) -> MotionStudent:
        """Return who learns the robot's motions and keeps them in the file; `tell` tells if that is not possible."""
        return MotionStudent(self._description, self.motions, self.keeper(tell))

    def recall(self, host: Host) -> None:
        """Let a robot take what was learnt in earlier runs, before its first tick."""
        host.recall(one.lesson for one in self.motions)
        if self.ignored is not None:
            host.warn(self.ignored)

    def keeper(self, tell: Callable[[str], None]) -> Callable[[Sequence[LearntMotion]], None]:
        """Return what writes the file, and tells once if that is not possible: the robot goes on learning."""
        told = False

        def keep(motions: Sequence[LearntMotion]) -> None:
            nonlocal told
            try:
                self.write(motions)
            except OSError as error:
                if not told:
                    tell(f"{self._path} cannot be written, so that what is learnt is lost: {error.strerror}")
                told = True
            else:
                told = False

        return keep

    def _read(self) -> tuple[LearntMotion, ...]:
        if not self._path.parent.is_dir():
            raise LearntFileError(f"learn is {self._path}: there is no folder {self._path.parent}")
        try:
            if not self._path.exists():
                return ()
            content = checked(parse_json(read_bytes(self._path, "file of learnt motions")), _Content)
        except OSError as error:
            raise LearntFileError(f"learn is {self._path}: {error.strerror}") from error
        except UserFileError as error:
            raise LearntFileError(f"learn: {error}") from error
        except ProtocolError as error:
            raise LearntFileError(f"learn is {self._path}: {error.why}") from error
        if content.robot != self._robot:
            raise LearntFileError(
                f"learn is {self._path}: it was learnt by an arm with other links, springs or drives: give this robot "
                "a file of its own"
            )
        if content.calibration != self._calibration:
            count = len(content.motions)
            self.ignored = (
                f"{self._path} was learnt with another calibration: its {count} motions are learnt anew"
            )
            return ()
        return content.motions
