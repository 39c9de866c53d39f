"""Random programs: valid ones from the grammar, and texts that have been spoilt."""

import random
import re

GLOBALS = ["g0", "g1", "g2", "time", "p"]
NUMBERS = ["0", "1", "2", "3", "-1", "0.5", "1e-3", "2147483647", "1e300", "7"]
TEXTS = ['""', '"a"', '"some text"']
OPERATORS = ["+", "-", "*", "/", "%", "==", "!=", "<", ">", "<=", ">=", "and", "or", "xor"]
PURE = [
    ("sin", 1), ("sqrt", 1), ("norm", 1), ("floor", 1), ("pow", 2), ("str_cat", 2), ("to_str", 1), ("length", 1),
    ("pose_trans", 2), ("pose_inv", 1), ("get_list_length", 1), ("make_list", 2), ("integer_to_binary_list", 1),
    ("str_sub", 2),
    ("inv", 1), ("transpose", 1), ("size", 1), ("atan2", 2), ("to_num", 1), ("interpolate_pose", 3),
]  # fmt: skip


class Writer:
    """Writes a program whose names are all known. It may fail when it runs, and it may loop without end."""

    def __init__(self, seed):
        self.random = random.Random(seed)
        # Values that fit, so that the program lives long; else anything anywhere.
        self.sane = self.random.random() < 0.7
        self.functions = []
        self.threads = []
        self.lines = []
        self.depth = 0

    def program(self):
        self.line("def program():")
        self.line("global h = 0")
        self.line("global l = [1, 2, 3]")
        for name in GLOBALS:
            if self.sane:
                self.line(f"global {name} = {self.random.choice(NUMBERS)}")
                continue
            self.line(
                f"global {name} = {self.random.choice([*NUMBERS, *TEXTS, '[1, 2, 3]', 'p[1, 2, 3, 0.1, 0.2, 0.3]'])}"
            )
        self.functions = [(f"f{k}", self.random.randrange(4)) for k in range(self.random.randrange(3))]
        self.threads = [f"t{k}" for k in range(self.random.randrange(2))]
        for name, count in self.functions:
            names = [f"a{k}" for k in range(count)]
            parameters = [n if k + 1 < count else f"{n}={self.atom([])}" for k, n in enumerate(names)]
            self.line(f"def {name}({', '.join(parameters)}):")
            self.body([*names, *GLOBALS], loop=False)
            self.line("end")
        for name in self.threads:
            self.line(f"thread {name}():")
            self.body(list(GLOBALS), loop=False)
            self.line("end")
        self.body(list(GLOBALS), loop=False, most=8)
        self.line("end")
        return "\n".join(self.lines) + "\n"

    def line(self, text):
        self.lines.append(
            self.random.choice(["", " ", "\t", "    "]) + text + self.random.choice(["", "", "  # why"])
        )

    def body(self, names, *, loop, most=3):
        self.depth += 1
        for _ in range(self.random.randrange(most + 1)):
            self.statement(names, loop)
        self.depth -= 1

    def statement(self, names, loop):
        pick = self.random.randrange(20)
        if pick < 5:
            self.assign(names)
        elif pick < 8:
            self.line(f"textmsg({self.expression(names)}, {self.expression(names)})")
        elif pick < 11 and self.depth < 4:
            self.line(f"if {self.expression(names)}:")
            self.body(names, loop=loop)
            for _ in range(self.random.choice([0, 0, 0, 0, 0, 0, 1, 1, 1, 2, 2, 17])):
                self.line(f"elif {self.expression(names)}:")
                self.body(names, loop=loop, most=2)
            if self.random.random() < 0.5:
                self.line("else:")
                self.body(names, loop=loop)
            self.line("end")
        elif pick < 13 and self.depth < 4:
            self.line(f"while {self.expression(names)}:")
            self.body(names, loop=True)
            if self.random.random() < 0.7:
                self.line("sync()")
            if self.sane and self.random.random() < 0.5:
                self.line("break")
            self.line("end")
        elif pick == 13:
            self.line("sync()")
        elif pick == 14 and self.threads:
            self.line(f"h = run {self.random.choice(self.threads)}()")
        elif pick == 15:
            self.line(
                f"{self.random.choice(['kill', 'join'])} {'h' if self.sane else self.random.choice(names)}"
            )
        elif pick == 16:
            self.line(self.random.choice(["enter_critical", "exit_critical"]))
        elif pick == 17 and loop:
            self.line(self.random.choice(["break", "continue"]))
        elif pick == 18 and self.random.random() < 0.3:
            self.line(self.random.choice(["halt", "return", f"return {self.expression(names)}"]))
        else:
            self.line(
                self.random.choice(["pass", f"movej({self.expression(names)}, a=1.0)", self.call(names, 1)])
            )

    def assign(self, names):
        name = self.random.choice([*names, "x", "y"])
        if self.sane and self.random.random() < 0.2:
            self.line(f"l[{self.random.randrange(3)}] = {self.expression(names)}")
            return
        if not self.sane and name in names and self.random.random() < 0.4:
            self.line(f"{name}[{self.expression(names)}] = {self.expression(names)}")
            return
        qualifier = self.random.choice(["", "", "global ", "local "])
        self.line(f"{qualifier}{name} = {self.expression(names)}")
        if name not in names:
            names.append(name)

    def expression(self, names, depth=0):
        pick = self.random.randrange(12)
        if depth > 2 or pick < 5:
            return self.atom(names)
        if self.sane:
            return self.number(names, depth, pick)
        inner = [self.expression(names, depth + 1) for _ in range(2)]
        if pick < 8:
            return (
                f"({inner[0]} {self.random.choice(OPERATORS)}{self.random.choice([' ', chr(10)])}{inner[1]})"
            )
        if pick == 8:
            return f"({self.random.choice(['-', 'not '])}({inner[0]}))"
        if pick == 9:
            return f"[{', '.join(inner)}]"
        if pick == 10:
            return (
                f"({inner[0]})[{inner[1]}]" if self.random.random() < 0.8 else f"({inner[0]})[{inner[1]}, 0]"
            )
        return self.call(names, depth + 1)

    def number(self, names, depth, pick):
        left, right = self.expression(names, depth + 1), self.expression(names, depth + 1)
        if pick < 7:
            return f"({left} {self.random.choice('+-*')} {right})"
        if pick < 9:
            return f"get_list_length([{left} {self.random.choice(OPERATORS[5:])} {right}])"
        if pick == 9:
            return f"l[{self.random.randrange(3)}]"
        if pick == 10:
            return f"norm([{left}, {right}])"
        return self.call(names, depth) if depth < 2 else f"atan2({left}, {right})"

    def call(self, names, depth):
        choices = [("norm", 1), ("atan2", 2), *self.functions] if self.sane else [*PURE, *self.functions]
        name, count = self.random.choice(choices)
        return f"{name}({', '.join(self.expression(names, depth + 1) for _ in range(count))})"

    def atom(self, names):
        pick = self.random.randrange(6)
        if pick < 3 and names:
            return self.random.choice(names)
        if self.sane:
            return self.random.choice(NUMBERS)
        if pick == 3:
            return self.random.choice(TEXTS)
        if pick == 4:
            return self.random.choice(
                ["True", "False", "None", "[1, 2, 3]", "[[1, 2], [3, 4]]", "[]", "p[1, 2, 3, 0, 0, 1]"]
            )
        return self.random.choice(NUMBERS)


