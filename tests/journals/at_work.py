"""Runs of arms at work, in lockstep: tool paths, speeds, forces, programs, a gripper, worlds, other arms, a lesson."""

import socket
from contextlib import contextmanager
from pathlib import Path

from tests.conformance.served import PATIENCE, finished
from tests.journals.hand import robot

ROOT = Path(__file__).parents[2]
CELL = ROOT / "clients" / "examples" / "cell.toml"
THREE, SEVEN = (ROOT / "tests" / "plant" / "urdf" / name for name in ("three.urdf", "seven.urdf"))
BENT = "0,-1.57,1.57,-1.57,-1.57,0"
"""Where the tool can go in all directions."""
OVER_THE_TABLE = "-2.3046,-1.663,-1.6661,-1.3833,1.5709,0.837"
"""The gripper is above what lies at (-0.45, -0.3)."""
ON_THE_RIM = "-2.4213,-1.6782,-2.1233,-0.9108,1.5709,0.7202"
"""The peg is above the rim of its hole, 20 mm beside that."""
DOWN = [False, False, True, False, False, False]


@contextmanager
def started(path, start, *options):
    """A robot that starts in a posture, and is at rest."""
    with robot(path, f"--start={start}", *options) as hand:
        hand.wait(1)
        yield hand


def around(hand):
    """Poses by their distance from where the tool is."""
    x, y, z, *turn = hand.wire.command("forward_kinematics")["pose"]
    return lambda dx, dy, dz, rx=0.0: [x + dx, y + dy, z + dz, turn[0] + rx, *turn[1:]]


def identified(path, arm):
    """The options that serve an arm with a calibration of its own."""
    file = str(path.resolve().with_suffix(".json"))
    fit = ("--ring-downs", "8", "--robot", arm.relative_to(ROOT), "--output", file)
    done = finished("-m", "tvist_cli", "identify", *fit, cwd=ROOT)  # its words are in the calibration
    assert done.returncode == 0, done.stderr
    return "--robot", str(arm), "--calibration", file


def program(hand, *lines, ticks):
    """Run a program for some time."""
    hand.must("program.run", text="\n".join(("def work():", *(f"  {line}" for line in lines), "end")))
    hand.wait(ticks)


def elastic_with_a_payload(path):
    near = [-0.3, -1.4, 1.8, -1.9, -1.3, 0.2]
    with started(path, BENT, "--payload", "3", "--shaper", "elastic", "--truth") as hand:
        at = around(hand)
        hand.must("move_j", q=near, acceleration=4.0, jerk=300.0)
        hand.wait(400)
        for shaper in ("elastic-16", "elastic-auto", "elastic-position-20"):
            hand.must("set_shaper", name=shaper)
            hand.must("move_l", pose=at(0.0, 0.0, 0.0), velocity=0.8, acceleration=3.0)
            hand.wait(150)
            hand.must("set_shaper", name="elastic")  # in motion: one feed-forward fades into the other
            hand.wait(200)
            hand.must("move_j", q=near, acceleration=3.0)
            hand.wait(120)
            hand.must("stop")
            hand.wait(130)
            hand.must("set_payload", mass=2.0, com=[0, 0, 0.05], inertia=[0.002, 0, 0, 0.002, 0, 0.002])


def tool_paths(path):
    with started(path, BENT, "--shaper", "auto", "--compensate-sag") as hand:
        at, bent = around(hand), [float(angle) for angle in BENT.split(",")]
        segments = [
            {"type": "line", "pose": at(0.1, 0.0, 0.0), "blend": 0.03, "velocity": 0.5},
            {"type": "arc", "via": at(0.15, 0.05, 0.0), "pose": at(0.1, 0.1, 0.0), "blend": 0.02},
            {"type": "process", "pose": at(0.0, 0.1, 0.03, 0.2), "velocity": 0.2, "blend": 0.03},
            {"type": "process", "pose": at(0.0, 0.0, 0.0), "velocity": 0.2, "blend": 0.02},
            {"type": "joint", "q": [bent[0] + 0.2, *bent[1:]], "blend": 0.02},
            {"type": "joint", "q": bent},
        ]
        hand.must("move_path", segments=segments)
        hand.wait(300)
        hand.must("set_speed", fraction=0.4)
        hand.wait(300)
        hand.must("pause")
        hand.wait(150)
        hand.must("set_speed", fraction=1.0)
        hand.must("resume")
        hand.wait(1450)
        hand.must("move_l", pose=at(-0.1, 0.0, 0.1), duration=0.8)
        hand.wait(470)
        hand.must("set_shaper", name="zvd")
        hand.must("move_c", via=at(-0.05, 0.05, 0.1), pose=at(0.0, 0.0, 0.1), orientation="tangent")
        hand.wait(250)
        hand.must("set_speed", fraction=0.6)
        hand.wait(200)
        hand.must("stop")
        hand.wait(150)
        hand.must("set_speed", fraction=1.0)
        hand.must("move_path", segments=segments[:4], frame=[0.0, 0.0, 0.02, 0.0, 0.0, 0.1])
        hand.wait(350)
        hand.must("stop_l", acceleration=2.0)
        hand.wait(300)


