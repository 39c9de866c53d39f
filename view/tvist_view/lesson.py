"""The lesson: one mass on a spring and two impulses, then the same on the UR5e."""

import asyncio
from collections.abc import Awaitable, Callable
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from viser import ClientHandle, GuiApi, GuiUplotHandle, ViserServer, uplot

from tvist_protocol.geometry import Geometry
from tvist_protocol.values import Payload
from tvist_view.chain import Chain, Floats
from tvist_view.deflection import Magnification
from tvist_view.drawn_arm import DrawnArm
from tvist_view.oscillator import LENGTH_S, STEP, TURN, Swing, impulses_in_words, leftover, leftovers, swing
from tvist_view.pictures import FRAME_S, pictures
from tvist_view.stage import look_at
from tvist_view.track import Track

SLOW = 0.25
"""Speed of what is shown, to simulation time: an eye follows a swing of a few hertz [-]."""
ORANGE, BLUE = (213, 94, 0), (0, 114, 178)
ERRORS = np.linspace(-0.5, 0.5, 101)
"""Errors of the believed frequency over which the curve of what is left is drawn [-]."""
APART = 0.45
"""Distance of the two arms from the middle [m]."""
MAGNIFIED = 20.0
"""Factor by which the deflection of the one mass is drawn larger [-]."""
UR5E_MAGNIFIED = 100.0

ONE_MASS = """
### One mass on a spring
An arm that turns and stops swings on, like a mass on a spring: **orange**. The **blue** arm makes the same motion in
two parts, half of it at once, half of it half a swing later. The second half swings against the first, and nothing is
left.

That takes the right frequency. Give the shaper a wrong one, and see what stays.
"""
UR5E = """
### The UR5e
It has six joints and its frequency changes with its pose, but where it stops, its lowest mode is a mass on a spring,
too. Press the button: the arm makes one motion unshaped (**orange**) and with the two impulses for the frequency that
you choose (**blue**). Bending is drawn 100 times larger.
"""


@dataclass(frozen=True)
class OneMass:
    """The arm with one flexible joint."""

    geometry: Geometry
    payload: Payload
    f_d_range: tuple[float, float]
    """Frequencies that its elbow can give it [Hz]."""
    elbow: Callable[[float], float]
    """Angle of the elbow [rad] for a frequency [Hz]."""


@dataclass(frozen=True)
class Compared:
    """One motion of the UR5e, unshaped and shaped."""

    unshaped: Track
    shaped: Track
    f_d: float
    """Frequency that the shaper was designed for [Hz]."""
    left: tuple[float, float]
    """Largest acceleration of the tool after the stop, unshaped and shaped [m/s²]."""


Run = Callable[[float, float], Awaitable[Compared]]
"""Makes the motion of the UR5e for an error of the frequency [-] and a damping ratio [-]."""


async def show_lesson(server: ViserServer, one_mass: OneMass, run: Run) -> None:
    """Give every browser a lesson of its own until cancelled, so that a class can share one page.

    Args:
        server: Server of the page.
        one_mass: The arm with one flexible joint.
        run: Makes the UR5e's motion.
    """
    loop = asyncio.get_running_loop()
    lessons: dict[int, asyncio.Task[None]] = {}

    def begin(browser: ClientHandle) -> None:
        lessons[browser.client_id] = loop.create_task(LessonPage(browser, one_mass, run).run())

    def end(browser: ClientHandle) -> None:
        lesson = lessons.pop(browser.client_id, None)
        if lesson is not None:
            lesson.cancel()

    look_at(server, (0.2, 0.0, 0.1), 1.3)
    # viser calls these from threads of its own.
    server.on_client_connect(lambda browser: _later(loop, begin, browser))
    server.on_client_disconnect(lambda browser: _later(loop, end, browser))
    await asyncio.Event().wait()


def _later(
    loop: asyncio.AbstractEventLoop, what: Callable[[ClientHandle], None], browser: ClientHandle
) -> None:
    with suppress(RuntimeError):  # the page has ended
        loop.call_soon_threadsafe(what, browser)


