"""Commands on their way: admitted, planned, and handed to what carries them out."""
