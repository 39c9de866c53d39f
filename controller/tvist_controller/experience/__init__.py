"""What a robot learns from its own motions: each is recorded, studied when it has ended, and answered by lessons."""
