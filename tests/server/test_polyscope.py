"""Programs saved by PolyScope: the URScript of each kind of node, and refused nodes."""

import gzip
from time import process_time

import numpy as np
import pytest
from tests.controller.scripts import a_robot, run, said
from tests.server.polyscope_files import contributed, expression, move, saved, waypoint

from tvist_controller.programs.compiling import check_program
from tvist_plant.user_file import UserFileError, xml
from tvist_server.polyscope.contributed import EXTERNAL_CONTROL
from tvist_server.polyscope.files import read_program, text_of
from tvist_server.polyscope.nodes import Choices
from tvist_server.polyscope.positions import tool_pose
from tvist_server.polyscope.references import References
from tvist_server.polyscope.script import program_text, with_external_control

Q = (-1.5, -1.6, -2.2, -0.8, 1.6, 0.0)
GRIPPER = "com.robotiq.urcap.gripper."
DIRECTION = "gui.program.direction.MoveDirectionNode"
PARTS = (
    "<ExpressionToken token=' not '/>", "<ExpressionIO><pin referencedName='digital_in[2]'/></ExpressionIO>", "≠",
    "<ExpressionVariable><ProgramVariable name='x'/></ExpressionVariable>", "<ExpressionChar character='&#10;'/>",
)  # fmt: skip
BRANCHES = "".join(
    f"<If type='{kind}'>{expression(condition)}<children/></If>"
    for kind, condition in (("If", "True"), ("ElseIf", "True"), ("Else", ""))
)
SEVEN = f"<Assignment><variable name='x'/>{expression('7')}</Assignment>"
LEVEL = (
    "<pin referencedName='analog_in[1]'/><analogComparison>1</analogComparison><analogValue>4</analogValue>"
)
WATCHED = (
    f"<If type='If' checkContinuously='true'>{expression('True')}<children><Halt/></children></If>"
    "<If type='Else'><children/></If>"
)
TOOL = "<feature referencedName='Joint_6_name'/>"
TASK = (
    f"{TOOL}<selection value='0,0,1,0,0,0'/><wrench value='0,0,5,0,0,0'/>"
    f"<limitsForce value='{'0.2,' * 5}0.2'/><limitsMotion value='{'0.1,' * 5}0.1'/>"
)
FORCED = "force_mode(tool_pose(), [0, 0, 1, 0, 0, 0], [0.0, 0.0, 5.0, 0.0, 0.0, 0.0]"


@pytest.fixture
def lines(tmp_path):
    """Return a function that translates nodes to lines without indentation, head and end."""

    def translate(*nodes, skip=(), answers=None, **parts):
        choices = Choices(frozenset(skip), answers or {})
        text = text_of(tmp_path / "p.urp", saved(*nodes, **parts).encode(), choices)
        assert [one for one in check_program(text) if "in column 1" not in one.text] == []
        return [line.strip() for line in text.splitlines()[1:-1]]

    return translate


