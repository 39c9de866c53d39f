"""Machine code on disk: it is used again where it is right, and only there."""

import contextlib
import hashlib
import os
import pickle
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from numba.core.registry import cpu_target

from tvist_kernels import cache as kernel_cache
from tvist_kernels.cache import OTHERS, DistrustWarning, KernelCache, held

CALLEE = """
from tvist_kernels.compiling import compiled
from tvist_of_tests.constants import FACTOR

@compiled
def inner(x):
    return FACTOR * x
"""
CALLER = """
from tvist_kernels.compiling import compiled
from tvist_of_tests.callee import (
    inner,
)

@compiled
def outer(x):
    return inner(x) + 1.0
"""
CALL = """
import sys
import numba
from tvist_of_tests.caller import outer
from tvist_kernels.cache import held, unkept
said = [bool(held([outer._cache])), *map(outer, eval(sys.argv[1]))]
print(*said, sum(outer.stats.cache_misses.values()), int(bool(unkept)))
"""
"""Prints whether outer is on disk, its values, how often it was compiled, and whether some was not kept."""


def written(place):
    """A package whose kernel `outer` calls one of another file, which uses a constant of a third."""
    folder = place / "tvist_of_tests"
    folder.mkdir()
    files = {"__init__": "", "constants": "FACTOR = 2.0\n", "callee": CALLEE, "caller": CALLER}
    for name, text in files.items():
        (folder / f"{name}.py").write_text(text)
    return folder


@pytest.fixture
def package(tmp_path):
    return written(tmp_path)


@pytest.fixture(scope="module")
def once(tmp_path_factory):
    """What the first process has kept, which had compiled the kernel."""
    folder = written(tmp_path_factory.mktemp("once"))
    assert call(folder) == ["False", "3.0", "1", "0"]
    return folder.parent / "home"


@pytest.fixture
def kept(package, once):
    """The package, compiled."""
    shutil.copytree(once, package.parent / "home")
    return package


def start(package, values="[1.0]", **environment):
    return subprocess.Popen(
        [sys.executable, "-c", CALL, values],
        env={
            **os.environ,
            "PYTHONPATH": str(package.parent),
            "XDG_CACHE_HOME": str(package.parent / "home"),
            "NUMBA_CACHE_DIR": "",
            "PYTHONDONTWRITEBYTECODE": "1",  # bytecode knows sources by their times
            **environment,
        },
        stdout=subprocess.PIPE,
        text=True,
    )


def call(package, values="[1.0]", **environment):
    said, _ = start(package, values, **environment).communicate()
    return said.split()


def test_second_process_compiles_nothing(kept):
    assert len(list((kept.parent / "home").rglob("*outer*.kernel"))) == 1
    assert call(kept) == ["True", "3.0", "0", "0"]


def test_machine_code_of_another_processor_is_kept_but_not_loaded(kept):
    assert call(kept, NUMBA_CPU_NAME="generic", NUMBA_CPU_FEATURES="") == ["False", "3.0", "1", "0"]
    assert len(list((kept.parent / "home").rglob("*outer*.kernel"))) == 2


def test_shipped_machine_code_that_others_can_write_does_not_run(kept):
    shipped = kept.parent / "tvist_compiled"
    shipped.mkdir()
    (shipped / "__init__.py").write_text("")
    for file in (kept.parent / "home").rglob("*.kernel"):
        file.rename(shipped / file.name)
    shipped.chmod(0o777)
    assert call(kept) == ["False", "3.0", "1", "0"]


def test_unwritable_cache_folder_is_noted(package):
    assert call(package, NUMBA_CACHE_DIR="/proc/none") == ["False", "3.0", "1", "1"]


def test_change_of_a_called_kernel_in_another_file_recompiles(kept):
    file = kept / "callee.py"
    stamp = file.stat().st_mtime_ns
    file.write_text(file.read_text().replace("FACTOR * x", "FACTOR * x + 2.0"))
    os.utime(file, ns=(stamp, stamp))  # contents count, times do not
    assert call(kept) == ["False", "5.0", "1", "0"]


def test_change_of_an_imported_constant_recompiles_and_old_files_are_removed(kept):
    (now,) = (kept.parent / "home").rglob("*outer*.kernel")
    old = [now.with_name(re.sub(r"\.[0-9a-f]{16}-", f".{k:016x}-", now.name)) for k in range(40)]
    for age, file in enumerate(old):
        file.write_bytes(b"")
        os.utime(file, (age, age))
    (kept / "constants.py").write_text("FACTOR = 4.0\n")
    assert call(kept) == ["False", "5.0", "1", "0"]
    assert [file.exists() for file in old] == [False] * (41 - OTHERS) + [True] * (OTHERS - 1)


def test_concurrent_processes_keep_what_each_compiled(package):
    """numba's own cache may give one's machine code, for integers, the name of the other's, for floats."""
    at_once = [start(package, values) for values in ("[1.0]", "[2]")]
    for process in at_once:
        process.communicate()
    assert call(package, "[1.0, 2]") == ["True", "3.0", "5.0", "0", "0"]
    assert not list(package.parent.rglob("*.draft"))


class Code:
    """What runs when it is unpickled."""

    def __init__(self, mark):
        self.mark = mark

    def __reduce__(self):
        return Path.mkdir, (self.mark,)


def mode_of(level, mode):
    def change(kernel):
        (kernel, *kernel.parents)[level].chmod(mode)

    return change


