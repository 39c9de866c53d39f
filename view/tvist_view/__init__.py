"""The live page: a client that shows a robot in 3D with its plots and controls."""
