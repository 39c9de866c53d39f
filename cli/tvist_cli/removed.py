"""Commands that had another name: what to use instead."""

_LOG = ("record", "info", "analyze", "compare", "report", "export", "replay")
_STUDIES = ("robustness", "paths", "tracking", "map")

INSTEAD = {
    **{name: f"tvist log {name}" for name in _LOG},
    **{name: f"tvist study {name}" for name in _STUDIES},
    "sweep": "tvist study sweep FILE",
    "check-script": "tvist run --check",
    "kernels": "tvist serve --compile",
    "sensitivity": "tvist shapers --sensitivity",
    "search": "python -m proof search, in a checkout",
    "bound": "python -m proof bound, in a checkout",
}
"""What does the work of a removed command, by its old name. No entry hides a command that exists."""
