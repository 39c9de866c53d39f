"""Hundreds of moves, unshaped and shaped, in this process; and a benchmark of shapers on several arms."""
