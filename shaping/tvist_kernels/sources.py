"""Find the project's own sources on which a kernel's machine code depends."""

import hashlib
import re
from functools import cache
from importlib.util import find_spec
from pathlib import Path

OURS = "tvist_"  # prefix of the names of the project's packages
_IMPORT = re.compile(
    rf"^(?:from[ ]+({OURS}[\w.]+)[ ]+import[ ]+(\([^)]*\)|[^\n]*)|import[ ]+({OURS}[\w.]+))", re.MULTILINE
)


@cache
def digest(module: str) -> str:
    """Return a hash of a module and of all modules of the project that it imports at its top, transitively.

    A kernel's machine code contains the kernels that it calls and the values of constants, from whatever module. A
    module that is imported within a function cannot contribute to it.
    """
    found: set[str] = set()
    waiting = [module]
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            waiting += _read(name)[1]
    together = hashlib.sha256()
    for name in sorted(found):
        together.update(f"{name} {_read(name)[0]}\n".encode())
    return together.hexdigest()


@cache
def _read(module: str) -> tuple[str, tuple[str, ...]]:
    """Return the hash of a module's source, and the modules of the project that it imports at its top."""
    file = _file(module)
    if file is None:
        return "", ()
    content = file.read_bytes()
    imported = set()
    for origin, names, whole in _IMPORT.findall(content.decode()):
        imported.add(origin or whole)
        package = _file(origin) if origin else None
        if package is None or package.name != "__init__.py":
            continue
        # In `from package import name`, the name may be a module.
        for name in re.findall(r"^\s*\(?\s*(\w+)|,\s*(\w+)", names):
            inner = f"{origin}.{name[0] or name[1]}"
            if _file(inner) is not None:
                imported.add(inner)
    return hashlib.sha256(content).hexdigest(), tuple(sorted(imported))


@cache
def _file(module: str) -> Path | None:
    """Return the file of a module without importing it; None if there is none."""
    package, *inner = module.split(".")
    place = top(package)
    if place is None:
        return None
    if inner:
        place = place.parent.joinpath(*inner)
        place = place / "__init__.py" if place.is_dir() else place.with_suffix(".py")
    return place if place.is_file() else None


@cache
def top(package: str) -> Path | None:
    """Return the `__init__` file of a top-level package; None if it is not installed."""
    spec = find_spec(package)
    return None if spec is None or spec.origin is None else Path(spec.origin)
