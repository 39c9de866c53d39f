"""The folder of programs: files found by name, their valid content, and what the robot gets of them."""

import gzip

import msgspec
import pytest
from tests.controller.robots import Robot

from tvist_controller.dispatch.admission import Admitted
from tvist_controller.host import Host
from tvist_plant.user_file import UserFileError
from tvist_protocol.codec import decode
from tvist_protocol.info import Info
from tvist_protocol.programs import MAX_SCRIPT, ProgramLoad, ProgramStop
from tvist_protocol.replies import Refused
from tvist_server.program_folder import ProgramFolder

TEXT = "def pick():\n  sync()\nend\n"


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "pick.script").write_text(TEXT)
    (tmp_path / "place.urp").write_text("textmsg(1)\n")
    (tmp_path / "notes.txt").write_text("nothing")
    return ProgramFolder(tmp_path)


def admitted(command):
    return Admitted(command, msgspec.to_builtins(command))


def test_programs_are_found_by_file_name(folder):
    assert folder.names() == ["pick.script", "place.urp"]
    assert folder.read("pick.script") == folder.read("pick.urp") == folder.read("/programs/pick.urp") == TEXT
    assert folder.read("place.urp") == "textmsg(1)\n"
    for name in ("place.script", "pick", "notes.txt", "nothing.urp", "..", "/"):
        assert folder.read(name) is None
    (folder.path / "pick.script").write_text("sync()\n")
    assert folder.read("pick.urp") == "sync()\n"


@pytest.mark.parametrize(
    ("content", "why"),
    [
        (b"<a/>", "has no program"),
        (b"<!DOCTYPE a><a/>", "has a document type"),
        (b"<a", "not valid XML"),
        (b"<a>" * 10_000, "nested too deeply"),
        (b"\x1f\x8bxx", "cannot be unpacked"),
        (gzip.compress(b"def p():\nend\n" + b"# more\n" * 1000)[:-9], "its end is missing"),
        (gzip.compress(bytes(5 << 20), mtime=0), "more than 4 MiB"),
        (b"\xff\xfe", "not text in UTF-8"),
        (b" \n", "at least one"),
        (b"x" * (MAX_SCRIPT + 1), f"at most {MAX_SCRIPT}"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_an_invalid_program_file_is_refused_with_the_reason(folder, content, why):
    (folder.path / "bad.urp").write_bytes(content)
    with pytest.raises(UserFileError, match=why):
        folder.read("bad.urp")
    refused = folder.complete(admitted(ProgramLoad(name="bad.urp")))
    assert isinstance(refused, Refused)
    assert refused.where == "name"


def test_only_a_load_command_gets_the_text_of_the_file(folder):
    completed = folder.complete(admitted(ProgramLoad(name="pick.urp")))
    assert completed.command == ProgramLoad(name="pick.urp", text=TEXT)
    assert completed.content["text"] == TEXT
    for command in (ProgramStop(), ProgramLoad(name="pick.urp", text="sync()"), ProgramLoad(name="Q1.urp")):
        assert folder.complete(admitted(command)).command is command


def test_info_lists_the_programs_of_the_folder(folder):
    host = Host(Robot().controller)
    programs = decode(Info, folder.listed(host.info())).programs
    assert {"pick.script", "place.urp", "Q1.urp"} <= set(programs)
    folder.path = folder.path / "nowhere"
    assert decode(Info, folder.listed(host.info())).programs == decode(Info, host.info()).programs


def test_a_robot_uses_the_subfolder_of_its_name(folder):
    (folder.path / "ur5e-1").mkdir()
    assert ProgramFolder.of(folder.path, "ur5e-1").path == folder.path / "ur5e-1"
    assert ProgramFolder.of(folder.path, "ur5e-2").path == folder.path
