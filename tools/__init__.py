"""What maintains the project and is part of no distribution: the documentation's site, releases."""