@pytest.mark.parametrize(
    ("node", "script"),
    [
        ("<Comment comment='why'/>", ["$ 2 \"'why'\""]),
        ("<Comment/>", ['$ 2 "Comment"']),
        ("<Folder name='f'><children><Halt/></children></Folder>", ['$ 2 "f"', '$ 3 "Halt"', "halt"]),
        ("<SuppressedNode><suppressedNode class='Halt'/></SuppressedNode>", []),
        ("<Script type='File'><cachedContents>a=1\nb=2</cachedContents><file>/programs/s.script</file></Script>",
         ['$ 2 "Script: s.script"', "a=1", "b=2"]),
        (f"<Script type='Line'>{expression('sync()')}</Script>", ['$ 2 "sync()"', "sync()"]),
        ("<Wait type='Sleep'><waitTime>0.5</waitTime></Wait>", ['$ 2 "Wait: 0.5"', "sleep(0.5)"]),
        (f"<Wait type='Condition'>{expression('True')}</Wait>",
         ['$ 2 "Wait: True"', "while (not(True)):", "sync()", "end"]),
        ("<Wait type='DigitalInput'><pin referencedName='digital_in[3]'/><digitalValue>1</digitalValue></Wait>",
         ['$ 2 "Wait: get_standard_digital_in(3) == True"',
          "while (not(get_standard_digital_in(3) == True)):", "sync()", "end"]),
        (f"<Wait type='AnalogInput'>{LEVEL}</Wait>",
         ['$ 2 "Wait: get_standard_analog_in(1) > 4.0"', "while (not(get_standard_analog_in(1) > 4.0)):",
          "sync()", "end"]),
        (f"{SEVEN}<Popup type='Message' inputType='Variable'><variable featureName='x'/></Popup>",
         ['$ 2 "x≔7"', "global x=7",
          '$ 3 "Popup"', 'popup(str_cat("", x), "Message", False, False, blocking=True)']),
        ("<Popup type='Error' message='no part' haltProgram='true'/>",
         ['$ 2 "Popup: no part"', 'popup("no part", "Error", False, True, blocking=False)', "halt"]),
        (f"<Assignment><variable name='x'/>{expression('1≟2')}</Assignment>", ['$ 2 "x≔1≟2"', "global x=1 == 2"]),
        (f"<Assignment><variable name='x'/>{expression(*PARTS)}</Assignment>",
         ['$ 2 "x≔ not digital_in[2]≠x "', "global x=  not  get_standard_digital_in(2) != x"]),
        (f"<Assignment><variable name='Größe'/>{expression('1')}</Assignment>",
         ['$ 2 "Gru246u223e≔1"', "global Gru246u223e=1"]),
        ("<Loop type='Counting' count='3'><loopVariable name='i'/><children><Halt/></children></Loop>",
         ['$ 2 "Loop 3 times"', "i = 0", "while (i < 3):", '$ 3 "Halt"', "halt", "i = i + 1", "end"]),
        (f"<Loop type='While' checkContinuously='true'>{expression('True')}<children><Halt/></children></Loop>",
         ['$ 2 "Loop True"', "thread Thread_while_2():", "while (True):", '$ 3 "Halt"', "halt", "sync()", "end", "end",
          "if (True):", "global thread_handler_2=run Thread_while_2()", "while (True):", "sync()", "end",
          "kill thread_handler_2", "end"]),
        (WATCHED,
         ['$ 2 "If True"', "global thread_flag_2=0", "thread Thread_if_2():", '$ 3 "Halt"', "halt", "thread_flag_2 = 1",
          "end", "if (True):", "global thread_handler_2=run Thread_if_2()",
          "while (thread_flag_2 == 0 and (True)):", "sync()", "end", "kill thread_handler_2", "end",
          '$ 4 "Else"', "if (thread_flag_2 == 0):", "end"]),
        ("<Set type='NoAction'/>", ['$ 2 "Set"']),
        (f"<Set type='ExpressionOutput'><pin referencedName='digital_out[3]'/>{expression('1≟2')}</Set>",
         ['$ 2 "Set DO[3]=1≟2"', "set_standard_digital_out(3, 1 == 2)"]),
        (f"<Force type='Simple'>{TASK}<children><Placeholder/></children></Force>", []),
        (f"<Force type='Simple'>{TASK}<children><Halt/></children></Force>",
         ['$ 2 "Force"', "sleep(0.02)", "zero_ftsensor()", f"{FORCED}, 2, [0.1, 0.1, 0.2, 0.1, 0.1, 0.1])",
          '$ 3 "Halt"', "halt", "end_force_mode()", "stopl(5.0)"]),
        (contributed("com.robotiq.Robotiq_Force_Torque_Sensor.ForceNode", "Force Control", "<Halt/>",
                     ft_control_z="true", force_z="5"),
         ['$ 2 "Force Control"', f"{FORCED}, 2, [0.1, 0.1, 0.1, 0.35, 0.35, 0.35])", '$ 3 "Halt"', "halt",
          "end_force_mode()", "stopl(5.0)"]),
        (contributed("com.olisrobotics.teleop.TeleopNode", "Olis Teleop", OperatorMessage="Move it"),
         ['$ 2 "Olis Teleop"', "freedrive_mode()", 'popup("Move it", "Teleop", blocking=True)',
          "end_freedrive_mode()"]),
        ("<Set type='DigitalOutput'><pin referencedName='tool_out[0]'/><digitalValue>1</digitalValue></Set>",
         ['$ 2 "Set TO[0]=On"', "set_tool_digital_out(0, True)"]),
        (f"<Switch>{expression('2')}<children><Case caseValue='2147483647'/><Case caseValue='1'/></children></Switch>",
         ['$ 2 "Switch 2"', "switch_1 = 2", '$ 4 "Case 1"', "if (1 == switch_1):", "else:", '$ 3 "Default Case"',
          "end"]),
        (contributed(f"{GRIPPER}GripperNode", "Gripper", positionInDouble=50.0, speedInDouble=30.0, forceInDouble=0.0),
         ['$ 2 "Gripper"', "rq_set_pos(128)", "rq_set_speed(77)", "rq_set_force(0)", "rq_go_to()", "rq_wait()"]),
        (contributed(f"{GRIPPER}GripperActivate", "Gripper Activate"),
         ['$ 2 "Gripper Activate"', "rq_activate_and_wait()"]),
        (BRANCHES,
         ['$ 2 "If True"', "if (True):", "elif (True):", '$ 3 "ElseIf True"', "else:", '$ 4 "Else"', "end"]),
        (contributed(f"{GRIPPER}gripper_validation_node", "Grip Check",
                     contributed(f"{GRIPPER}gripper_validation_if_node", "If", "<Halt/>"),
                     contributed(f"{GRIPPER}gripper_validation_else_node", "Else", "<Halt/>"),
                     ObjectDetectedKey="false"),
         ['$ 2 "Grip Check"', '$ 3 "If not(rq_is_object_detected())"', "if (not(rq_is_object_detected())):",
          '$ 4 "Halt"', "halt", "else:", '$ 5 "Else"', '$ 6 "Halt"', "halt", "end"]),
    ],
)  # fmt: skip
def test_a_node_is_translated_to_the_script_that_polyscope_writes(lines, node, script):
    assert lines(node) == ['$ 1 "Robot Program"', *script]


