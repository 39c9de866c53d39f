"""What is drawn and how: magnification, ghost and trace, chosen on the page for everybody who looks at it."""

from viser import GuiApi

from tvist_view.deflection import MAX_FACTOR, Magnification

FACTORS = (1, 3, 10, 30, 100, 300)


class Appearance:
    """The choices at the head of the page.

    Args:
        gui: Where they are added.
        truth: Whether the deflections are known; otherwise a sentence says how to have them.
        why_not: That sentence.
        factor: Magnification to begin with.
        ghost: Whether there is an unshaped reference to show.
    """

    def __init__(
        self, gui: GuiApi, *, truth: bool, why_not: str = "", factor: float = 1.0, ghost: bool = True
    ) -> None:
        self._factor = gui.add_slider(
            "bending ×",
            min=1.0,
            max=MAX_FACTOR,
            step=1.0,
            initial_value=factor if truth else 1.0,
            marks=tuple((float(mark), str(mark)) for mark in FACTORS if mark in (1, 100, 300)),
            disabled=not truth,
            hint="Gears twist and links bend by some milliradians: draw that so many times larger.",
        )
        self._gravity = gui.add_checkbox(
            "with gravity",
            initial_value=False,
            disabled=not truth,
            hint="Magnify what the arm hangs through by its own weight, too; otherwise the vibration alone.",
        )
        self._ghost = gui.add_checkbox(
            "ghost",
            initial_value=ghost,
            visible=ghost,
            hint="The grey arm is where the motion would be without the shaper, and without bending.",
        )
        self._trace = gui.add_checkbox(
            "trace", initial_value=True, hint="The way of the tool in the last seconds."
        )
        self._words = gui.add_markdown("" if truth else why_not)

    @property
    def magnification(self) -> Magnification:
        """How deflections are drawn."""
        return Magnification(float(self._factor.value), bool(self._gravity.value))

    @property
    def ghost(self) -> bool:
        """Whether to draw the ghost."""
        return bool(self._ghost.value)

    @property
    def trace(self) -> bool:
        """Whether to draw the trace."""
        return bool(self._trace.value)

    def truth_has_come(self, factor: float) -> None:
        """The deflections are known after all: magnify them by a factor."""
        self._factor.disabled = self._gravity.disabled = False
        self._factor.value = factor  # type: ignore[misc]  # viser has a setter, its annotations do not
        self._words.content = ""
