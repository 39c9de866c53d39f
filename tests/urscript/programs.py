"""Random programs: valid ones from a grammar, and texts that have been spoilt."""

import random
import re

GLOBALS = ["g0", "g1", "g2", "time", "p"]
NUMBERS = ["0", "1", "2", "3", "-1", "0.5", "1e-3", "2147483647", "1e300", "7"]
OTHERS = ['""', '"a"', "True", "None", "[1, 2, 3]", "[[1, 2], [3, 4]]", "[]", "p[1, 2, 3, 0, 0, 1]"]
ONE, TWO = "({expression})", "({expression}, {expression})"
CALLS = [
    *(f"{name}{ONE}" for name in ("sin", "sqrt", "norm", "floor", "to_str", "length", "pose_inv", "get_list_length",
                                  "integer_to_binary_list", "inv", "transpose", "size", "to_num")),
    *(f"{name}{TWO}" for name in ("pow", "str_cat", "pose_trans", "make_list", "str_sub", "atan2")),
    "interpolate_pose({expression}, {expression}, {expression})",
]  # fmt: skip
OWN_CALLS = ["f0()", f"f1{ONE}", f"f2{ONE}", f"f2{TWO}"]
ANY = {
    "statement": {
        "{assignment}": 50, f"textmsg{TWO}": 30, "if {expression}:\n{body}{branches}end": 30,
        "while {expression}:\n{body}{step}{leave}end": 20, "sync()": 10, "h = run t0()": 10, "kill {handle}": 5,
        "join {handle}": 5, "enter_critical": 5, "exit_critical": 5, "halt": 1, "return": 1,
        "return {expression}": 1, "pass": 8, "movej({expression}, a=1.0)": 3, "{call}": 3
    },
    "branches": {"": 6, "elif {expression}:\n{body}": 3, "elif {expression}:\n" * 17: 1, "else:\n{body}": 6},
    "step": {"sync()\n": 7, "": 3},
    "leave": {"": 4, "if {expression}:\nbreak\nend\n": 2, "if {expression}:\ncontinue\nend\n": 1, "break\n": 1},
    "handle": {"h": 1, "{name}": 1},
    "assignment": {
        "{name} = {expression}": 6, "global {name} = {expression}": 2, "local z = {expression}": 2,
        "{name}[{expression}] = {expression}": 4
    },
    "expression": {
        "{atom}": 5, "({expression} {operator} {expression})": 2, "({expression} {operator}\n{expression})": 1,
        "(-({expression}))": 1, "(not ({expression}))": 1, "[{expression}, {expression}]": 1,
        "({expression})[{expression}]": 1, "({expression})[{expression}, 0]": 0.3, "{call}": 1
    },
    "operator": dict.fromkeys(
        ["+", "-", "*", "/", "%", "==", "!=", "<", ">", "<=", ">=", "and", "or", "xor"], 1
    ),
    "call": dict.fromkeys([*CALLS, *OWN_CALLS], 1),
    "atom": {"{name}": 3, "{number}": 2, "{other}": 1},
    "number": dict.fromkeys(NUMBERS, 1),
    "other": dict.fromkeys(OTHERS, 1),
}  # fmt: skip
"""What may stand for a word, and how often."""
SANE = ANY | {
    "handle": {"h": 1},
    "assignment": {"{name} = {expression}": 8, "l[{place}] = {expression}": 2},
    "place": dict.fromkeys("012", 1),
    "expression": {
        "{atom}": 5, "({expression} {sign} {expression})": 2, "l[{place}]": 1, "norm([{expression}, {expression}])": 1,
        "get_list_length([{expression} {operator} {expression}])": 2, "{call}": 1
    },
    "sign": dict.fromkeys("+-*", 1),
    "operator": dict.fromkeys(["==", "!=", "<", ">", "<=", ">=", "and", "or", "xor"], 1),
    "call": dict.fromkeys([f"norm{ONE}", f"atan2{TWO}", *OWN_CALLS], 1),
    "atom": {"{name}": 3, "{number}": 3},
}  # fmt: skip
"""The same with values that fit, so that the program lives long."""


class Writer:
    """Writes a program whose names are all known. It may fail when it runs, and it may loop without end."""

    def __init__(self, seed):
        self.random = random.Random(seed)
        self.rules = SANE if self.random.random() < 0.7 else ANY
        self.names = GLOBALS

    def program(self):
        first = "{number}" if self.rules is SANE else "{atom}"
        heads = {"def f0()": [], "def f1(a0)": ["a0"], "def f2(a0, a1=1)": ["a0", "a1"], "thread t0()": []}
        lines = ["def program():", "global h = 0", "global l = [1, 2, 3]"]
        lines += [f"global {name} = {self.random.choice(NUMBERS)}" for name in GLOBALS]
        lines += [f"{name} = {self.filled(first, 9)}" for name in GLOBALS]
        for head, parameters in heads.items():
            self.names = [*GLOBALS, *parameters]
            lines += [f"{head}:", self.body(0, 3), "return 1", "end"]
        self.names = GLOBALS
        text = "\n".join([*lines, self.body(0, 8), "end"])
        return "".join(
            f"{self.pick(' ', '', chr(9))}{line}{self.pick('', '  # why')}\n" for line in text.split("\n")
        )

    def pick(self, *words):
        return self.random.choice(words)

    def body(self, depth, most):
        lines = [self.filled("{statement}", depth) for _ in range(self.random.randrange(most + 1))]
        return "".join(f"{line}\n" for line in lines)

    def filled(self, text, depth):
        """A text with something for each of its words; `depth` limits how deep it becomes."""
        return re.sub(r"\{(\w+)\}", lambda found: self.word(found[1], depth + 1), text)

    def word(self, word, depth):
        if word == "name":
            return self.random.choice(self.names)
        if word == "body":
            return self.body(depth + 1, 0 if depth > 8 else 3)
        if word == "expression" and depth > 9:
            word = "atom"
        rule = self.rules[word]
        (chosen,) = self.random.choices([*rule], rule.values())
        return self.filled(chosen, depth + (word == "expression"))


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
        count = dice.randrange(200)
        return "".join(chr(dice.choice([dice.randrange(256), dice.randrange(32, 127)])) for _ in range(count))
    if kind > 5:
        others = ["None", '"a"', "[0]", "-1", "g1"]
        return re.sub(r"\b\d+\b", lambda found: dice.choice([found[0], found[0], *others]), text)
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
