"""A layout for Foxglove and Lichtblick: the arm; right of it its vibration, its reference and its state."""

from typing import Any

from tvist_lab.foxglove.arm import BASE, Arm
from tvist_protocol.recorded import topics
from tvist_protocol.stream import State

ARM, FRAMES, CURVES = "arm", "frames", "curves"
"""Ends of the topics that are added to those of a robot."""
GREEN, ORANGE, BLUE = "#009E73", "#D55E00", "#0072B2"
BACKGROUND, LINES = "#F5F7F9", "#D9DEE3"


def topic(robot: str, end: str) -> str:
    """Return the topic of an added channel, beside those of the robot."""
    return topics(robot)[State].removesuffix("state") + end


def layout(robot: str, arm: Arm) -> dict[str, Any]:
    """Return the layout for a robot's recording."""
    curve, state = topic(robot, CURVES), topics(robot)[State]
    panels = {
        "3D!arm": _view(robot, arm),
        "Plot!vibration": _plot("Vibration of the tool, |α| [m/s²]", (f"{curve}.alpha", "|α|", GREEN)),
        "Plot!reference": _plot(
            "Largest acceleration of a joint [rad/s²]",
            (f"{curve}.before_shaper", "before the shaper", ORANGE),
            (f"{curve}.after_shaper", "after the shaper", BLUE),
        ),
        "StateTransitions!state": {
            "isSynced": True,
            "paths": [
                {"value": f"{state}.{name}", "label": name, "enabled": True, "timestampMethod": "receiveTime"}
                for name in ("robot_mode", "safety_mode", "runtime_state")
            ],
        },
    }
    view, vibration, reference, states = panels
    below = {"direction": "column", "first": reference, "second": states, "splitPercentage": 55}
    curves = {"direction": "column", "first": vibration, "second": below, "splitPercentage": 40}
    return {
        "configById": panels,
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 1},
        "layout": {"direction": "row", "first": view, "second": curves, "splitPercentage": 50},
    }


def _view(robot: str, arm: Arm) -> dict[str, Any]:
    return {
        "cameraState": {
            "perspective": True,
            "distance": 2.4 * arm.reach,
            "phi": 70,
            "thetaOffset": 40,
            "target": [0, 0, 0],
            "targetOffset": [0, 0, 0.3 * arm.reach],
            "targetOrientation": [0, 0, 0, 1],
            "fovy": 45,
            "near": 0.01,
            "far": 1000,
        },
        "followMode": "follow-none",
        "followTf": BASE,
        "scene": {"backgroundColor": BACKGROUND, "transforms": {"showLabel": False}},
        "transforms": {f"frame:{name}": {"visible": False} for name in arm.frames},
        "topics": {topic(robot, ARM): {"visible": True}},
        "layers": {
            "grid": {
                "layerId": "foxglove.Grid",
                "instanceId": "grid",
                "label": "Grid",
                "visible": True,
                "frameId": BASE,
                "size": 4.0 * arm.reach,
                "divisions": 20,
                "lineWidth": 1,
                "color": LINES,
                "position": [0, 0, 0],
                "rotation": [0, 0, 0],
            }
        },
    }


def _plot(title: str, *paths: tuple[str, str, str]) -> dict[str, Any]:
    return {
        "foxglovePanelTitle": title,
        "lichtblickPanelTitle": title,
        "paths": [
            {
                "value": value,
                "label": label,
                "color": color,
                "enabled": True,
                "timestampMethod": "receiveTime",
            }
            for value, label, color in paths
        ],
        "minYValue": 0,
        "xAxisVal": "timestamp",
        "isSynced": True,
        "showLegend": True,
        "legendDisplay": "floating",
        "showPlotValuesInLegend": False,
        "showXAxisLabels": True,
        "showYAxisLabels": True,
        "sidebarDimension": 240,
    }