def valid(seed):
    """A program that can be compiled."""
    return Writer(seed).program()


def spoilt(seed):
    """A program that has lost, doubled or changed some of its text, or is no text at all."""
    dice = random.Random(seed)
    text = valid(seed)
    kind = dice.randrange(8)
    if kind == 0:
        return text[: dice.randrange(len(text))]
    if kind == 1:
        return "".join(
            chr(dice.choice([dice.randrange(256), dice.randrange(32, 127)]))
            for _ in range(dice.randrange(200))
        )
    if kind > 5:
        return re.sub(
            r"\b\d+\b",
            lambda found: dice.choice([found[0], found[0], "None", '"a"', "[0]", "-1", "g1"]),
            text,
        )
    for _ in range(dice.randrange(1, 4)):
        place = dice.randrange(len(text))
        other = dice.randrange(len(text))
        if kind == 2:
            text = text[:place] + dice.choice('()[]:,=+-*/%<>!"#.\n \t{}\\é7ap') + text[place + 1 :]
        elif kind == 3:
            text = text[:place] + text[place + dice.randrange(1, 20) :]
        elif kind == 4:
            text = text[:place] + text[other : other + dice.randrange(1, 60)] + text[place:]
        else:
            words = text.split(" ")
            words[dice.randrange(len(words))] = dice.choice(
                ["end", "def", "if", "run", "kill", "not", "p", "9", "thread", "="]
            )
            text = " ".join(words)
        text = text or "\n"
    return text
