"""Record the runs whose journals are kept here: `python -m tests.journals.make FOLDER [NAME ...]`.

Each is a served robot with the clients that its name tells of. What runs in real time comes out a little different
every time; only its replay is always the same.
"""

import socket
import sys
import time
from pathlib import Path

from tests.conformance.served import PATIENCE
from tests.conformance.wire import Q1
from tests.journals import at_work
from tests.journals.hand import robot

Q2 = [0.0, -2.9, 0.4, -1.4, 0.3, 0.2]
Q3 = [0.6, -2.7, 0.5, -1.9, -0.3, 0.6]
SHAPERS = ("none", "zv", "zvd", "ei3", "auto", "short", "zv_3_modes", "auto-target")


def moves_with_every_shaper(path):
    with robot(path, "--shaper", "auto") as hand:
        for number, shaper in enumerate(SHAPERS):
            hand.do("set_shaper", name=shaper)
            hand.move((Q2, Q3, Q1)[number % 3], acceleration=1.4 + 0.1 * number)


def moves_with_another_payload(path):
    with robot(path, "--payload", "2", "--truth", "--seed", "7") as hand:
        hand.move(Q3)
        hand.do("set_payload", mass=0.0, com=[0, 0, 0], inertia=[0, 0, 0, 0, 0, 0])
        hand.move(Q2, jerk=400.0)
        hand.do("set_estimator", name="fixed", f_d=7.5, zeta=0.01)
        hand.move(Q1)


def streams(path):
    with robot(path, "--shaper", "zv") as hand:
        hand.stream_in_steps(2.0)
        hand.do("servo_stop")
        hand.wait(600)
        hand.do("set_shaper", name="auto")
        hand.stream(2.0, 0.008)
        hand.do("servo_stop")
        hand.wait(600)
        hand.stream(1.0, joint=2, amplitude=0.4, hertz=2.0)  # beyond its limits
        hand.do("set_shaper", name="ei3")
        hand.wait(100)
        hand.do("stop")
        hand.wait(600)


def faults(path):
    with robot(path, "--shaper", "short") as hand:
        stops = ("protective_stop", "safeguard_stop", "emergency_stop")
        for fault in (*stops, "power_loss", "violation", "nan"):
            hand.do("move_j", q=Q2)
            hand.wait(333)
            hand.do("simulation.inject", fault=fault)
            hand.wait(700)
            hand.do("simulation.inject", fault="normal")
            for command in ("unlock_protective_stop", "restart_safety", "power_on", "resume"):
                hand.do(command)
            hand.wait(900)
            hand.move(Q1)
        hand.do("simulation.inject", fault="reduced")
        hand.move(Q3)
        hand.do("simulation.inject", fault="torque", joint=2, value=90.0, seconds=0.4)
        hand.wait(900)


def collisions_and_refusals(path):
    with robot(path) as hand:
        hand.move([0.0, 0.5, 0.0, 0.0, 0.0, 0.0])
        hand.move([0.0, -1.57, 3.1, 0.0, 0.0, 0.0])
        hand.do("move_j", q=[0.0] * 5)
        hand.do("move_j", q=Q2, velocity=99.0)
        hand.stream(3.0, 0.02, joint=1, amplitude=1.9, hertz=0.2)
        hand.wait(900)
        hand.do("servo_stop")
        hand.do("simulation.reset", q=Q3, seed=5, shaper="auto")
        hand.move(Q2, velocity=2.5, acceleration=12.0, jerk=900.0)


def live_moves(path):
    with robot(path, "--shaper", "auto", clock="realtime") as hand:
        hand.move(Q2)
        hand.do("move_j", q=Q3)
        hand.wait(250)
        hand.do("stop")
        hand.wait(500)
        hand.move(Q1)


def live_stream(path):
    with robot(path, "--shaper", "zv", clock="realtime") as hand:
        hand.stream(3.0, 0.008)
        hand.do("servo_stop")
        hand.wait(500)
        hand.stream(1.0)
        hand.wait(700)  # nobody goes on with it


def live_faults(path):
    with robot(path, clock="realtime") as hand:
        for fault in ("safeguard_stop", "emergency_stop", "reduced"):
            hand.do("move_j", q=Q2)
            hand.wait(200)
            hand.do("simulation.inject", fault=fault, seconds=0.3)
            hand.wait(600)
            for command in ("restart_safety", "power_on", "resume", "keep_alive"):
                hand.do(command)
            hand.wait(500)
            hand.move(Q1)


def live_lost_lease(path):
    with robot(path, "--shaper", "ei3", clock="realtime") as hand:
        answer = hand.wire.command("take_control", client="somebody", lease_s=0.5)
        hand.token = answer["token"]
        hand.do("move_j", q=Q3, velocity=0.4)
        hand.wire.wait("event", lambda event: event["kind"] == "lease_lost")
        hand.wait(700)


def live_programs_of_the_dashboard(path):
    address = "127.20.251.7"

    def ask(*lines):
        with socket.create_connection((address, 29999), PATIENCE) as stream, stream.makefile("rw") as talk:
            talk.readline()
            for line in lines:
                talk.write(f"{line}\n")
                talk.flush()
                talk.readline()
                time.sleep(0.2)

    # The options open UR's interfaces, without the profile of UR's simulator.
    options = ("--profile", "real", "--start", "Q1", "--ur-address", address)
    with robot(path, *options, clock="realtime") as hand:
        hand.do("release_control")
        ask("load paper.urp", "play", "programState")
        hand.wait(1500)
        ask("pause", "programState", "play", "stop")
        hand.wait(500)
        ask("load Q1.urp", "play", "running")
        hand.wait(1500)
        ask("power off", "power on", "brake release", "load wait_program.urp", "play")
        hand.wait(200)
        ask("stop")


RUNS = (
    moves_with_every_shaper, moves_with_another_payload, streams, faults, collisions_and_refusals, live_moves,
    live_stream, live_faults, live_lost_lease, live_programs_of_the_dashboard, *at_work.RUNS,
)  # fmt: skip


def main(folder, *names):
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    for run in (run for run in RUNS if not names or run.__name__ in names):
        path = folder / f"{run.__name__}.mcap"
        path.unlink(missing_ok=True)
        print(path, file=sys.stderr)  # noqa: T201  it takes a minute
        run(path)


if __name__ == "__main__":
    main(*sys.argv[1:])
