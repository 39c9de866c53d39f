"""The commands of `tvist`, one per module."""
