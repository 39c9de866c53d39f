"""The rigid arm: forward and inverse kinematics, and torques of a motion."""