def test_a_label_is_no_longer_than_a_text_may_be(lines):
    [label] = lines(f"<Comment comment='{'ö' * 600}'/>")[1:]
    assert 200 < len(label.encode()) < 1023


BOTH = "<motionParameters jointSpeed='0.3' cartesianSpeed='0.1'/>"
DH = (
    (0.0,) * 6,
    (0, -0.425, -0.3922, 0, 0, 0),
    (0.1625, 0, 0, 0.1333, 0.0997, 0.0996),
    (1.57, 0, 0, 1.57, -1.57, 0),
)
KINEMATICS = "".join(
    f"<{name} value='{', '.join(map(str, row))}'/>"
    for name, row in zip(("deltaTheta", "a", "d", "alpha"), DH, strict=True)
)
KNOWN = f"<TCPOffset pose='0, 0, 0.1, 0, 0, 0'/><Kinematics>{KINEMATICS}</Kinematics>"


def test_a_taught_waypoint_becomes_a_pose_and_a_posture_near_it(lines):
    taught = waypoint("A 1", Q, kinematics=KNOWN)
    text = lines(move(taught), move(taught, kind="MoveL"))
    assert text[-3:] == ['$ 4 "MoveL"', '$ 5 "A 1"', "movel(A_1_p, a=2.0, v=1.5)"]
    assert "movej(get_inverse_kin(A_1_p, qnear=A_1_q), a=2.0, v=1.5)" in text
    assert text.count(f"global A_1_q={list(Q)}") == 1
    straight = tool_pose(xml(f"<position><JointAngles angles='0,0,0,0,0,0'/>{KNOWN}</position>".encode()))
    flat = [0.0, -0.425 - 0.3922, 0.0]
    assert np.allclose(straight[0], flat[1], atol=1e-3)
    assert straight[1] == pytest.approx(-0.1333 - 0.0996 - 0.1, abs=1e-3)


