"""Searches for ways to make a robot break what it promises: stops, streams, changes in motion, whole sequences."""
