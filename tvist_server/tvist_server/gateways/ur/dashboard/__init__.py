"""UR's dashboard server, port 29999: lines of text, each answered with one."""
