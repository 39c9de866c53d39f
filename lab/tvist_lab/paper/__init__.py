"""The paper's experiment: three motions, unshaped and shaped, and its tables and figures."""