def owner_of(level):
    def change(kernel):
        os.chown((kernel, *kernel.parents)[level], 4711, -1)

    return change


def linked(kernel):
    kernel.symlink_to(kernel.rename(kernel.with_name("elsewhere")))


def through_a_link(kernel):
    kernel.parent.symlink_to(kernel.parent.rename(kernel.parent.with_name("open")))
    kernel.parent.chmod(0o777)


def pipe(kernel):
    kernel.unlink()
    os.mkfifo(kernel)


def damaged(kernel):
    kernel.write_bytes(kernel.read_bytes()[:-1] + b"?")


UNTRUSTED = {
    "file that all can write": mode_of(0, 0o666),
    "file that the group can write": mode_of(0, 0o664),
    "folder that all can write": mode_of(1, 0o777),
    "folder that the group can write": mode_of(1, 0o775),
    "sticky folder": mode_of(1, 0o1777),
    "folder above": mode_of(2, 0o777),
    "folder above that": mode_of(3, 0o777),
    "behind a link": through_a_link,
    "file of another user": owner_of(0),
    "folder of another user": owner_of(1),
    "folder above of another user": owner_of(2),
}
TRUSTED = {
    "as it is": lambda _kernel: None,
    "read only": mode_of(0, 0o444),
    "below a sticky folder such as /tmp": mode_of(2, 0o1777),
}


@pytest.fixture
def kernel(tmp_path, monkeypatch):
    """A cache, a file of its kernel in a folder three levels down, and what exists once the file has run."""
    place, mark = tmp_path / "far" / "top" / "kernels", tmp_path / "mark"
    monkeypatch.setattr(kernel_cache.config, "CACHE_DIR", str(place))
    monkeypatch.setattr(kernel_cache, "_said", set())

    def function(x):
        return x

    cache = KernelCache(function)
    (machine, _) = kernel_cache._machines(cpu_target.target_context)
    file = place / cache._file("types", machine)
    place.mkdir(parents=True)
    code = pickle.dumps(Code(mark))
    file.write_bytes(hashlib.sha256(code).digest() + code)
    return cache, file, mark


def load(cache):
    with contextlib.suppress(TypeError):  # after it has run: a folder is no machine code
        cache.load_overload("types", cpu_target.target_context)


@pytest.mark.parametrize("change", list(UNTRUSTED))
def test_machine_code_that_others_can_change_does_not_run_and_warns_once(kernel, change):
    cache, file, mark = kernel
    if "another user" in change and os.geteuid() != 0:
        pytest.skip("only root can give files away")
    UNTRUSTED[change](file)
    with pytest.warns(DistrustWarning) as said:
        assert not held([cache])
    load(cache)  # a second warning would be an error
    assert not mark.exists()
    (one,) = said
    sentence = r"somebody else.*: /.* \(mode \d+\) belongs to .*, (who|and) .*: .*, or .*until then"
    assert re.search(sentence, str(one.message))


def test_writable_folder_without_machine_code_gives_no_warning(kernel):
    cache, file, _ = kernel
    file.unlink()
    file.parent.chmod(0o775)
    assert not held([cache])  # a warning would be an error
    file.with_name("tvist_elsewhere.other.0-0-0.kernel").write_bytes(b"of another kernel")
    assert not held([cache])


@pytest.mark.parametrize("change", [linked, pipe, damaged])
def test_link_pipe_or_damaged_file_is_not_loaded(kernel, change):
    cache, file, mark = kernel
    change(file)
    if change is linked:
        # Without a warning, which would fail the test, since no change of its mode would help.
        assert not held([cache])
    load(cache)
    assert not mark.exists()


def test_link_exchanged_after_the_check_is_not_followed(kernel, monkeypatch):
    cache, file, mark = kernel
    elsewhere = file.parent.rename(file.parent.with_name("elsewhere"))
    here = file.parent.with_name("here")
    here.mkdir()
    (here / file.name).write_bytes(b"no code")
    file.parent.symlink_to(here)
    read = kernel_cache.trust.read_file

    def exchanged(path):
        file.parent.unlink()
        file.parent.symlink_to(elsewhere)
        return read(path)

    monkeypatch.setattr(kernel_cache.trust, "read_file", exchanged)
    load(cache)
    assert not mark.exists()


@pytest.mark.parametrize("reader", [None, 4711], ids=["its owner", "another user than root, as in an image"])
@pytest.mark.parametrize("change", list(TRUSTED))
def test_machine_code_of_this_user_or_root_is_loaded(kernel, change, reader, monkeypatch):
    cache, file, mark = kernel
    TRUSTED[change](file)
    if reader is not None:
        if os.geteuid() != 0:
            pytest.skip("the files are not root's")
        monkeypatch.setattr(os, "geteuid", lambda: reader)
    assert held([cache])
    load(cache)
    assert mark.exists()


def test_files_are_written_only_where_and_so_that_nobody_else_can_write(kernel, tmp_path):
    _, file, _ = kernel
    file.parent.chmod(0o777)
    before = os.umask(0)
    try:
        kernel_cache._write(tmp_path / "home" / "own" / "a.kernel", b"")
        with pytest.raises(OSError, match="chmod go-w"):
            kernel_cache._write(file.with_name("b.kernel"), b"")
    finally:
        os.umask(before)
    assert [one for one in (tmp_path / "home").rglob("*") if one.stat().st_mode & 0o022] == []
    assert list(file.parent.iterdir()) == [file]
