"""Learning the body: forward models q -> x fitted to a few movements, to be solved afterwards."""
