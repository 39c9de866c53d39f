"""Real-time data exchange, port 30004: recipes of variables, read up to 500 times a second, and written.

A package is its size (two bytes, the header among them), its kind (one byte) and a payload; numbers are big-endian.
"""
