"""How well it reaches: test sets, errors, coverage."""
