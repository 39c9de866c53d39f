"""The paper's Figure 2: one flexible joint, whose inertia changes as the arm folds."""
