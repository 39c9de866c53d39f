"""The commands of `tvist study`, one module each."""
