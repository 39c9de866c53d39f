"""The paper's experiment: three motions, unshaped and shaped, with its tables and figures."""
