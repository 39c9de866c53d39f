"""Learn the arm's frequency and damping from its own accelerometer, as section 3.3 of the paper does."""
