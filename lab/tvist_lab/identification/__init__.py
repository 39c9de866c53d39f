"""Identification of the arm's frequency and damping from its own accelerometer, as in section 3.3 of the paper."""
