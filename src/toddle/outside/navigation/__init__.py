"""Navigation's contact with the world: the walker in the loop, physics, checkpoints."""
