"""Speed of each part and of served robots beside references, and long runs."""
