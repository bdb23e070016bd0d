"""A robot that learns to reach and to walk."""
