"""What a robot's dashboard server answers; robots whose software has none, or lacks a question, leave it open."""

from collections.abc import Sequence

from tvist_protocol.errors import short
from tvist_server.moving.dialogue import NoAnswerError, ask
from tvist_server.watching.place import Place

PORT = 29999
"""Its port on a robot of UR's."""
_UNKNOWN = "could not understand"


def asked(place: Place, questions: Sequence[str]) -> dict[str, str]:
    """Return the answers by question; those that it does not understand are left out, all if there is no dashboard."""
    text = "".join(f"{question}\n" for question in (*questions, "quit")).encode()

    def answers(heard: bytes) -> dict[str, str] | None:
        # Without the greeting, and what is incomplete.
        lines = heard.decode(errors="replace").split("\n")[1:-1]
        if len(lines) < len(questions):
            return None
        found = zip(questions, lines, strict=False)
        return {question: short(line.strip()) for question, line in found if _UNKNOWN not in line}

    try:
        return ask(place.beside(PORT), text, answers)
    except NoAnswerError:
        return {}
