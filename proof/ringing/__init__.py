"""Judge the modes that the laboratory finds in a ring-down, by another method and by ringing whose truth is known."""
