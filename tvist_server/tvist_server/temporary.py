"""The folder for files that nobody asked for."""

import tempfile
from pathlib import Path


def temporary_folder() -> Path:
    """Return the system's temporary folder; where nothing can be written, the working folder."""
    try:
        return Path(tempfile.gettempdir())
    except FileNotFoundError:  # as in a container without any; what is then saved there says that it is lost
        return Path.cwd()
