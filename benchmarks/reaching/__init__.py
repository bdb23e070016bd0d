"""Reaching: damage survived, errors foretold."""
