"""Bodies: rigid chains from URDF, MJCF and Denavit-Hartenberg tables, and the continuum arm."""
