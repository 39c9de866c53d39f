"""Shapers from users' files (FILE.py:NAME), never loaded for network clients or recordings."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from msgspec import Struct

from tvist_controller.sources.own_files import OwnFileError, is_of_file, load_again, run_file
from tvist_shaping.errors import ShaperFailureError, ShapingError
from tvist_shaping.estimators.base import Estimator
from tvist_shaping.fir_shaper import FirShaper
from tvist_shaping.named import AnyShaper, Registry
from tvist_shaping.own import check_range, check_shaper, shaper_of
from tvist_shaping.shaper import Shaper

_POSTURES, _MARGIN = 64, 1.1
"""Number of postures at which modes are computed, and the margin that a shaper must support."""


class RecordedShaper(Struct, frozen=True):
    """Reference to a file's shaper in a recording."""

    name: str
    """Name in messages and tables."""
    file: str
    """Path of the file as given."""
    attribute: str
    """Name of the shaper in the file."""
    sha256: str
    """SHA-256 of the file in hexadecimal."""


@dataclass(frozen=True)
class OwnShaper:
    """A shaper loaded from a file."""

    file: str
    """Path of the file as given."""
    attribute: str
    """Name of the shaper in the file."""
    sha256: str
    """SHA-256 of the bytes that were run, in hexadecimal, without imported files."""
    shaper: AnyShaper = field(compare=False)
    """The shaper, checked for all modes that a client may send."""

    @property
    def name(self) -> str:
        """Name in messages and tables."""
        return self.shaper.name

    @property
    def place(self) -> str:
        """The shaper as FILE.py:NAME."""
        return f"{self.file}:{self.attribute}"

    @property
    def recorded(self) -> RecordedShaper:
        """Reference to the shaper for a recording."""
        return RecordedShaper(self.name, self.file, self.attribute, self.sha256)

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle by file name, since a function cannot be pickled."""
        return load_again, (load_own, "shaper", self.place, self.sha256)


def load_own(place: str) -> OwnShaper:
    """Run a file and check its shaper.

    Args:
        place: FILE.py:NAME. NAME is a function (f_d [Hz], ζ [-]) -> `Impulses`, a `Shaper` or a `FirShaper`.

    Raises:
        OwnFileError: File or name does not exist, running the file raises, the name is no shaper, or the
            shaper fails for a mode.
        UserFileError: The file is not text, or is larger than 4 MiB.
    """
    file, attribute, sha256, found = run_file(place, "shaper", _may_be_one)
    try:
        shaper = _shaper(found, attribute, place)
        Registry([shaper])
    except ShaperFailureError as error:
        raise OwnFileError(f"shaper {place} {error.why}") from error
    except ShapingError as error:
        raise OwnFileError(f"shaper {place}: {error}") from error
    return OwnShaper(file, attribute, sha256, shaper)


def check_for(own: OwnShaper, estimator: Estimator, joints: int) -> None:
    """Check a shaper for all modes of an arm, plus a tenth; raise OwnFileError if it fails."""
    looking = estimator.fork()
    anywhere = np.random.default_rng(0).uniform(-np.pi, np.pi, (_POSTURES, joints))
    f_d, zeta = np.array([looking.settle(q) for q in anywhere])[:, :, 0].T
    low, high = max(f_d.min() / _MARGIN, estimator.f_d_min), f_d.max() * _MARGIN
    damped = zeta.min() / _MARGIN, min(zeta.max() * _MARGIN, max(estimator.zeta_max, zeta.max()))
    try:
        check_range(own.shaper, (low, high), damped, "this arm")
    except ShaperFailureError as error:
        raise OwnFileError(f"shaper {own.place} {error.why}") from error


def _shaper(found: object, attribute: str, place: str) -> AnyShaper:
    if isinstance(found, Shaper | FirShaper):
        check_shaper(found)
        return found
    if not callable(found) or isinstance(found, type):
        kind = "a class" if isinstance(found, type) else f"of type {type(found).__name__}"
        raise OwnFileError(
            f"shaper {place}: {attribute} is {kind}; it must be a function (f_d, zeta) -> Impulses, a Shaper or a "
            "FirShaper of tvist_shaping"
        )
    return shaper_of(found, name=attribute)


def _may_be_one(value: object) -> bool:
    return (is_of_file(value) and not isinstance(value, type)) or isinstance(value, Shaper | FirShaper)
