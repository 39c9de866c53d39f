"""Motions from rest to rest that leave no vibration: time laws computed from a model of the flexible arm."""
