"""Plans of moves and filters. They depend on an explicit state alone, so they can be made outside the tick."""
