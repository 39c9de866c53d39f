"""How functions are compiled, and where their machine code is kept; below all other packages."""
