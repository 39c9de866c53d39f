"""Random programs in URScript, for sequences of commands."""

from collections.abc import Callable

import numpy as np
from tests.search import space

from tvist_controller.api.line import Arm

Random = np.random.Generator
MOST_STATEMENTS = 7  # number of statements of a program, at most
HEAVY = 1.0  # largest mass that programs declare [kg]


class Author:
    """Writes programs whose moves begin near a posture."""

    def __init__(self, description, q, random):
        self._limit, self._q, self._random = np.array(description.limits.position), q, random
        self._fastest, self._hardest = min(description.limits.velocity), min(description.limits.acceleration)
        self._kinematics = Arm(description)

    def program(self, name):
        """A program; in some, threads move the arm before it does, or run beside it, and are killed sooner or later."""
        random, lines, body = self._random, ["global count = 0"], list[str]()
        for number in range(int(random.choice([0, 0, 1, 2]))):
            moving = bool(random.random() < 0.5)
            steps = self._statements(int(random.integers(1, 4)), moving=moving)
            if random.random() < 0.3:
                steps = _endlessly(steps)
            lines += [f"thread t{number}():", *_indented(steps), "end"]
            end = "join" if random.random() < 0.2 else "kill"
            body += [f"h{number} = run t{number}()"]
            if moving and random.random() < 0.9:  # else both move the arm, which is an error
                body += [f"sleep({random.uniform(0.0, 0.6):.3f})", f"{end} h{number}"]
        body += self._statements(int(random.integers(1, MOST_STATEMENTS + 1)), moving=True)
        if random.random() < 0.15:
            body = _endlessly(body)
        return self._whole("def", name, lines + body)

    def secondary(self, name):
        """A secondary program, which does not move the arm."""
        body = self._statements(int(self._random.integers(1, 4)), moving=False)
        return self._whole("sec", name, ["global count = 0", *body])

    @staticmethod
    def _whole(keyword, name, lines):
        return "\n".join((f"{keyword} {name}():", *_indented(lines), "end", ""))

    def _statements(self, count, *, moving):
        kinds = _MOVING + _STILL if moving else _STILL
        weights = np.array([weight for weight, _ in kinds], dtype=float)
        lines: list[str] = []
        for number in self._random.choice(len(kinds), count, p=weights / weights.sum()):
            lines += kinds[number][1](self)
        return lines

    def movej(self):
        random = self._random
        goal = self._posture(1.0) if random.random() < 0.7 else self._pose()
        v, a = random.choice([1.0, 1.05, *random.uniform(0.07, 1.0, 6)]) * self._fastest, self._acceleration()
        return [f"movej({goal}, a={a:.3f}, v={v:.3f}{self._blend()})"]

    def movel(self):
        goal = "p[2, 0, 0, 0, 0, 0]" if self._random.random() < 0.03 else self._pose()
        return [f"movel({goal}, {self._pace()}{self._blend()})"]

    def movep(self):
        return [f"movep({self._pose()}, {self._pace()}{self._blend()})"]

    def movec(self):
        mode = int(self._random.integers(2))
        return [f"movec({self._pose(0.4)}, {self._pose()}, {self._pace()}{self._blend()}, mode={mode})"]

    def path(self):
        moves = (self.movel, self.movep, self.movec, self.movej)
        lines = []
        for _ in range(int(self._random.integers(2, 5))):
            (move,) = moves[int(self._random.integers(4))]()
            lines += [move.replace(", r=0)", ", r=0.03)").replace(", r=0,", ", r=0.03,"), *self.write()]
        return lines

    def servoj(self):
        random, goal = self._random, self._posture(0.4)
        call = (
            f"servoj({goal}, t={random.choice([0.002, 0.008])}, lookahead_time={random.uniform(0.03, 0.2):.3f}, "
            f"gain={random.uniform(100, 2000):.0f})"
        )
        return ["i = 0", f"while i < {random.integers(1, 200)}:", *_indented([call, "i = i + 1"]), "end"]

    def servoc(self):
        return [f"servoc({self._pose(0.3)}, {self._pace()}, r={self._random.choice([0, 0.02])})"]

    def speedj(self):
        random = self._random
        shares = random.choice([0.6, 1.0]) * random.uniform(-1, 1, len(self._q)) * (random.random() > 0.15)
        qd = self._fastest * shares
        return [f"speedj({qd.round(3).tolist()}, {self._acceleration():.3f}{self._time()})"]

    def speedl(self):
        xd = self._random.uniform(-0.4, 0.4, 6) * (self._random.random() > 0.15)
        return [f"speedl({xd.round(3).tolist()}, {self._random.uniform(0.3, 4.0):.3f}{self._time()})"]

    def stop(self, name, most):
        return [f"{name}({10 ** self._random.uniform(-1, most):.3f})"]

    def write(self):
        number = int(self._random.integers(4))
        return [
            (f"write_output_integer_register({number}, count)", f"set_standard_digital_out({number}, True)",
             f"set_flag({number}, True)", "textmsg(count)")[int(self._random.integers(4))],
            "count = count + 1",
        ]  # fmt: skip

    def sleep(self):
        return [f"sleep({self._random.choice([0.0, 0.002, 0.1, 0.5]):g})"]

    def payload(self):
        mass, com = self._random.uniform(0.0, HEAVY), self._random.uniform(-0.05, 0.05, 3).round(3).tolist()
        return [f"set_target_payload({mass:.3f}, {com}, transition_time={self._random.choice([0, 0.2])})"]

    def tool(self):
        return [f"set_tcp(p[0, 0, {self._random.uniform(0.0, 0.2):.3f}, 0, 0, 0])"]

    def critical(self):
        return ["enter_critical", *self.write(), *self.sleep(), "exit_critical"]

    def _posture(self, share):
        moved = self._q + share * self._random.uniform(-1.0, 1.0, len(self._q))
        return f"{np.clip(moved, -self._limit, self._limit).round(4).tolist()}"

    def _pose(self, share=1.0):
        if self._random.random() < 0.2:
            return f"pose_add(get_target_tcp_pose(), p[0, 0, {self._random.uniform(-0.1, 0.1):.3f}, 0, 0, 0])"
        return f"p{np.round(space.pose_near(self._kinematics, self._q, self._random, share), 4).tolist()}"

    def _acceleration(self):
        random, most = self._random, self._hardest
        return float(random.choice([random.uniform(0.5, 8.0), random.uniform(8.0, most), most]))

    def _pace(self):
        return f"a={self._random.uniform(0.3, 4.0):.3f}, v={self._random.uniform(0.05, 0.8):.3f}"

    def _blend(self):
        return f", r={self._random.choice(['0', '0', '0.02', '0.05'])}"

    def _time(self):
        return "" if self._random.random() < 0.3 else f", {self._random.choice([0.002, 0.1, 0.5])}"


def _endlessly(lines):
    return ["while True:", *_indented([*lines, "sync()"]), "end"]


def _indented(lines):
    return [f"  {line}" for line in lines]


_MOVING: tuple[tuple[float, Callable[[Author], list[str]]], ...] = (
    (5.0, Author.movej), (4.0, Author.movel), (2.0, Author.movep), (2.0, Author.movec), (2.0, Author.path),
    (3.0, Author.servoj), (2.0, Author.servoc), (3.0, Author.speedj), (3.0, Author.speedl),
    (2.0, lambda its: its.stop("stopj", 1.6)), (1.0, lambda its: its.stop("stopl", 1.0)),
)  # fmt: skip
"""Statements that move the arm, and their relative frequencies."""
_STILL: tuple[tuple[float, Callable[[Author], list[str]]], ...] = (
    (2.0, Author.write), (3.0, Author.sleep), (1.0, Author.payload), (0.5, Author.tool),
    (0.5, lambda _: ["protective_stop()"]), (0.3, lambda _: ["while True:", "  count = count + 1", "end"]),
    (0.3, lambda _: ["halt"]), (0.5, Author.critical),
)  # fmt: skip
"""Statements that do not move the arm, and their relative frequencies."""
