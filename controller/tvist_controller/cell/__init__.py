"""The cell around a robot: wires, tools, gripper and parts, simulated in every tick like the plant."""
