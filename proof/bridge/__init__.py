"""What a robot at the end of the line does, which takes positions only, over a link that can fail."""
