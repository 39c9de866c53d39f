"""The control line: Figure 6 of the paper, block by block."""
