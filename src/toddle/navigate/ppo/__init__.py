"""Proximal policy optimization (Schulman et al. 2017; Huber 2019, section 2.2.3), in JAX, all of it under one jit."""
