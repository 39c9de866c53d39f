"""Recordings for Foxglove and Lichtblick: the arm in their 3D panel, curves, and a layout with both."""
