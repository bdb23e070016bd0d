"""Velocity commands become footsteps and the motion of the centre of mass (Huber 2019, section 2.1.3)."""
