"""`python -m tvist_cli` is `tvist`."""

from tvist_cli.main import program

program()
