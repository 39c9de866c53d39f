"""What maintains the project and is part of no distribution: code that is made, the documentation's site, releases."""
