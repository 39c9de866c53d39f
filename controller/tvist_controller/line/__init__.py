"""The control line: the paper's Figure 6, box by box."""