@pytest.mark.parametrize(
    ("node", "script"),
    [
        (move(waypoint("A", Q)), "movej(A_q, a=2.0, v=1.5)"),
        (move(waypoint("A", Q, "<motionParameters jointSpeed='0.3' blendRadius='0.05'/>")),
         "movej(A_q, a=2.0, v=0.3, r=0.05)"),
        (move(waypoint("A", Q, BOTH)), "movej(A_q, a=2.0, v=0.3)"),
        (move(waypoint("A", Q, BOTH), kind="MoveL"), "movel(A_q, a=2.0, v=0.1)"),
        (move(waypoint("A", Q, "<motionParameters nextMotionTime='2'/>")), "movej(A_q, t=2.0)"),
        (move("<Waypoint type='Variable'><variable name='x'/></Waypoint>", kind="MoveL"), "movel(x, a=2.0, v=1.5)"),
        (move(waypoint("A", Q), waypoint("B", Q), kind="MoveP", blendRadius=0.02), "movep(B_q, a=2.0, v=1.5, r=0.0)"),
        (move(waypoint("A", Q), waypoint("B", Q), kind="MoveP", blendRadius=0.02), "movep(A_q, a=2.0, v=1.5, r=0.02)"),
        (move(waypoint("A", Q), kind="MoveP", blendRadius=0.02) + "<Halt/>", "movep(A_q, a=2.0, v=1.5, r=0.02)"),
        (move(waypoint("A", Q), kind="MoveP", blendRadius=0.02) + "<SuppressedNode/>" + move(waypoint("B", Q)),
         "movep(A_q, a=2.0, v=1.5, r=0.02)"),
        (move(waypoint("A", Q), kind="MoveP", blendRadius=0.02)
         + move(f"<{DIRECTION} selectedDirection='ZMinus'/>", kind="MoveL"), "movep(A_q, a=2.0, v=1.5, r=0.02)"),
        (move(waypoint("A", Q, "<motionParameters blendRadius='0'/>"), waypoint("B", Q), kind="MoveP",
              blendRadius=0.02), "movep(A_q, a=2.0, v=1.5, r=0.0)"),
        (move(f"<CircleMove OrientationMode='FIXED'><children>{waypoint('A', Q) * 2}</children></CircleMove>",
              kind="MoveP", blendRadius=0.02), "movec(A_q, A_q, a=2.0, v=1.5, r=0.0, mode=1)"),
    ],
)  # fmt: skip
def test_moves_have_the_speeds_of_their_node_or_waypoint(lines, node, script):
    set_up = f"<Assignment><variable name='x'/>{expression('p[0,0,0,0,0,0]')}</Assignment>"
    assert script in lines(set_up, node)


def test_a_direction_becomes_a_thread_with_its_until_conditions(lines):
    ends = (
        "<Until type='DISTANCE' distanceNodeType='BLEND' deceleration='3' allowActions='true'>"
        "<Distance>0.02</Distance><motionParameters blendRadius='0.005'/><children><Halt/></children></Until>"
        "<Until type='TOOL_CONTACT_DETECTION' retraction='0.002'/>"
        "<Until type='IO' digitalValue='true'><pin referencedName='digital_in[1]'/></Until>"
    )
    inside = f"{TOOL}<children>{ends}</children>"
    node = f"<{DIRECTION} selectedDirection='ZMinus' toolParams='0.1, 0.8'>{inside}</{DIRECTION}>"
    text = lines(move(node, kind="MoveL"))
    assert '$ 3 "Direction: Tool Z-"' in text
    assert "local ahead=point_towards(get_forward_kin(), [0.0, 0.0, -1.0], 0.02)" in text
    assert "movel(ahead, a=0.8, v=0.1, r=0.005)" in text
    places = [text.index(line) for line in (
        "if (steps_back > 0):", "if (get_standard_digital_in(1) == True):", "if (move_state_3 > 1):", "halt",
    )]  # fmt: skip
    assert places == sorted(places)


