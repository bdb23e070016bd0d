"""Inverse kinematics beside its peers: the same bodies, the same targets, one thread, one run."""
