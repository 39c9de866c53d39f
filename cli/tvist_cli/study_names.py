"""The studies that come with the package, which are commands of `tvist study`."""

STUDY = {
    "sweep": "Compare shapers over payloads, errors, moves and robots, on all cores or a cluster.",
    "robustness": "Compare shapers on arms that are softer, loaded otherwise or worse than they are told.",
    "match": "Compare two shapers on the same moves and plants, with intervals, and say which is better where.",
}
"""Names with their one-line help."""
