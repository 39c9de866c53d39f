"""Benchmarks of speed, each with a reference from the same run; in no distribution."""
