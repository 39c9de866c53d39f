"""Sweeps: random moves of robots with every shaper, payload and error that a TOML file lists."""
