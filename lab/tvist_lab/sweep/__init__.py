"""Sweeps: shapers by payloads by errors by random moves by robots, one row each, resumed where they ended."""
