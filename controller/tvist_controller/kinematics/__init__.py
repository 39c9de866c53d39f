"""The rigid arm: kinematics forward and inverse, and the torques that a motion needs."""
