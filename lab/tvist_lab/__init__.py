"""Experiments, written as clients: identification, the paper's, metrics, figures, replays, benchmarks."""