def test_sub_programs_threads_and_initial_values_precede_the_program(lines):
    inner = "<subprogram name='pick'><children><Halt/></children></subprogram>"
    call = f"<CallSubProgram>{inner}</CallSubProgram>"
    listed = "<SubProgram reference='../MainProgram/children/CallSubProgram/subprogram'/>"
    values = f"<variables><variable name='n'>{expression('4')}</variable></variables>"
    begin = f"<InitVariablesNode>{values}</InitVariablesNode>"
    begin += "<SpecialSequence type='BeforeStart'><children><Halt/></children></SpecialSequence>"
    wait = "<Wait type='Sleep'><waitTime>1</waitTime></Wait>"
    thread = f"<Thread name='T 1'><children>{wait}</children></Thread>"
    hidden = "<suppressedNode class='Thread'><children><Halt/></children></suppressedNode>"
    after = f"<SuppressedNode>{hidden}</SuppressedNode>{listed}{thread}"
    text = lines(call, before=begin, threads=after, repeats=True, InitVariablesNode="true")
    assert text == [
        "def pick():", '$ 8 "pick"', '$ 9 "Halt"', "halt", "end", "global n=4",
        '$ 2 "BeforeStart"', '$ 3 "Halt"', "halt",
        '$ 10 "T_1"', "thread T_1():", "while (True):", '$ 11 "Wait: 1.0"', "sleep(1.0)", "end", "end",
        "threadId_T_1 = run T_1()",
        "while (True):", '$ 4 "Robot Program"', '$ 5 "Call pick"', "pick()", "end",
    ]  # fmt: skip
    with pytest.raises(UserFileError, match="sub-programs p 1 and p_1"):
        lines(call, threads="<SubProgram name='p 1'/><SubProgram name='p_1'/>")


INSTALLATION = """<Installation>
<IOs><DigitalInputNames value=", part"/>
<DigitalOutputNames value="lamp, , "/><ModbusSignal name="Plc 1" type="DIGITAL_INPUT"/></IOs>
<SafeHomeSettings enabled="true" position="0, 1, 0, 1, 0, 1"/>
<TCPSettings activePose="hook" {}><availablePoses>
  <tcp name="hook" offset="0, 0, 0.2, 0, 0, 0"/></availablePoses></TCPSettings>{}
<Features><GeomPoseNode name="höhe" isVariable="true"><toolPosition value="0.3, 0.4, 0"/>
  <toolAxisAngle value="0, 0, 1"/></GeomPoseNode></Features>
</Installation>"""


CARRIED = 'centerOfGravity="0, 0, 0.05"'
PAYLOAD = f'<PayloadSettings><Payload mass="1.5" defaultPayload="true" {CARRIED}/></PayloadSettings>'


@pytest.mark.parametrize(
    ("payload", "variables"),
    [
        ((f'toolPayload="1.5" {CARRIED}', ""), "#\nTür 1=[3,  4]\n".encode()),
        (
            ("", PAYLOAD),
            gzip.compress(
                '<InstallationVariables><variable name="Tür 1" value="[3,&#10;4]"/></InstallationVariables>'.encode()
            ),
        ),
    ],
    ids=["lines", "packed XML"],
)
def test_the_installation_gives_tcp_payload_signals_features_and_variables(tmp_path, payload, variables):
    lamp = "<Set type='DigitalOutput'><pin referencedName='lamp'/><digitalValue>1</digitalValue></Set>"
    own = move(waypoint("A", Q), useActiveTCP="false", inside="<tcp referencedName='hook'/>")
    home = "<SafeHome positionOptionType='SPEED_AND_ACCELERATION' speed='1' acceleration='2'/>"
    tcp = "<Set type='NoAction'><tcp referencedName='hook'/></Set>"
    signal = "<ExpressionIO><pin referencedName='Plc 1'/></ExpressionIO>"
    part = signal.replace("Plc 1", "digital_in[1]")
    ready = f"<Wait type='Condition'>{expression(signal, '≟', part)}</Wait>"
    (tmp_path / "p.urp").write_text(saved(lamp, own, home, tcp, ready))
    (tmp_path / "cell.installation").write_text(INSTALLATION.format(*payload))
    (tmp_path / "cell.variables").write_bytes(variables)
    text = read_program(tmp_path / "p.urp")
    expected = (
        "set_tcp(p[0.0, 0.0, 0.2, 0.0, 0.0, 0.0])", "set_payload(1.5, [0.0, 0.0, 0.05])", "global Tu252r_1 = [3, 4]",
        "global hu246he = p[0.3, 0.4, 0.0, 0.0, 0.0, 1.0]", "set_standard_digital_out(0, True)",
        '"Set lamp=On"', "movej([0.0, 1.0, 0.0, 1.0, 0.0, 1.0], a=2.0, v=1.0)",
        'while (not(modbus_get_signal_status("Plc 1") == get_standard_digital_in(1))):', '"Wait: Plc 1≟part"',
    )  # fmt: skip
    for line in expected:
        assert line in text
    assert text.count("set_tcp(") == 3
    (tmp_path / "cell.installation").write_text(INSTALLATION.replace("0.2, 0", "much, 0"))
    with pytest.raises(UserFileError, match=r"cell\.installation"):
        read_program(tmp_path / "p.urp")


