"""Programs that the controller carries out by itself, line by line, within the tick."""
