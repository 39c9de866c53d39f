"""What commands and their answers have in common."""