QUESTION = "<Assignment valueSource='Operator' message='?' valueType='{}'><variable name='x'/></Assignment>"


@pytest.mark.parametrize(
    ("kind", "answer", "value", "wrong", "form"),
    [
        ("Boolean", "true", "True", "perhaps", "x=true or x=false"),
        ("Integer", "-3", "-3", "2.5", "x=NUMBER, a whole number"),
        ("Float", "2", "2.0", "wide", "x=NUMBER"),
    ],
)
def test_an_answer_goes_to_the_variable_of_its_question(lines, kind, answer, value, wrong, form):
    question = QUESTION.format(kind)
    assert lines(question, answers={"x": answer})[1:] == ["$ 2 \"x≔'?'\"", f"global x={value}"]
    asked = {r'"\?"': {"y": answer}, rf'"\?", but x={wrong} is no answer': {"x": wrong}}
    for what, answers in asked.items():
        with pytest.raises(UserFileError, match=f"it asks {what}: give --answer {form}$"):
            lines(question, question, answers=answers)
    silent = question.replace("message='?' ", "").replace("'x'", "'y'")
    assert lines(silent, answers={"y": answer})[1] == "$ 2 \"y≔''\""
    with pytest.raises(UserFileError, match=rf"{form}; for y: give --answer y="):
        lines(question, silent)


def test_a_timer_counts_the_time_between_start_and_stop(lines):
    actions = ("Start", "Stop", "Reset", "Start")
    timers = (f"<Timer action='{action}'><variable name='t'/></Timer>" for action in actions)
    wait = "<Wait type='Sleep'><waitTime>{}</waitTime></Wait>"
    says = f"<Script type='Line'>{expression('textmsg(t)')}</Script>"
    start, stop, reset, again = timers
    nodes = (start, wait.format(0.5), stop, wait.format(0.2), says, reset, again, wait.format(0.1), says)
    times = said(run(a_robot(), *lines(*nodes)))
    assert list(map(float, times)) == pytest.approx([0.5, 0.1], abs=0.005)


@pytest.mark.parametrize(
    ("node", "what"),
    [
        ("<Event/>", "Event"),
        ("<Wait type='AnalogInput'><pin referencedName='analog_in[0]'/></Wait>", "Wait for a signal without"),
        ("<Timer action='Wind'><variable name='t'/></Timer>", r"Timer \(Wind\)"),
        ("<SafeHome/>", r"SafeHome \(without a position"),
        ("<Force type='Frame'><children><Halt/></children></Force>", r"Force \(Frame\)"),
        ("<Script/>", "a Script without text"),
        ("<Move/>", r"Move \(without a type\)"),
        (waypoint("A", Q), "a waypoint outside a Move"),
        (move(waypoint("A", Q[:5])), "the waypoint A"),
        (move(waypoint("A", Q, "<motionParameters odd='1'/>")), "a waypoint's odd"),
        (move(waypoint("A", Q), useActiveTCP="false", inside="<tcp referencedName='hook'/>"), "the TCP hook"),
        ("<Set type='DigitalOutput'><pin referencedName='RearPlc'/></Set>", "the signal RearPlc"),
        (f"<Assignment><variable/>{expression('1')}</Assignment>", "a variable without a name"),
        (QUESTION.format("Colour"), r"a question \(Colour\)"),
        ("<Set type='NoAction' payload='1.5'/>", r"Set \(with a payload\)"),
        (move(waypoint("A 1", Q), waypoint("A_1", Q)), r"the waypoints A 1 and A_1 \("),
        (move(f"<{DIRECTION}><feature reference='../x'/></{DIRECTION}>", kind="MoveL"),
         "a feature that is not in the file"),
        ("<If type='If' checkContinuously='true'><children/></If><If type='ElseIf'/>", r"If \(ElseIf\)"),
        (contributed("com.other.Node", "Vision", name="Cam"), "Cam: Vision"),
        (contributed(f"{GRIPPER}gripper_validation_if_node", "If"), "Robotiq_Grippers: If outside a Grip Check"),
        (move(waypoint("A", Q), kind="MoveP", blendRadius="wide"), "Move with could not convert"),
    ],
)  # fmt: skip
def test_nodes_that_cannot_be_simulated_are_listed_once(lines, node, what):
    why = f"PolyScope saved it with {what}[^,]*, which cannot be simulated"
    with pytest.raises(UserFileError, match=why):
        lines(node, node)


