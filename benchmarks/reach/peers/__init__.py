"""One file a solver, each run as a process of its own in an environment of its own; `worker` is what they share."""
