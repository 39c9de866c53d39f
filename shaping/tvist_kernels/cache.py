"""Keep machine code of kernels on disk: one file for each kernel, source hash, processor and argument types.

numba's own cache has an index file for each kernel. It renews the index if the kernel's own file changes, but not if a
called kernel in another file does, and two processes that write at once can mix up their entries. Here the name of a
file contains everything that its content depends on, so no file is ever updated, and each appears complete. An optional
distribution brings files that run on any processor of its architecture.
"""

# numba's type information is incomplete.
# mypy: disable-error-code="no-untyped-call,attr-defined"

import contextlib
import hashlib
import multiprocessing
import os
import sys
import uuid
import warnings
from collections.abc import Callable, Iterable, Iterator
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import llvmlite
import numba
from numba.core import config
from numba.core.caching import CompileResultCacheImpl, _cache_log
from numba.core.registry import cpu_target
from numba.misc.appdirs import AppDirs

from tvist_kernels import trust
from tvist_kernels.machine_code import from_bytes, to_bytes
from tvist_kernels.sources import digest, top

DIGITS = 16  # hexadecimal digits of each hash in a file's name
CHECKSUM_BYTES = 32
FORMAT = 2  # version of the format that `machine_code` writes; increase it with each change

kernels: "list[KernelCache]" = []  # caches of all compiled functions that this process has imported
OTHERS = 16
"""Number of files of other versions that are kept for each kernel, since installations share the folder."""
SHIPPED = "tvist_compiled"  # package whose folder holds precompiled machine code, if it is installed
unkept: dict[str, str] = {}  # reason why machine code could not be written, by folder
_said: set[str] = set()  # warnings already given


class DistrustWarning(UserWarning):
    """Machine code on disk is not used, since somebody else may have put it there."""


class KernelCache:
    """Machine code of one kernel, in the form that numba's dispatcher expects."""

    def __init__(self, function: Callable[..., Any], dispatcher: Any = None) -> None:
        self._function, self._dispatcher = function, dispatcher
        self.name = f"{function.__module__}.{function.__qualname__}".replace("<locals>", "_")
        """Module and name of the function."""
        self._content = _Content(function)
        kernels.append(self)

    @cached_property
    def sources(self) -> str:
        """Hash of the sources that the machine code depends on; computed when a kernel is first called."""
        return _short(digest(self._function.__module__) + self._function.__code__.co_code.hex())

    @property
    def cache_path(self) -> str:
        """Folder in which machine code is kept; numba reads this."""
        return str(own_folder())

    def load_overload(self, sig: object, target_context: Any) -> Any:
        """Return the kernel for these argument types; None if there is no file on disk, or it is damaged."""
        for machine in _machines(target_context):
            name = self._file(sig, machine)
            for folder in places():
                if (code := _code(folder / name)) is not None:
                    return from_bytes(target_context, code)
        return None

    def load_file(self, file: Path) -> bool:
        """Add a file's kernel to the dispatcher if its argument types are new; return False if damaged."""
        code, context = _code(file), cpu_target.target_context
        if code is None:
            return False
        found = from_bytes(context, code)
        if tuple(found.signature.args) not in self._dispatcher.overloads:
            context.insert_user_function(found.entry_point, found.fndesc, [found.library])
            self._dispatcher.add_overload(found)
        return True

    def save_overload(self, sig: object, data: Any) -> None:
        """Write a kernel to the folder; if that is impossible, note it in `unkept`."""
        if not self._content.check_cachable(data):
            return
        code = to_bytes(data)
        file = own_folder() / self._file(sig, _machines(data.target_context)[0])
        try:
            _write(file, hashlib.sha256(code).digest() + code)
        except OSError as error:
            unkept[str(file.parent)] = error.strerror or str(error)
            return
        _cache_log("[cache] data saved to %r", str(file))
        self._forget_older(file)

    def _file(self, sig: object, machine: str) -> str:
        return f"{self.name}.{self.sources}-{machine}-{_short(str(sig))}.kernel"

    def _forget_older(self, written: Path) -> None:
        """Remove other versions of this kernel on this machine, except the newest `OTHERS` files."""
        same = written.parent.glob(f"{self.name}.*-{written.name.split('-')[-2]}-*.kernel")
        with contextlib.suppress(OSError):  # another process removes some
            others = [file for file in same if self.sources not in file.name]
            _remove(sorted(others, key=lambda file: file.stat().st_mtime_ns)[:-OTHERS])


class _Content(CompileResultCacheImpl):
    """numba's conversion of a compiled function, without the base class's search for a folder to write to."""

    def __init__(self, function: Callable[..., Any]) -> None:
        # Replaces the base's constructor, which searches for a folder; numba shows line and file in warnings.
        self._lineno = function.__code__.co_firstlineno
        self._py_file = function.__code__.co_filename
        self._locator = self


