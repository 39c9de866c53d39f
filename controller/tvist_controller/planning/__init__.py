"""Moves and filters made of what they depend on and of nothing else, so that they can be made beside the tick."""