class LessonPage:
    """The page of the lesson in one browser.

    Args:
        browser: The browser.
        one_mass: The arm with one flexible joint.
        run: Makes the UR5e's motion.
    """

    def __init__(self, browser: ClientHandle, one_mass: OneMass, run: Run) -> None:
        self._browser, self._one, self._run = browser, one_mass, run
        self._loop = asyncio.get_running_loop()
        self._chain = Chain(one_mass.geometry)
        self._arms = [self._arm(name, side) for name, side in (("unshaped", 1.0), ("shaped", -1.0))]
        self._compared: Compared | None = None
        self._ur5es: list[DrawnArm] = []
        gui = browser.gui
        low, high = one_mass.f_d_range
        tabs = gui.add_tab_group()
        with tabs.add_tab("One mass"):
            gui.add_markdown(ONE_MASS)
            self._f_d = gui.add_slider(
                "frequency Hz", round(low, 2), round(high, 2), 0.01, round((low + high) / 2, 2),
                hint="The elbow gives it: stretched out the arm is heavy and slow, folded it is light and quick.",
            )  # fmt: skip
            self._zeta = gui.add_slider(
                "damping ζ", 0.0, 0.3, 0.005, 0.03, hint="How soon it stops by itself."
            )
            self._error = gui.add_slider(
                "error %",
                -50.0,
                50.0,
                1.0,
                0.0,
                hint="How wrong the frequency is that the shaper believes in.",
            )
            self._words = gui.add_markdown("")
            self._swings = _plot(gui, "deflection [mrad] over time [s]", 3)
            self._curve = _plot(gui, "what two impulses leave [%], over their error [%]", 3)
            for slider in (self._f_d, self._zeta, self._error):
                slider.on_update(lambda _: self._soon(self._compute))
        with tabs.add_tab("UR5e"):
            gui.add_markdown(UR5E)
            self._arm_error = gui.add_slider("error %", -50.0, 50.0, 1.0, 0.0)
            self._arm_zeta = gui.add_slider("damping ζ believed", 0.0, 0.6, 0.01, 0.34)
            self._go = gui.add_button("Move the UR5e", color="blue")
            self._go.on_click(lambda _: self._soon(self._start))
            self._back = gui.add_button("Back to the one mass", visible=False)
            self._back.on_click(lambda _: self._soon(self._forget))
            self._arm_words = gui.add_markdown("")
            self._arm_plot = _plot(gui, "|α| of the tool [m/s²] over time [s], around the stop", 3)
        self._both: tuple[Swing, Swing] = self._compute()
        self._task: asyncio.Task[None] | None = None

    def _soon(self, what: Callable[[], object]) -> None:
        """Do something in the page's loop; from any thread."""
        self._loop.call_soon_threadsafe(what)

    async def run(self) -> None:
        """Show it until cancelled, over and over."""
        time = 0.0
        async for _ in pictures():
            self.show(time)
            time += SLOW * FRAME_S
            if time >= self._length():
                time = 0.0

    def show(self, time: float) -> None:
        """Draw a time since the beginning of the motion [s]."""
        with self._browser.atomic():
            if self._compared is None:
                elbow, place = (
                    self._one.elbow(float(self._f_d.value)),
                    min(round(time / STEP), len(self._both[0].time) - 1),
                )
                for arm, one in zip(self._arms, self._both, strict=True):
                    angle = one.reference[place] - TURN / 2 + MAGNIFIED * one.deflection[place]
                    arm.move(np.array([angle, elbow]), np.zeros(0))
            else:
                tracks = (self._compared.unshaped, self._compared.shaped)
                for arm, track in zip(self._ur5es, tracks, strict=True):
                    truth = track.at(_beginning(self._compared) + time).truth
                    if truth is not None:
                        arm.move(*Magnification(UR5E_MAGNIFIED).drawn(truth))

    def _length(self) -> float:
        return (
            LENGTH_S if self._compared is None else self._compared.unshaped.end - _beginning(self._compared)
        )

    def _arm(self, name: str, side: float) -> DrawnArm:
        return DrawnArm(
            self._browser.scene,
            f"/{name}",
            self._chain,
            payload=self._one.payload,
            payload_radius=self._one.geometry.payload_radius,
            at=(0.0, side * APART, 0.0),
            colour=ORANGE if name == "unshaped" else BLUE,
        )

    def _compute(self) -> tuple[Swing, Swing]:
        f_d, zeta = float(self._f_d.value), float(self._zeta.value)
        believed = (f_d * (1.0 + float(self._error.value) / 100.0), zeta)
        unshaped, shaped = self._both = swing(f_d, zeta, None), swing(f_d, zeta, believed)
        share = leftover(f_d, zeta, believed)
        self._words.content = (
            f"{impulses_in_words(*believed)} They are right for {believed[0]:.2f} Hz; the arm swings with "
            f"{f_d:.2f} Hz. **{100 * share:.0f} %** of the vibration is left: {1e3 * shaped.left:.1f} of "
            f"{1e3 * unshaped.left:.1f} mrad."
        )
        self._swings.data = (unshaped.time, 1e3 * unshaped.deflection, 1e3 * shaped.deflection)
        marker = np.where(np.abs(ERRORS - float(self._error.value) / 100.0) < 0.006, 100.0 * share, 0.0)
        self._curve.data = (100.0 * ERRORS, marker, 100.0 * leftovers(f_d, zeta, ERRORS))
        return self._both

    def _start(self) -> None:
        if self._task is None or self._task.done():
            self._task = self._loop.create_task(self._move())

    async def _move(self) -> None:
        self._go.disabled, self._go.label = True, "The UR5e moves …"
        try:
            done = await self._run(float(self._arm_error.value) / 100.0, float(self._arm_zeta.value))
        finally:
            self._go.disabled, self._go.label = False, "Move the UR5e"
        self._draw(done)
        unshaped, shaped = done.left
        self._arm_words.content = (
            f"{impulses_in_words(done.f_d, float(self._arm_zeta.value))} They are right for {done.f_d:.2f} Hz. After "
            f"the stop the tool shook with {unshaped:.2f} m/s², shaped with {shaped:.2f}: "
            f"**{100 * shaped / unshaped:.0f} %** is left."
        )
        begin, end = _stop(done) - 0.1, _stop(done) + 0.6
        signals = [track.signals.between(begin, end) for track in (done.unshaped, done.shaped)]
        rest = [
            np.where(one.time > _stop(done), one.alpha, np.minimum(one.alpha, 1.3 * unshaped))
            for one in signals
        ]
        self._arm_plot.data = (signals[0].time - _stop(done), *rest)

    def _draw(self, done: Compared) -> None:
        """The UR5es in place of the one-joint arms."""
        for arm in self._arms:
            arm.show(visible=False)
        if not self._ur5es:
            for name, side, colour in (("a", 1.0, ORANGE), ("b", -1.0, BLUE)):
                shown = done.unshaped.shown
                self._ur5es.append(
                    DrawnArm(
                        self._browser.scene,
                        f"/ur5e_{name}",
                        Chain(shown.geometry),
                        payload=shown.payload,
                        payload_radius=shown.geometry.payload_radius,
                        at=(0.0, side * APART, 0.0),
                        colour=colour,
                    )
                )
        for arm in self._ur5es:
            arm.show(visible=True)
        self._compared, self._back.visible = done, True

    def _forget(self) -> None:
        self._compared, self._back.visible = None, False
        for arm in self._ur5es:
            arm.show(visible=False)
        for arm in self._arms:
            arm.show(visible=True)


