"""Identification of an arm's modes from its accelerometer, as in section 3.3 of the paper."""
