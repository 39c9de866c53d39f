"""The studies, each a preset of `tvist_lab.study`."""
