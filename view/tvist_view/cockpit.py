"""The controls of one tab: control of the robot, motions, jog, shaper, payload, speed and faults."""

from collections.abc import Callable, Coroutine
from typing import Any

from viser import GuiApi, GuiEvent

from tvist_client.arm import Arm
from tvist_protocol.faults import FAULTS
from tvist_protocol.info import Info
from tvist_view import pilot as piloting
from tvist_view.pilot import Doing, Pilot
from tvist_view.plain import plain

JOG_HZ = 20.0
"""How often a tab says that a jog button is still down [Hz]."""
Post = Callable[[Coroutine[Any, Any, Any]], None]


class Cockpit:
    """Controls of one tab; they are dead while the tab does not have control.

    Args:
        gui: The tab's own controls.
        tab: Number of the tab.
        pilot: Moves the robot.
        info: The robot as it is now.
        angles: Joint angles of the shaped reference now [rad]; None: not known yet.
        post: Runs a coroutine in the pilot's event loop, from any thread.
    """

    def __init__(
        self, gui: GuiApi, tab: int, pilot: Pilot, info: Info, angles: list[float] | None, post: Post
    ) -> None:
        self._gui, self._tab, self._pilot, self._post = gui, tab, pilot, post
        self._live: list[Any] = []  # controls that need control
        with gui.add_folder("Move the robot", order=100.0):
            self._who = gui.add_markdown("")
            self._take = gui.add_button("Take control", color="blue")
            self._take.on_click(lambda _: post(self._take_or_give()))
            self._motions(info)
            self._jog(info, angles or [0.0] * len(info.joints))
            self._settings(info)
            if "simulation.inject" in info.commands:
                self._faults()
        self.refresh(None)

    def refresh(self, control: str | None) -> None:
        """Show who has control now.

        Args:
            control: Client that has control; None: nobody.
        """
        mine = self._pilot.holder == self._tab
        if mine:
            words, label = "**This tab has control.**", "Give back control"
        elif self._pilot.holder is not None:
            words, label = "Another tab has control; this one watches.", "Take control"
        elif control is not None:
            words, label = f"Client **{plain(control)}** has control; this tab watches.", "Take control"
        else:
            words, label = "Nobody has control.", "Take control"
        if self._who.content != words:
            self._who.content = words
        if self._take.label != label:
            self._take.label = label
        for handle in self._live:
            if handle.disabled == mine:
                handle.disabled = not mine

    async def _take_or_give(self) -> None:
        if self._pilot.holder == self._tab:
            await self._pilot.give_back(self._tab)
        else:
            await self._pilot.take(self._tab)

    def _button(self, label: str, doing: Callable[[], Doing], hint: str | None = None) -> None:
        """A button for something that takes time, one at a time."""
        button = self._gui.add_button(label, hint=hint, disabled=True)
        button.on_click(lambda _: self._post(self._do(doing())))
        self._live.append(button)

    async def _do(self, doing: Doing) -> None:
        self._pilot.do(self._tab, doing)

    def _motions(self, info: Info) -> None:
        poses = info.poses
        for first, last in pairs(list(poses)):
            self._button(
                f"{first} → {last}",
                lambda first=first, last=last: piloting.motion((poses[first], poses[last])),  # type: ignore[misc]
                f"Go to {first}, if the arm is not there, then to {last}.",
            )

    def _jog(self, info: Info, angles: list[float]) -> None:
        gui = self._gui
        with gui.add_folder("Joints", expand_by_default=False):
            joint = gui.add_dropdown("Jog", tuple(info.joints), disabled=True)
            self._live.append(joint)
            for label, direction in (("− hold to jog", -1.0), ("+ hold to jog", 1.0)):
                button = gui.add_button(
                    label, disabled=True, hint="The arm stops as soon as the button is let go."
                )
                self._live.append(button)

                def held(_: GuiEvent[Any], direction: float = direction) -> None:
                    number = info.joints.index(str(joint.value))
                    self._post(self._hold(number, direction))

                button.on_hold(held, callback_hz=JOG_HZ)
            sliders = [
                gui.add_slider(name, low, high, 0.001, min(max(angle, low), high), disabled=True)
                for name, (low, high), angle in zip(info.joints, info.limits.position, angles, strict=True)
            ]
            self._live += sliders
            here = gui.add_button("Sliders to where the arm is", disabled=True)
            here.on_click(lambda _: self._post(self._read(sliders)))
            self._live.append(here)
            self._button(
                "Move to the sliders", lambda: piloting.motion(([float(one.value) for one in sliders],))
            )

    async def _hold(self, joint: int, direction: float) -> None:
        self._pilot.jog(self._tab, joint, direction)

    async def _read(self, sliders: list[Any]) -> None:
        for slider, angle in zip(sliders, (await self._pilot.where()), strict=True):
            slider.value = round(angle, 3)

    def _settings(self, info: Info) -> None:
        gui = self._gui
        shaper = gui.add_dropdown(
            "Shaper", tuple(dict.fromkeys((*info.shapers, info.shaper))), initial_value=info.shaper, disabled=True,
            hint="none shapes nothing, zv is the paper's, auto suppresses several modes.",
        )  # fmt: skip
        modes = gui.add_slider(
            "Modes", 1, max(len(info.joints), info.modes, 2), 1, info.modes, disabled=True,
            hint="How many modes a shaper such as zv suppresses; more than one takes a modal calibration.",
        )  # fmt: skip

        def shape(arm: Arm) -> Any:
            return arm.set_shaper(str(shaper.value), modes=int(modes.value))

        for handle in (shaper, modes):
            handle.on_update(lambda event: self._changed(event, shape))
        speed = gui.add_slider("Speed %", 10.0, 100.0, 1.0, 100.0, disabled=True)
        speed.on_update(
            lambda event: self._changed(event, lambda arm: arm.set_speed(float(speed.value) / 100.0))
        )
        rated = max(info.limits.payload, 0.1)
        declared = gui.add_slider(
            "Declared kg", 0.0, rated, 0.1, min(round(info.payload.mass, 1), rated), disabled=True,
            hint="What the controller believes that the arm carries.",
        )  # fmt: skip
        declared.on_update(
            lambda event: self._changed(event, piloting.declare(float(declared.value)), settled=True)
        )
        carried = gui.add_slider(
            "Carried kg", 0.0, 2.0 * rated, 0.1, min(round(info.payload.mass, 1), rated), disabled=True,
            hint="What the simulated arm carries; changing it puts the arm at rest.",
        )  # fmt: skip
        self._live += [shaper, modes, speed, declared, carried]
        self._button("Carry this mass", lambda: piloting.carry(float(carried.value)))

    def _changed(self, event: GuiEvent[Any], doing: Doing, *, settled: bool = False) -> None:  # noqa: ARG002
        if event.client is not None:  # by a person, not by the page
            self._post(self._pilot.set(self._tab, doing))

    def _faults(self) -> None:
        with self._gui.add_folder("Faults", expand_by_default=False):
            names = tuple(name for name, fault in FAULTS.items() if "joint" not in fault.needs)
            fault = self._gui.add_dropdown("Fault", names, initial_value=names[0], disabled=True)
            words = self._gui.add_markdown(FAULTS[names[0]].meaning)

            @fault.on_update
            def _(_: GuiEvent[Any]) -> None:
                words.content = FAULTS[str(fault.value)].meaning

            self._live.append(fault)

            def inject(arm: Arm) -> Any:
                return arm.inject(str(fault.value))

            button = self._gui.add_button("Cause it", disabled=True, color="orange")
            button.on_click(lambda _: self._post(self._pilot.set(self._tab, inject)))
            self._live.append(button)
            ready = self._gui.add_button(
                "Make the robot ready again", disabled=True, hint="Unlock, restart safety, switch on."
            )
            ready.on_click(lambda _: self._post(self._pilot.set(self._tab, self._pilot.make_ready)))
            self._live.append(ready)


def pairs(poses: list[str]) -> list[tuple[str, str]]:
    """Motions between named poses: the paper's three for three of them."""
    if len(poses) < 2:
        return []
    first, second, *more = poses
    if not more:
        return [(first, second), (second, first)]
    return [(first, second), (first, more[0]), (more[0], first)]
