"""Real-time data exchange as both of its ends have it: packages, types of variables, and the end that reads.

A package consists of its size in bytes, header included (uint16), its type (uint8) and a payload; numbers are
big-endian.
"""