def speeds(path):
    with started(path, BENT, "--shaper", "zv") as hand:
        at = around(hand)
        hand.must("speed_j", qd=[0.4, -0.2, 0.2, 0.0, 0.3, 0.6], shaped=True)
        hand.wait(300)
        hand.must("speed_l", xd=[0.0, 0.1, 0.15, 0.0, 0.3, 0.0], acceleration=0.8)
        hand.wait(300)
        hand.must("stop_l", acceleration=1.0, angular_acceleration=2.0)
        hand.wait(200)
        hand.must("speed_l", xd=[0.1, 0.0, -0.2, 0.2, 0.0, 0.0], shaped=True)
        hand.wait(250)
        hand.must("stop_j", acceleration=3.0)
        hand.wait(200)
        hand.must("move_l", pose=at(0.0, 0.0, 0.05), velocity=0.5)
        hand.wait(150)
        for number in range(8):  # takes over the line
            hand.must("servo_j", q=[0.05 * number, -1.5, 1.5, -1.6, -1.57, 0.1], lookahead=0.08, gain=500.0)
            hand.wait(20)
        hand.must("stop")
        hand.wait(200)
        hand.must("speed_l", xd=[0.0, -1.0, 0.0, 0.0, 0.0, 0.0])  # to where it would be singular
        hand.wait(900)


def servoj_of_a_program(path):
    with started(path, BENT, "--profile", "real", "--shape-servo", "--shaper", "zv") as hand:
        program(
            hand,
            "q0 = get_target_joint_positions()",
            "t = 0.0",
            "while t < 1.6:",
            "  q = q0",
            "  q[0] = q0[0] + 0.15 * sin(3.0 * t)",
            "  q[3] = q0[3] + 0.1 * (1.0 - cos(5.0 * t))",
            "  servoj(q, t=0.008, lookahead_time=0.06, gain=400)",
            "  t = t + 0.008",
            "end",
            "stopj(4)",
            "speedl([0, 0.1, -0.1, 0, 0, 0.2], 0.5, 0.4)",
            "speedj([0.2, 0, 0, 0, 0.3, 0], 1.0, 0.3)",
            "stopl(1)",
            "here = get_target_tcp_pose()",
            "movep(pose_trans(here, p[0.05, 0, -0.05, 0, 0, 0]), a=1, v=0.2, r=0.02)",
            "movel(pose_trans(here, p[0.05, 0.08, 0, 0, 0, 0]), a=1, v=0.3, r=0.02)",
            "movej(q0, a=2, v=1)",
            ticks=2400,
        )


def force_mode_in_contact(path):
    options = ("--world", "peg", "--payload", "0.5", "--shaper", "none", "--profile", "real")
    with started(path, ON_THE_RIM, *options) as hand:
        hand.must("set_tcp", offset=[0, 0, 0.12, 0, 0, 0])
        hand.must("zero_ftsensor")
        limits = [0.05, 0.05, 0.05, 0.3, 0.3, 0.3]
        hand.must("force_mode", compliant=DOWN, wrench=[0, 0, -12, 0, 0, 0], limits=limits)
        hand.wait(200)
        hand.must("speed_l", xd=[-0.02, 0, 0, 0, 0, 0])  # over the rim, to the hole
        hand.wait(520)
        yielding = [True, True, True, True, True, False]
        hand.must("force_mode", compliant=yielding, wrench=[0, 0, -25, 0, 0, 0], limits=limits, gain=0.8)
        hand.wait(350)
        hand.must("end_force_mode")
        hand.wait(100)


def freedrive(path):
    with started(path, BENT, "--payload", "1", "--no-floor") as hand:
        hand.must("freedrive")
        for joint, torque in ((0, 25.0), (1, -30.0), (4, 8.0)):
            hand.must("simulation.inject", fault="torque", joint=joint, value=torque, seconds=0.5)
            hand.wait(300)
        hand.must("freedrive", free=[True, True, False, False, False, True], frame="tool")
        hand.must("simulation.inject", fault="torque", joint=2, value=25.0, seconds=0.4)
        hand.wait(300)
        hand.must("end_force_mode")
        hand.wait(200)
        program(hand, "ft_rtde_input_enable(True)", "sleep(0.02)", "freedrive_mode()", "sleep(2)", ticks=1)
        for number in range(12):  # a sensor of the client's own feels a push
            hand.must("set_external_wrench", wrench=[3.0 * number, -10.0, 0.0, 0.0, 0.5, 0.0])
            hand.wait(50)
        hand.must("stop")
        hand.wait(300)