def _beginning(done: Compared) -> float:
    """Time shortly before the motion begins [s]."""
    moving = np.flatnonzero(done.unshaped.signals.unshaped > 1e-3)
    return float(done.unshaped.signals.time[moving[0]]) - 0.05


def _stop(done: Compared) -> float:
    """Time at which the unshaped reference comes to rest [s]."""
    moving = np.flatnonzero(done.unshaped.signals.unshaped > 1e-3)
    return float(done.unshaped.signals.time[moving[-1]])


def largest_after_stop(track: Track) -> float:
    """Largest acceleration of the tool once the shaped reference has come to rest [m/s²]."""
    signals = track.signals
    moving = np.flatnonzero(signals.acceleration > 1e-3)
    return float(signals.alpha[moving[-1] + 5 :].max(initial=0.0))


def _plot(gui: GuiApi, title: str, columns: int) -> GuiUplotHandle:
    colours = ("#D55E00", "#0072B2")
    return gui.add_uplot(
        tuple(np.zeros(2) for _ in range(columns)),
        (
            uplot.Series(label=""),
            *(uplot.Series(label=colour, stroke=colour, width=1.5) for colour in colours),
        ),
        title=title,
        scales={"x": uplot.Scale(time=False), "y": uplot.Scale(auto=True)},
        legend=uplot.Legend(show=False),
        height=150,
    )


def frequency_to_elbow(f_d: Callable[[float], float], low: float, high: float) -> Callable[[float], float]:
    """The inverse of a frequency that rises with the elbow's angle, by interpolation.

    Args:
        f_d: Frequency at an angle [Hz].
        low: Smallest angle [rad].
        high: Largest angle [rad].
    """
    angles: Floats = np.linspace(low, high, 400)
    frequencies = [f_d(float(angle)) for angle in angles]
    return lambda wanted: float(np.interp(wanted, frequencies, angles))
