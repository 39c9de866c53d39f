"""RTDE (real-time data exchange): packages, types of variables, and the client's end.

A package consists of its size in bytes including the header (uint16), its type (uint8) and a payload;
big-endian.
"""
