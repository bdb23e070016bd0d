"""Velocity commands become postures: pattern, posture, balance, and the loop that closes them."""