def cell_with_a_gripper(path):
    address = "127.20.251.9"
    options = ("--cell", str(CELL), "--shaper", "auto", "--profile", "real", "--ur-address", address)
    with started(path, OVER_THE_TABLE, *options) as hand:
        program(
            hand,
            "set_standard_digital_out(1, True)",
            "while not get_standard_digital_in(3):",
            "  sync()",
            "end",
            "rq_activate_and_wait()",
            "movel(p[-0.45, -0.3, 0.2, 2.2214, 2.2214, 0])",
            "rq_close_and_wait()",
            "movel(p[-0.45, -0.3, 0.25, 2.2214, 2.2214, 0])",
            "set_payload(1.32, [0, 0, 0.09])",
            "movel(p[-0.5, -0.2, 0.21, 2.2214, 2.2214, 0], a=2, v=0.5)",
            "rq_set_speed(255)",
            "rq_move_and_wait(100)",
            "set_payload(0.92, [0, 0, 0.058])",
            "movel(p[-0.5, -0.2, 0.25, 2.2214, 2.2214, 0])",
            ticks=2000,
        )
        with socket.create_connection((address, 63352), PATIENCE) as fingers:  # as a client of the gripper
            fingers.sendall(b"SET POS 200 GTO 1\n")
            assert fingers.recv(3) == b"ack"
        hand.wait(150)


def arm_of_three_joints(path):
    options = (*identified(path, THREE), "--shaper", "zvd", "--payload", "2", "--truth")
    with started(path, "0.2,0.4,1.0", *options) as hand:
        hand.must("move_j", q=[0.6, 0.2, 1.4], acceleration=3.0)
        hand.wait(550)
        hand.must("set_estimator", name="fixed", f_d=[7.6], zeta=[0.3])
        hand.must("move_j", q=[0.0, 0.6, 0.8], duration=0.9)
        hand.wait(200)
        hand.must("pause")
        hand.wait(150)
        hand.must("resume")
        hand.wait(500)
        hand.must("speed_j", qd=[0.3, -0.2, 0.4])
        hand.wait(250)
        hand.must("stop_j")
        hand.wait(200)
        hand.stream(0.8, 0.008, amplitude=0.2)
        hand.must("servo_stop")
        hand.wait(300)
        hand.must("set_shaper", name="elastic")
        hand.must("move_j", q=[0.3, 0.4, 1.0])
        hand.wait(450)


def arm_of_seven_joints(path):
    options = (*identified(path, SEVEN), "--shaper", "zv", "--plant", "backlash", "--payload", "3")
    with started(path, "0.3,0.5,0.2,1.2,-0.3,1.0,0.1", *options) as hand:
        at = around(hand)
        hand.must("move_l", pose=at(0.05, 0.1, -0.1), velocity=0.4)
        hand.wait(600)
        corner = {"type": "line", "pose": at(0.0, 0.1, 0.0, 0.2), "blend": 0.03, "velocity": 0.4}
        end = {"type": "line", "pose": at(0.0, 0.0, 0.0), "velocity": 0.4}
        hand.must("move_path", segments=[corner, end])
        hand.wait(250)
        hand.must("stop")
        hand.wait(250)
        hand.must("set_shaper", name="auto")
        hand.must("speed_l", xd=[0.0, -0.1, 0.1, 0.0, 0.0, 0.3])
        hand.wait(300)
        hand.must("stop_l")
        hand.wait(150)
        hand.must("move_j", q=[0.0, 0.3, -0.2, 1.0, 0.4, 0.8, -0.5], acceleration=3.0)
        hand.wait(700)
        hand.must("freedrive")
        hand.must("simulation.inject", fault="torque", joint=3, value=30.0, seconds=0.3)
        hand.wait(250)
        hand.must("stop")
        hand.wait(150)


def learnt_payload(path):
    with robot(path, "--payload", "1", "--adapt", "payload", "--shaper", "auto") as hand:
        near, far = [0.0, -1.8, 1.2, -1.6, 0.0, 0.0], [0.6, -1.3, 1.7, -1.9, 0.4, 0.5]
        carried = {"mass": 4.0, "com": [0.0, 0.01, 0.035], "inertia": [0.004, 0, 0, 0.004, 0, 0.005]}
        hand.must("simulation.reset", payload=carried, q=near)
        for q in (far, near):
            hand.must("move_j", q=q)
            hand.wait(800)
        hand.must("forget", what="payload")
        hand.must("move_j", q=far)
        hand.wait(800)


RUNS = (
    elastic_with_a_payload, tool_paths, speeds, servoj_of_a_program, force_mode_in_contact, freedrive,
    cell_with_a_gripper, arm_of_three_joints, arm_of_seven_joints, learnt_payload,
)  # fmt: skip
