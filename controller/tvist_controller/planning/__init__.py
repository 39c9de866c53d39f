"""Plans of moves and filters; they depend only on an explicit state, so they can be made outside the tick."""
