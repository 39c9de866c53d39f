"""The presets of `tvist study` by name."""

from tvist_lab.studies import bench, match, moves, robustness

PRESETS = {
    "moves": moves.PRESET,
    "bench": bench.PRESET,
    "robustness": robustness.PRESET,
    "match": match.PRESET,
}
