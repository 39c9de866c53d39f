"""The folder of programs: which file a name finds, what it has to contain, and what the robot gets of it."""

import gzip

import msgspec
import pytest
from tests.controller.robots import Robot
from tvist_server.polyscope_nodes import EXTERNAL_CONTROL, Nodes

from tvist_controller.dispatch.admission import Admitted
from tvist_controller.host import Host
from tvist_controller.programs.checking import check_program
from tvist_plant.user_file import UserFileError
from tvist_protocol.codec import decode
from tvist_protocol.info import Info
from tvist_protocol.programs import MAX_SCRIPT, ProgramLoad, ProgramStop
from tvist_protocol.replies import Refused
from tvist_server.config import from_mapping
from tvist_server.option_values import StartError
from tvist_server.polyscope import program, with_external_control
from tvist_server.program_folder import ProgramFolder

TEXT = "def pick():\n  sync()\nend\n"


def problems(text):
    """What is wrong with a program that was read from a file: only one that is sent may end at an `end` in column 1."""
    return [one for one in check_program(text) if "in column 1" not in one.text]


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "pick.script").write_text(TEXT)
    (tmp_path / "place.urp").write_text("textmsg(1)\n")
    (tmp_path / "notes.txt").write_text("nothing")
    return ProgramFolder(tmp_path)


def admitted(command):
    return Admitted(command, msgspec.to_builtins(command))


def test_a_name_finds_its_file_and_the_name_of_a_saved_program_its_script(folder):
    assert folder.names() == ["pick.script", "place.urp"]
    assert folder.read("pick.script") == folder.read("pick.urp") == folder.read("/programs/pick.urp") == TEXT
    assert folder.read("place.urp") == "textmsg(1)\n"
    for name in ("place.script", "pick", "notes.txt", "nothing.urp", "..", "/"):
        assert folder.read(name) is None
    (folder.path / "pick.script").write_text("sync()\n")
    assert folder.read("pick.urp") == "sync()\n"


def polyscope(*nodes):
    inner = f"<MainProgram><children>{''.join(nodes)}</children></MainProgram>"
    return f"<?xml version='1.0'?><URProgram><children>{inner}</children></URProgram>"


SCRIPT_NODE = "<Script type='File'><cachedContents>textmsg(&quot;a &lt; b&quot;)</cachedContents></Script>"


@pytest.mark.parametrize("pack", [bytes, gzip.compress])
def test_a_program_of_polyscope_that_is_one_script_is_that_script(folder, pack):
    (folder.path / "saved-1.urp").write_bytes(pack(polyscope(SCRIPT_NODE).encode()))
    assert folder.read("saved-1.urp") == 'def saved_1():\ntextmsg("a < b")\nend\n'


EXTERNAL = (
    "<Contributed strategyClass='com.fzi.externalcontrol.ExternalControlNode'><dataModel/></Contributed>"
)


def test_lines_waits_and_external_control_of_polyscope_follow_one_another_and_the_program_may_repeat(folder):
    nodes = (EXTERNAL, f"<Script type='Line'>{expression('sync()')}</Script>")
    nodes = (*nodes, "<Wait type='Sleep'><waitTime>10.0</waitTime></Wait>")
    once = polyscope(*nodes).replace("<MainProgram>", "<MainProgram runOnlyOnce='true'>")
    again = once.replace("'true'", "'false'")
    (folder.path / "once.urp").write_text(once)
    (folder.path / "7.urp").write_text(again)
    body = f"{EXTERNAL_CONTROL}\nsync()\nsleep(10)"
    assert folder.read("once.urp") == f"def once():\n{body}\nend\n"
    assert folder.read("7.urp") == f"def program():\nwhile True:\n{body}\nend\nend\n"
    for name in ("once.urp", "7.urp"):
        assert problems(folder.read(name)) == []
        whole = with_external_control(folder.read(name), SENT)
        assert problems(whole) == []
        assert whole.index("def step") < whole.index("step()\n") < whole.index("sleep(10)")


def test_a_program_that_repeats_definitions_alone_ends(folder):
    """Repeated, it would be an endless loop; a definition beside what calls it does repeat."""
    defined = "def step():\n  sync()\nend\n"
    for name, text, repeats in (("a.urp", defined, False), ("b.urp", defined + "step()", True)):
        node = f"<Script type='File'><cachedContents>{text}</cachedContents></Script>"
        again = polyscope(node).replace("<MainProgram>", "<MainProgram runOnlyOnce='false'>")
        (folder.path / name).write_text(again)
        assert ("while True" in folder.read(name)) is repeats
        assert [one for one in problems(folder.read(name)) if one.level == "error"] == []


