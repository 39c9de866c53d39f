"""Conversion of shaped references into drive commands."""
