"""A robot in another process that is moved over a link that can fail."""