SENT = "# HEADER_BEGIN\ndef step():\n  sync()\nend\n# HEADER_END\nstep()\n# NODE_CONTROL_LOOP_ENDS\n"


def test_a_text_without_a_header_stands_whole_where_the_node_is():
    assert with_external_control(program("a", EXTERNAL_CONTROL), "sync()\n") == "def a():\n\nsync()\n\nend\n"


def characters(text):
    return "".join(f'<ExpressionChar character="{letter}"/>' for letter in text)


def expression(*parts):
    """An expression, of characters and of elements that begin with <."""
    written = (part if part.startswith("<") else characters(part) for part in parts)
    return f"<expression>{''.join(written)}</expression>"


COUNT = "../../../../../../SpecialSequence/children/Assignment/variable"
TREE = f"""<?xml version='1.0'?><URProgram><children>
<InitVariablesNode><variables><variable name='place'>{expression("p[1,2,3,0,0,0]")}</variable></variables>
</InitVariablesNode><SpecialSequence type='BeforeStart'><children>
  <Assignment valueSource='Expression'><variable name='count'/>{expression("1")}</Assignment>
</children></SpecialSequence>
<MainProgram runOnlyOnce='true' InitVariablesNode='true'><children>
  <Comment comment='nothing'/><SuppressedNode><suppressedNode class='Halt'/></SuppressedNode>
  <Loop type='While' checkContinuously='false'>
    {expression(f"<ExpressionVariable><ProgramVariable reference='{COUNT}'/></ExpressionVariable>", "≠3")}
    <children><Folder><children>
      <Assignment valueSource='Expression'><variable name='count'/>{expression("count+1")}</Assignment>
    </children></Folder></children>
  </Loop>
  <If type='If' checkContinuously='false'>{expression("count≟", "<ExpressionToken token=' 3 '/>")}<children>
    <Move motionType='MoveJ' speed='1.5' acceleration='2.0' useActiveTCP='true' optimoveEnabled='false'><children>
      <Waypoint type='Fixed' name='Way &quot;1&quot;'><motionParameters/><position>
        <JointAngles angles='-1.5, -1.6, -2.2, -0.8, 1.6, 0.0'/></position></Waypoint>
      <Waypoint type='Variable'><motionParameters/><variable name='place'/></Waypoint>
    </children></Move>
  </children></If>
  <If type='Else'>{expression()}<children><Popup type='Message' message='no' haltProgram='true'/></children></If>
  <Halt/>
</children></MainProgram>
<Thread name='Thread 1' runOnlyOnce='false'><children>
  <Wait type='Sleep'><waitTime>0.5</waitTime></Wait>
</children></Thread>
</children></URProgram>"""


def test_nodes_of_a_program_tree_become_lines_with_labels(folder):
    (folder.path / "tree.urp").write_text(TREE, encoding="utf-8")
    assert folder.read("tree.urp").split("\n") == [
        "def tree():", "global place = p[1,2,3,0,0,0]", "thread Thread_1():", "while True:", "sleep(0.5)", "end", "end",
        '$ 1 "count"', "global count = 1", "run Thread_1()",
        "while count!=3:", '$ 2 "count"', "global count = count+1", "end",
        "if count== 3 :", '$ 3 "Way "1""', "movej([-1.5, -1.6, -2.2, -0.8, 1.6, 0], a=2, v=1.5)",
        '$ 4 "place"', "movej(place, a=2, v=1.5)",
        "else:", '$ 5 "Popup"', 'popup("no", blocking=True)', "halt", "end",
        '$ 6 "Halt"', "halt", "end", "",
    ]  # fmt: skip
    assert problems(folder.read("tree.urp")) == []


