"""Files of users: whatever a path names, there is an answer, and soon."""

import os
import socket
import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tvist_plant.user_file import (
    DEEPEST,
    LARGEST,
    UserFileError,
    _is_deeper,
    read_bytes,
    read_text,
    read_toml,
)

NESTED = {
    "arrays": lambda levels: f"x = {'[' * levels}{']' * levels}",
    "inline tables": lambda levels: f"x = {'{a = ' * (levels - 1)}{{}}{'}' * (levels - 1)}",
    "a dotted key": lambda levels: f"{'.'.join('a' * (levels + 1))} = 1",
    "a dotted key with quotes": lambda levels: " . ".join(['"a.b"'] * (levels + 1)) + " = 1",
    "a table": lambda levels: f"[{'.'.join('a' * (levels + 1))}]",
    "a key in an inline table": lambda levels: f"x = {{{'.'.join('a' * (levels + 1))} = 1}}",
}
"""Texts with so many levels."""


@pytest.fixture(params=["directory", "pipe", "socket", "zero", "urandom"])
def no_file(request, tmp_path, monkeypatch):
    path = tmp_path / "it"
    match request.param:
        case "directory":
            path.mkdir()
        case "pipe":
            os.mkfifo(path)
        case "socket":
            monkeypatch.chdir(tmp_path)  # the name of a socket is short
            with socket.socket(socket.AF_UNIX) as bound:
                bound.bind("it")
        case device:
            path.symlink_to(f"/dev/{device}")
    return path


def test_directories_pipes_sockets_and_devices_are_refused(no_file):
    for read in (read_bytes, read_text, read_toml):
        with pytest.raises(UserFileError, match=f"robot file {no_file} is a (directory|pipe|socket|device)"):
            read(no_file, "robot file")


def test_file_that_is_too_large_is_refused(tmp_path):
    path = tmp_path / "large"
    with path.open("wb") as stream:
        stream.truncate(LARGEST)
        assert len(read_bytes(path, "state")) == LARGEST
        stream.truncate(1 << 40)  # more than there is memory
    with pytest.raises(UserFileError, match=f"state {path} has more than 4 MiB"):
        read_bytes(path, "state")


def test_file_that_is_not_utf_8_is_refused(tmp_path):
    path = tmp_path / "binary"
    path.write_bytes(b"x = 1\xff")
    with pytest.raises(UserFileError, match=f"state {path} is not text in UTF-8 .* at byte 5"):
        read_text(path, "state")


@pytest.mark.parametrize("levels", [DEEPEST + 1, 100_000])
@pytest.mark.parametrize("form", NESTED)
def test_file_that_is_nested_too_deeply_is_refused(form, levels, tmp_path):
    path = tmp_path / "deep.toml"
    path.write_text(NESTED[form](levels))
    with pytest.raises(UserFileError, match=rf"deep\.toml is nested too deeply: at most {DEEPEST} levels"):
        read_toml(path, "robot file")


@pytest.mark.parametrize("form", NESTED)
def test_deepest_permitted_nesting_is_read(form, tmp_path):
    path = tmp_path / "deep.toml"
    text = NESTED[form](DEEPEST - 1)
    path.write_text(text)
    assert read_toml(path, "robot file") == tomllib.loads(text)


@pytest.mark.parametrize(
    "text",
    [
        'x = "[[[{{{ ... \\" [[["\n',
        "x = '[[[{{{ ...'\n",
        'x = """[[[\n {{{ "" ... """\n',
        "x = '''[[[\n {{{ '' ... '''\n",
        "x = 1 # [[[ {{{ ...\n",
        "x = [1.0, 2.0, 3.0, 4.0]\n",
        "x = 1.0\ny = 2.0\nz = 3.0\n",
        "[a]\n[b]\n[c]\n[[d]]\n",
    ],
)
def test_brackets_in_strings_and_comments_do_not_count_as_nesting(text):
    assert tomllib.loads(text)
    assert not _is_deeper(text, 2)


@given(st.text(alphabet="[]{}.,='\"\\#\nax1 ", max_size=200))
def test_parsed_content_is_no_deeper_than_the_computed_depth(text):
    def levels(content):
        if isinstance(content, dict):
            return 1 + max(map(levels, content.values()), default=0)
        if isinstance(content, list):
            return 1 + max(map(levels, content), default=0)
        return 0

    try:
        content = tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        return
    # A header, the key below it and its value may each be that deep.
    most = next(most for most in range(200) if not _is_deeper(text, most))
    assert levels(content) <= 3 * (most + 1)


@pytest.mark.parametrize(
    "text",
    ['x = "' + '\\"' * 2_000_000, "x = '''" + "''a" * 1_000_000, "." * 4_000_000],
    ids=lambda text: text[:7],
)
def test_depth_check_takes_linear_time(text, tmp_path):
    """Time that grew with the square of its length would not end before the test's."""
    path = tmp_path / "slow.toml"
    path.write_text(text)
    with pytest.raises((UserFileError, tomllib.TOMLDecodeError)):
        read_toml(path, "robot file")
