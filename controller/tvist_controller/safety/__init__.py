"""What stops the arm: the safety system's actions, dangers, faults, and the payload that torques contradict."""
