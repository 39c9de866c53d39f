"""Real-time data exchange, port 30004: clients subscribe to lists of variables at up to 500 Hz, and write others.

A package consists of its size in bytes, header included (uint16), its type (uint8) and a payload; numbers are
big-endian.
"""
