"""What stands around a robot: wires between its terminals, its tools, a gripper, and parts that it grips.

It is a part of the simulation, like the plant: it sees outputs and the arm's place in every tick, and gives inputs and
what the arm carries.
"""
