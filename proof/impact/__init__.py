"""What shaping does to impact and to settling on a surface."""
