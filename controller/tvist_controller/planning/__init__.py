"""Plans of moves and filters. They depend only on an explicit basis, so they can be made outside the tick."""