@pytest.mark.parametrize(
    ("content", "why"),
    [
        (TREE.replace("MoveJ", "MoveP").encode(), r"has Move \(MoveP\), which"),
        (TREE.replace("<motionParameters/>", "<motionParameters blend='1'/>").encode(), "has Waypoint"),
        (
            TREE.replace("Assignment/variable", "Assignment[2]/variable").encode(),
            "has a variable without a name",
        ),
        (
            TREE.replace("checkContinuously='false'", "checkContinuously='true'").encode(),
            r"has Loop \(While\)",
        ),
        (
            gzip.compress(polyscope("<Move/>", SCRIPT_NODE).encode(), mtime=0),
            "has Move, which cannot be played",
        ),
        (polyscope().encode(), "has no program"),
        (polyscope("<Script/>").encode(), "without text"),
        (polyscope(SCRIPT_NODE, "<Wait type='DigitalInput'/>").encode(), r"has Wait \(DigitalInput\), which"),
        (polyscope("<Contributed strategyClass='com.other'/>").encode(), "has Contributed, which"),
        (b"<!DOCTYPE a>" + polyscope(SCRIPT_NODE).encode(), "has a document type"),
        (b"<a", "not valid XML"),
        (b"\x1f\x8bxx", "cannot be unpacked"),
        (gzip.compress(b"def p():\nend\n" + b"# more\n" * 1000)[:-9], "its end is missing"),
        (gzip.compress(bytes(5 << 20), mtime=0), "more than 4 MiB"),
        (b"\xff\xfe", "not text in UTF-8"),
        (b" \n", "at least one"),
        (b"x" * (MAX_SCRIPT + 1), f"at most {MAX_SCRIPT}"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_a_file_that_cannot_be_played_is_refused_with_the_reason(folder, content, why):
    (folder.path / "bad.urp").write_bytes(content)
    with pytest.raises(UserFileError, match=why):
        folder.read("bad.urp")
    refused = folder.complete(admitted(ProgramLoad(name="bad.urp")))
    assert isinstance(refused, Refused)
    assert refused.where == "name"


@pytest.mark.parametrize(
    ("hops", "place", "why"),
    [(90, "h[{}]", None), (200, "h[{}]", "a variable without a name"), (1, f"h[{'9' * 5000}]", "without a name"),
     (1, "x/../" * 300 + "h[{}]", "without a name")],
)  # fmt: skip
def test_references_are_followed_once_each_however_many_lead_to_them(folder, monkeypatch, hops, place, why):
    followed, whole = [], Nodes._referred
    monkeypatch.setattr(Nodes, "_referred", lambda *given: (followed.append(given), whole(*given))[1])
    chain = "".join(f"<h><v reference='../../{place.format(hop)}/v'/></h>" for hop in range(2, hops + 2))
    users = "<ExpressionVariable><ProgramVariable reference='../../../../SuppressedNode/h/v'/></ExpressionVariable>"
    node = f"<Assignment valueSource='Expression'><variable name='x'/><expression>{users * 500}</expression>"
    text = polyscope(f"<SuppressedNode>{chain}<h><v name='a'/></h></SuppressedNode>", node + "</Assignment>")
    (folder.path / "chain.urp").write_text(text)
    if why is None:
        assert "a" * 500 in folder.read("chain.urp")
    else:
        with pytest.raises(UserFileError, match=why):
            folder.read("chain.urp")
    assert len(followed) <= hops + 500


def test_a_load_gets_the_text_of_the_file_and_other_commands_stay_as_they_are(folder):
    completed = folder.complete(admitted(ProgramLoad(name="pick.urp")))
    assert completed.command == ProgramLoad(name="pick.urp", text=TEXT)
    assert completed.content["text"] == TEXT
    for command in (ProgramStop(), ProgramLoad(name="pick.urp", text="sync()"), ProgramLoad(name="Q1.urp")):
        assert folder.complete(admitted(command)).command is command


def test_the_files_are_programs_of_the_robot_s_description(folder):
    host = Host(Robot().controller)
    programs = decode(Info, folder.listed(host.info())).programs
    assert {"pick.script", "place.urp", "Q1.urp"} <= set(programs)
    folder.path = folder.path / "nowhere"
    assert decode(Info, folder.listed(host.info())).programs == decode(Info, host.info()).programs


def test_a_robot_has_the_folder_of_its_name_if_there_is_one(folder):
    (folder.path / "ur5e-1").mkdir()
    assert ProgramFolder.of(folder.path, "ur5e-1").path == folder.path / "ur5e-1"
    assert ProgramFolder.of(folder.path, "ur5e-2").path == folder.path


def test_a_folder_that_does_not_exist_is_an_error_of_the_configuration(tmp_path):
    nowhere = from_mapping({"programs": str(tmp_path / "nowhere")}, "tvist.toml")
    with pytest.raises(StartError, match=r"programs is .*nowhere.*: must be a folder"):
        nowhere.program_folder("ur5e")
    assert from_mapping({}, "tvist.toml").program_folder("ur5e") is None
