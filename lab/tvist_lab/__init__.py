"""Experiments that run as clients: identification, the paper's experiment, metrics, figures, replay, benchmarks."""
