"""Prediction: simulated copies of the line, stops, and collisions."""
