"""Translate statements of a script to Python's, which also charge their costs to the budget."""

import ast
from itertools import count

from tvist_urscript import tree
from tvist_urscript.errors import syntax_error
from tvist_urscript.expressions import MOST_OPERATIONS, START, Expressions, Report, first
from tvist_urscript.names import BUILT_IN_ARRAYS
from tvist_urscript.pieces import AstBuilder
from tvist_urscript.signatures import Signatures

PIECE = 40
"""Evaluations after which code without loops checks whether the budget is spent."""
MOST_LOOPS = 15
"""Most nested loops: CPython allows 20 nested blocks."""
LINK = 15
"""Most branches of one Python `if`; a longer `elif` chain is split, since Python nests each in the one before."""

Branch = tuple[tree.Expression, list[tree.Statement]]
Link = tuple[AstBuilder, ast.expr, list[ast.stmt]]


class Statements(Expressions):
    """Translates statements."""

    def __init__(self, signatures: Signatures, report: Report) -> None:
        super().__init__(signatures, report)
        self.loops = 0  # number of loops around the present statement
        # Whether the statement is in a part of a long main function, which returns True after a `return`.
        self.is_part = False
        self.temporary = count()

    def block(self, body: list[tree.Statement], since: int, cost: int = 0) -> tuple[list[ast.stmt], int]:
        """Translate statements; return them and the most evaluations since the budget was last checked.

        Before them this number is `since`; `cost` is the cost of code before them, such as conditions, not
        yet charged.
        """
        result: list[ast.stmt] = []
        piece: list[ast.stmt] = []

        def flush(at: AstBuilder) -> None:
            nonlocal cost, since
            since += cost
            result.extend(at.charge(cost, check=since >= PIECE))
            since = 0 if since >= PIECE else since
            result.extend(piece)
            cost = 0
            piece.clear()

        for statement in body:
            at = AstBuilder.of(statement)
            self.cost, self.works = 1, False
            match statement:
                case tree.Function():
                    continue
                case tree.If():
                    test = self.test(statement.branches[0][0])
                    cost += self.limited(statement)
                    flush(at)
                    since += PIECE * self.works
                    links, since = self.branches(statement, test, since)
                    result.extend(links)
                case tree.While():
                    test = self.test(statement.condition)
                    turn = self.limited(statement)
                    cost += turn
                    flush(at)
                    result.append(self.loop(statement, test, turn))
                    since += PIECE
                case _:
                    made = self.simple(statement, at)
                    spent = self.limited(statement)
                    works = self.works
                    if cost + spent > PIECE:
                        flush(at)
                    cost += spent
                    piece.extend(made)
                    if works:
                        flush(at)
                        since += PIECE
        if cost:
            flush(AstBuilder.of(body[-1]) if body else AstBuilder(1, 1))
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
        """Translate the branches of an `if`, whose first condition is charged already; see `block`.

        Each branch charges the conditions evaluated before it.
        """
        at = AstBuilder.of(statement)
        chains = [
            statement.branches[start : start + LINK] for start in range(0, len(statement.branches), LINK)
        ]
        if len(chains) == 1:
            links, cost, latest, since = self.links(statement, chains[0], test, since, 0)
            otherwise, ends = self.block(statement.otherwise, since, cost)
            return _chained(links, otherwise), max(latest, ends)
        # Python limits the depth to which `elif` nest, so a variable records that no branch has been taken yet.
        searching = f"t{next(self.temporary)}"
        result: list[ast.stmt] = [at.assign(searching, at.constant(True))]
        latest, cost = since, 0
        for chain in chains:
            before: list[ast.stmt] = []
            if chain is not chains[0]:
                self.cost = 1
                test = self.test(chain[0][0])
                before = at.charge(cost + self.limited(statement), check=True)
                since = cost = 0
            links, cost, ends, since = self.links(statement, chain, test, since, cost)
            latest = max(latest, ends)
            for here, _, body in links:
                body.insert(0, here.assign(searching, here.constant(False)))
            made = _chained(links, [])
            result += [at.branch(at.name(searching), [*before, *made])] if before else made
        otherwise, ends = self.block(statement.otherwise, since, cost)
        if otherwise:
            result.append(at.branch(at.name(searching), otherwise))
        return result, max(latest, ends)

    def links(
        self, statement: tree.If, chain: list[Branch], test: ast.expr, since: int, cost: int
    ) -> tuple[list[Link], int, int, int]:
        """Translate one chain of branches (see LINK), whose first condition is charged already.

        Return them, the cost to charge if none is taken, the largest `since` at the end of any, and that if
        none is taken.
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
            links.append((AstBuilder(*first(condition)), test, made))
        return links, cost, latest, since

    def loop(self, statement: tree.While, test: ast.expr, cost: int) -> ast.stmt:
        """Translate a loop, which checks the budget at the start of each iteration."""
        at = AstBuilder.of(statement)
        self.loops += 1
        if self.loops > MOST_LOOPS:
            self.report(statement, f"more than {MOST_LOOPS} loops are nested here")
        body, _ = self.block(statement.body, 0)
        self.loops -= 1
        return ast.While(test, [*at.charge(cost, check=True), *body], [], **at.given)

    def simple(self, statement: tree.Statement, at: AstBuilder) -> list[ast.stmt]:  # noqa: PLR0911  one for each kind
        """Translate a statement that contains no others."""
        match statement:
            case tree.Assign():
                return [self.assign(statement, at)]
            case tree.Evaluate():
                return [at.statement(self.value(statement.value))]
            case tree.Return():
                value = at.constant(None) if statement.value is None else self.value(statement.value)
                return [
                    *([at.statement(value)] if self.is_part else []),
                    ast.Return(at.constant(True) if self.is_part else value, **at.given),
                ]
            case tree.Handle(word="kill"):
                self.cost += START
                return [at.statement(at.call("kill", self.value(statement.value)))]
            case tree.Handle():
                return [at.statement(at.waiting(at.call("join", self.value(statement.value))))]
            case tree.Word():
                return self.word(statement, at)
            case tree.Label():
                what = at.call("label", at.constant(statement.number), at.constant(statement.name))
                return [at.statement(what)]
            case _:
                raise AssertionError(statement)

    def word(self, statement: tree.Word, at: AstBuilder) -> list[ast.stmt]:
        """Translate a statement that consists of a keyword, such as `break`."""
        match statement.word:
            case "pass":
                return []
            case "break" | "continue":
                if not self.loops:
                    self.report(
                        statement, syntax_error(statement.line, f"{statement.word} is outside of a loop")
                    )
                return [ast.Break(**at.given) if statement.word == "break" else ast.Continue(**at.given)]
            case "enter_critical":
                return [at.statement(at.waiting(at.call("enter_critical")))]
            case _:
                return [at.statement(at.call(statement.word))]

    def assign(self, statement: tree.Assign, at: AstBuilder) -> ast.stmt:
        """Translate an assignment; the value is computed before the variable is read or declared."""
        name, indices = statement.target.name, statement.indices
        plain = [index for index in indices if not isinstance(index, tree.Step)]
        if indices and len(plain) == len(indices) and self.built_in_array(statement.target):
            setter = BUILT_IN_ARRAYS[name][1]
            if not setter:
                self.report(statement, f"{name} cannot be assigned")
                return at.statement(at.constant(None))
            return at.statement(self.call_built_in(statement, setter, [*plain, statement.value]))
        value = self.value(statement.value)
        if indices:
            here = AstBuilder(*first(indices[0]))
            self.cost += len(indices)
            self.works = True
            places = at.tuple(
                [
                    # A tuple marks a member, since no value of a script is one.
                    at.tuple([at.constant(index.name)]) if isinstance(index, tree.Step) else self.value(index)
                    for index in indices
                ]
            )
            value = here.call("replaced", value, places, self.name(statement.target))
            variable = self.scope.variable(name)
        else:
            variable = self.scope.declare(name, statement.qualifier)
        if variable == "global":
            self.globals.add(f"g_{name}")
            return at.assign(f"g_{name}", value)
        return at.assign(f"v_{name}", value)


def _chained(links: list[Link], otherwise: list[ast.stmt]) -> list[ast.stmt]:
    for at, test, body in reversed(links):
        otherwise = [at.branch(test, body, otherwise)]
    return otherwise
