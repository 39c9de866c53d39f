"""What will happen: copies of the line run ahead, stops, and collisions on the way."""
