"""Sources of modes, shapers and plants."""
