"""A flexible robot arm: drive commands in, measurements out."""
