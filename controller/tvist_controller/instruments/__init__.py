"""What is measured and reported: states, terminals, and the values of UR's interfaces, without clock or I/O."""
