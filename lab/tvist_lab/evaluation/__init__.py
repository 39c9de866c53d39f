"""Moves by the hundred, unshaped and shaped, in this process; and a bench for shapers on several arms."""