def held(some: "Iterable[KernelCache]") -> "dict[KernelCache, list[Path]]":
    """Return the files with machine code for this processor, by kernel; kernels without any are left out."""
    machines, listed, real = _machines(cpu_target.target_context), cache(_listed), cache(_real)

    def there(kernel: KernelCache, folder: Path) -> list[Path]:
        listing = listed(folder)
        files = [
            file
            for machine in machines
            for file in listing.get(f"{kernel.name}.{kernel.sources}-{machine}", ())
        ]
        # Check a folder only if it has such files: it does not matter who can write to any other.
        place = real(folder) if files else None
        return [] if place is None else [place / file for file in files if _may_be_loaded(place / file)]

    found = {kernel: [file for folder in places() for file in there(kernel, folder)] for kernel in some}
    return {kernel: files for kernel, files in found.items() if files}


def load_all(some: "Iterable[KernelCache]") -> bool:
    """Load machine code of kernels, which takes milliseconds, before their first calls; False if damaged."""
    loaded = [kernel.load_file(file) for kernel, files in held(some).items() for file in files]
    return all(loaded)


def _listed(folder: Path) -> dict[str, list[str]]:
    """Return the names of a folder's files, grouped by the part of the name before the argument types."""
    found: dict[str, list[str]] = {}
    with contextlib.suppress(OSError):
        for file in os.listdir(folder):  # noqa: PTH208  fast
            if file.endswith(".kernel"):
                found.setdefault(file.rpartition("-")[0], []).append(file)
    return found


def _real(folder: Path) -> Path | None:
    with _trusting(folder):
        return trust.real_folder(folder)
    return None


def _may_be_loaded(file: Path) -> bool:
    with _trusting(file.parent):
        trust.check_file(file)
        return True
    return False


def own_folder() -> Path:
    """Return the folder for new machine code: NUMBA_CACHE_DIR, or a folder in the user's cache."""
    return Path(
        config.CACHE_DIR or Path(AppDirs(appname="tvist", appauthor=False).user_cache_dir) / "kernels"
    )


def places() -> list[Path]:
    """Return the folders that are searched for machine code, in the order of the search."""
    shipped = top(SHIPPED)
    return [own_folder(), *([] if shipped is None else [shipped.parent])]


def _machines(target_context: Any) -> list[str]:
    """Return a hash of compiler versions and processor, first for this processor, then for a generic one."""
    python = (sys.implementation.cache_tag, getattr(sys, "abiflags", ""))
    versions = (FORMAT, python, numba.__version__, llvmlite.__version__)
    own = target_context.codegen().magic_tuple()
    return [_short(repr((processor, versions))) for processor in (own, (own[0], "generic", ""))]


def _code(file: Path) -> bytes | None:
    """Return the machine code in a file; None if it is missing, damaged, or not to be trusted."""
    content = b""
    with _trusting(file.parent):
        file.lstat()
        content = trust.read_file(trust.real_folder(file.parent) / file.name)
    checksum, code = content[:CHECKSUM_BYTES], content[CHECKSUM_BYTES:]
    if hashlib.sha256(code).digest() != checksum:
        return None
    _cache_log("[cache] data loaded from %r", str(file))  # with NUMBA_DEBUG_CACHE=1
    return code


@contextlib.contextmanager
def _trusting(folder: Path) -> Iterator[None]:
    """Suppress errors for missing files; for files that somebody else may have written, warn and suppress."""
    try:
        yield
    except trust.DistrustError as error:
        why = f"{error}, or delete {folder}; until then they are compiled again"
        # Give each warning once, and only in the main process.
        if why not in _said and multiprocessing.parent_process() is None:
            _said.add(why)
            warnings.warn(
                f"compiled kernels are not loaded where somebody else can have put them: {why}",
                DistrustWarning,
                stacklevel=2,
            )
    except OSError:
        pass


def _write(file: Path, content: bytes) -> None:
    file = trust.make_folder(file.parent) / file.name
    draft = file.with_name(f"{uuid.uuid4().hex}.draft")
    try:
        # Nobody else can write the file, whatever the umask.
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0)
        with open(os.open(draft, flags, 0o644), "wb") as stream:  # noqa: PTH123  a descriptor
            stream.write(content)
        os.replace(draft, file)  # noqa: PTH105  atomic
    except OSError:
        _remove([draft])
        raise


def _remove(files: Iterable[Path]) -> None:
    for file in files:
        with contextlib.suppress(OSError):  # another process has removed it or is using it
            file.unlink()


def _short(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:DIGITS]
