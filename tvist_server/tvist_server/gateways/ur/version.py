"""UR software version that all interfaces report: 5.22, because clients expect more features of later ones."""

MAJOR, MINOR, BUGFIX, BUILD = 5, 22, 0, 1
DATE = "01-01-2025, 00:00:00"
