"""The commands of `tvist log`, one per module."""