def test_nodes_of_a_urcap_are_left_out_on_request(lines):
    node = contributed("com.other.Node", "Vision", name="Cam")
    for skip in ("Cam", "Cam: Vision"):
        assert lines(node, "<Halt/>", skip=[skip]) == ['$ 1 "Robot Program"', '$ 3 "Halt"', "halt"]


SENT = "# HEADER_BEGIN\ndef step():\n  sync()\nend\n# HEADER_END\nstep()\n# NODE_CONTROL_LOOP_ENDS\n"


def test_the_clients_text_replaces_the_external_control_node(lines, tmp_path):
    node = contributed("com.fzi.externalcontrol.ExternalControlNode", "External Control", name="ext")
    assert EXTERNAL_CONTROL in lines(node)
    text = text_of(tmp_path / "p.urp", saved(node, "<Halt/>", repeats=True).encode())
    whole = with_external_control(text, SENT)
    assert whole.index("def step") < whole.index("step()\n") < whole.index("halt")
    alone = with_external_control(program_text("a", EXTERNAL_CONTROL), "sync()\n")
    assert alone == "def a():\n\n  sync()\n\nend\n"


def test_a_program_that_only_defines_functions_does_not_repeat(lines):
    node = "<Script type='File'><cachedContents>def step():\n  sync()\nend</cachedContents></Script>"
    idle = "<Placeholder/><SuppressedNode/>" + contributed("com.other.Node", "Vision", name="Cam")
    thread = f"<Thread name='t'><children>{idle}</children></Thread>"
    assert "while (True):" not in lines(node, idle, threads=thread, skip=["Cam"], repeats=True)
    assert "while (True):" in lines(node, "<Wait type='Sleep'><waitTime>1</waitTime></Wait>", repeats=True)


@pytest.mark.parametrize(
    ("hops", "place", "found"),
    [(90, "h[{}]", True), (200, "h[{}]", False), (1, f"h[{'9' * 5000}]", False), (1, "x/../" * 300 + "h[{}]", False)],
)  # fmt: skip
def test_references_are_followed_up_to_a_limit(hops, place, found):
    chain = "".join(f"<h><v reference='../../{place.format(hop)}/v'/></h>" for hop in range(2, hops + 2))
    root = xml(f"<root>{chain}<h><v name='a'/></h></root>".encode())
    target = References(root).target(root.find("./h/v"))
    assert (target is not None and target.get("name") == "a") is found


FOLDERS = "<Folder><children>" * 10_000 + "</children></Folder>" * 10_000
LOOP = "".join(f"<Call><subprogram reference='../../Call[{k}]/subprogram'/></Call>" for k in (2, 1))


@pytest.mark.parametrize(
    ("content", "why"),
    [
        (gzip.compress(b"<a>" + b" " * (100 << 20), 1), "more than 4 MiB when it is unpacked"),
        (b"<!DOCTYPE a [<!ENTITY b 'b'><!ENTITY c '&b;&b;'>]><a>&c;</a>", "has a document type"),
        (gzip.compress(saved(FOLDERS).encode()), "nested too deeply"),
        (saved("<Halt/>" * 400_000).encode(), "has too many elements"),
        (gzip.compress(saved(LOOP.replace("Call", "CallSubProgram") * 10_000).encode()), "not in the file"),
        (b"<" * (5 << 20), "more than 4 MiB"),
    ],
    ids=["gzip bomb", "entity bomb", "nested levels", "elements", "loop of references", "long file"],
)
def test_a_hostile_program_gives_one_error_in_short_time(tmp_path, content, why):
    (tmp_path / "p.urp").write_bytes(content)
    begun = process_time()
    with pytest.raises(UserFileError, match=why):
        read_program(tmp_path / "p.urp")
    assert process_time() - begun < 2.0
