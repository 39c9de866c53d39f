"""Kinematics of the rigid arm from its Denavit-Hartenberg parameters, compiled: forward, differential, inverse."""
