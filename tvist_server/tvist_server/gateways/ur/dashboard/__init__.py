"""UR's dashboard server, port 29999: each line of text is answered with one line."""
