"""How closely the arm follows positions that a client sends to `servoj` 500 times a second."""
