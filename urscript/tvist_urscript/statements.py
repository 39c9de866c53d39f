"""Translate statements of a script to Python's, which also charge their costs to the budget."""

import ast
from itertools import count

from tvist_urscript import tree
from tvist_urscript.errors import syntax_error
from tvist_urscript.expressions import MOST_OPERATIONS, START, Expressions, Report, first
from tvist_urscript.names import BUILT_IN_ARRAYS
from tvist_urscript.pieces import LOAD, assign, branch, call, charge, located, name
from tvist_urscript.signatures import Signatures

PIECE = 40  # evaluations after which code without loops checks whether the budget is spent
MOST_LOOPS = 15  # most nested loops: CPython allows 20 nested blocks
LINK = 15
"""Most branches per Python `if`; longer chains are split, as Python nests each `elif` in the previous one."""

Branch = tuple[tree.Expression, list[tree.Statement]]
Link = tuple[tree.Node, ast.expr, list[ast.stmt]]


class Statements(Expressions):
    """Translates statements."""

    def __init__(self, signatures: Signatures, report: Report, warn: Report) -> None:
        super().__init__(signatures, report, warn)
        self.globals: set[str] = set()  # global variables that the present function sets
        self.loops = 0  # number of loops around the present statement
        # Whether the statement is in a part of a long main function; a part returns True after a `return`.
        self.is_part = False
        self.temporary = count()

    def block(self, body: list[tree.Statement], since: int, cost: int = 0) -> tuple[list[ast.stmt], int]:
        """Translate statements; return them and the most evaluations from the last budget check to their end.

        `since` is this number at their beginning; `cost` is the cost of code before them, such as conditions,
        that is not charged yet.
        """
        result: list[ast.stmt] = []
        piece: list[ast.stmt] = []

        def flush(at: tree.Node) -> None:
            nonlocal cost, since
            since += cost
            result.extend(located(made, at) for made in charge(cost, check=since >= PIECE))
            since = 0 if since >= PIECE else since
            result.extend(piece)
            cost = 0
            piece.clear()

        for statement in body:
            self.cost, self.works = 1, False
            match statement:
                case tree.Function():
                    continue
                case tree.If():
                    test = self.test(statement.branches[0][0])
                    cost += self.limited(statement)
                    flush(statement)
                    since += PIECE * self.works
                    links, since = self.branches(statement, test, since)
                    result.extend(located(made, statement) for made in links)
                case tree.While():
                    test = self.test(statement.condition)
                    turn = self.limited(statement)
                    cost += turn
                    flush(statement)
                    result.append(located(self.loop(statement, test, turn), statement))
                    since += PIECE
                case _:
                    made = self.simple(statement)
                    spent = self.limited(statement)
                    works = self.works
                    if cost + spent > PIECE:
                        flush(statement)
                    cost += spent
                    piece.extend(located(one, statement) for one in made)
                    if works:
                        flush(statement)
                        since += PIECE
        if cost:
            flush(body[-1] if body else tree.Node(1, 1))
        return result, since

    def limited(self, statement: tree.Statement) -> int:
        """Return the cost of the present statement; report an error if it exceeds MOST_OPERATIONS."""
        if self.cost > MOST_OPERATIONS:
            self.report(
                statement,
                f"a statement of {self.cost} operations is too long: the limit is {MOST_OPERATIONS}",
            )
        return self.cost

    def branches(self, statement: tree.If, test: ast.expr, since: int) -> tuple[list[ast.stmt], int]:
        """Translate the branches of an `if`, whose first condition `test` is charged already; see `block`.

        Each branch charges the other conditions that are evaluated before it.
        """
        chains = [
            statement.branches[start : start + LINK] for start in range(0, len(statement.branches), LINK)
        ]
        if len(chains) == 1:
            links, cost, latest, since = self.links(statement, chains[0], test, since, 0)
            otherwise, ends = self.block(statement.otherwise, since, cost)
            return _chained(links, otherwise), max(latest, ends)
        # Python limits the depth to which `elif` nest, so a variable records that no branch has been taken yet.
        searching = f"t{next(self.temporary)}"
        result: list[ast.stmt] = [assign(searching, ast.Constant(True))]
        latest, cost = since, 0
        for chain in chains:
            before: list[ast.stmt] = []
            if chain is not chains[0]:
                self.cost = 1
                test = self.test(chain[0][0])
                before = charge(cost + self.limited(statement), check=True)
                since = cost = 0
            links, cost, ends, since = self.links(statement, chain, test, since, cost)
            latest = max(latest, ends)
            for _, _, body in links:
                body.insert(0, assign(searching, ast.Constant(False)))
            made = _chained(links, [])
            result += [branch(name(searching), [*before, *made])] if before else made
        otherwise, ends = self.block(statement.otherwise, since, cost)
        if otherwise:
            result.append(branch(name(searching), otherwise))
        return result, max(latest, ends)

    def links(
        self, statement: tree.If, chain: list[Branch], test: ast.expr, since: int, cost: int
    ) -> tuple[list[Link], int, int, int]:
        """Translate one chain of branches (see LINK), whose first condition `test` is charged already.

        Return the branches; the cost to charge if no branch is taken; and `since` (see `block`) after the
        chain: its largest value if a branch is taken, and its value if none is.
        """
        links: list[Link] = []
        latest = since
        for condition, body in chain:
            if links:
                self.cost, self.works = 1, False
                test = self.test(condition)
                cost += self.limited(statement)
                since += PIECE * self.works
            made, ends = self.block(body, since, cost)
            latest = max(latest, ends)
            links.append((first(condition), test, made))
        return links, cost, latest, since

    def loop(self, statement: tree.While, test: ast.expr, cost: int) -> ast.stmt:
        """Translate a loop, which checks the budget at the start of each iteration."""
        self.loops += 1
        if self.loops > MOST_LOOPS:
            self.report(statement, f"more than {MOST_LOOPS} loops are nested here")
        body, _ = self.block(statement.body, 0)
        self.loops -= 1
        return ast.While(test, [*charge(cost, check=True), *body], [])

    def simple(self, statement: tree.Statement) -> list[ast.stmt]:  # noqa: C901, PLR0911  one for each kind
        """Translate a statement that contains no others."""
        match statement:
            case tree.Assign():
                return [self.assign(statement)]
            case tree.Evaluate():
                return [ast.Expr(self.value(statement.value))]
            case tree.Return():
                value = ast.Constant(None) if statement.value is None else self.value(statement.value)
                return (
                    [ast.Expr(value), ast.Return(ast.Constant(True))] if self.is_part else [ast.Return(value)]
                )
            case tree.Handle(word="kill"):
                self.cost += START
                return [ast.Expr(call("kill", self.value(statement.value)))]
            case tree.Handle():
                return [ast.Expr(ast.YieldFrom(call("join", self.value(statement.value))))]
            case tree.Word(word="pass"):
                return []
            case tree.Word(word="break" | "continue"):
                if not self.loops:
                    why = syntax_error(statement.line, f"{statement.word} is outside of a loop")
                    self.report(statement, why)
                return [ast.Break() if statement.word == "break" else ast.Continue()]
            case tree.Word(word="enter_critical"):
                return [ast.Expr(ast.YieldFrom(call("enter_critical")))]
            case tree.Word():
                return [ast.Expr(call(statement.word))]
            case tree.Label():
                return [ast.Expr(call("label", ast.Constant(statement.number), ast.Constant(statement.name)))]
            case _:
                raise AssertionError(statement)

    def assign(self, statement: tree.Assign) -> ast.stmt:
        """Translate an assignment; its value is computed before the target is read or declared."""
        target, indices = statement.target.name, statement.indices
        plain = [index for index in indices if not isinstance(index, tree.Step)]
        if indices and len(plain) == len(indices) and self.built_in_array(statement.target):
            setter = BUILT_IN_ARRAYS[target][1]
            if not setter:
                self.report(statement, f"{target} cannot be assigned")
                return ast.Pass()
            return ast.Expr(self.call_built_in(statement, setter, [*plain, statement.value]))
        value = self.value(statement.value)
        if indices:
            self.cost += len(indices)
            self.works = True
            places: list[ast.expr] = [
                # A tuple marks a member, since no value of a script is a tuple.
                ast.Tuple([ast.Constant(index.name)], LOAD)
                if isinstance(index, tree.Step)
                else self.value(index)
                for index in indices
            ]
            value = call("replaced", value, ast.Tuple(places, LOAD), self.name(statement.target))
            value = located(value, first(indices[0]))
            variable = self.scope.variable(target)
        else:
            variable = self.scope.declare(target, statement.qualifier)
        if variable == "global":
            self.globals.add(f"g_{target}")
        return assign(f"g_{target}" if variable == "global" else f"v_{target}", value)


def _chained(links: list[Link], otherwise: list[ast.stmt]) -> list[ast.stmt]:
    for at, test, body in reversed(links):
        otherwise = [located(branch(test, body, otherwise), at)]
    return otherwise
