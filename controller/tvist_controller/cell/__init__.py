"""The cell around a robot: wires, tools, gripper and parts, simulated like the plant.

In every tick it reads outputs and the arm's pose, and sets inputs and the carried payload.
"""
