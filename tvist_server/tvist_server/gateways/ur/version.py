"""UR software version that all interfaces report: 5.22, because clients expect more features of later ones."""

VERSION = (5, 22, 0, 1)  # major, minor, bugfix, build
DATE = "01-01-2025, 00:00:00"
