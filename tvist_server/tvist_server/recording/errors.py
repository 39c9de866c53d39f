"""What can be wrong with a recording that is about to be made."""

from tvist_protocol.errors import TvistError


class RecorderError(TvistError):
    """A recording cannot be started."""
