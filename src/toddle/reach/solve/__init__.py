"""Solvers: from a learner to an answer for a target."""
