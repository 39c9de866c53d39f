"""How soon a robot notices that it no longer fits its model, and how often it says so without a reason."""
