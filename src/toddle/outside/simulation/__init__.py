"""Physics: bodies in MuJoCo with servos, gravity and sensor noise."""
