"""The studies that come with the package, each a preset of `tvist study`."""
