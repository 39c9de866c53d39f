"""What a robot at the end of the line does that takes positions only."""
