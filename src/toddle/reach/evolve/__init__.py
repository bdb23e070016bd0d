"""Evolved inverse kinematics (Martin, de Lope, Santos 2009): neuro-controllers scored by forward kinematics alone."""
