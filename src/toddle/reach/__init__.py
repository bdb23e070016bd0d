"""Targets to joint angles: explore, learn, solve, evaluate, and the loop that closes them (`loop`)."""
