"""What logs of everyday motions tell of hidden robots."""
