"""Tasks to learn; each is pure, and runs under `jit`, `vmap` and `scan`."""
