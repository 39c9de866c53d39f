"""Experiments, written as clients: identification, the paper's experiment, metrics, figures, replays, speed."""
