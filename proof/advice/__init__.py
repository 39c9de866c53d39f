"""Whether what is advised from a log comes true."""
