"""What stops the arm: the safety system, dangers, faults, and the payload that torques contradict or teach."""
