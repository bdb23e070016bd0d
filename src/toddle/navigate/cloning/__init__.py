"""Learning to steer by watching who can (Huber 2019, sections 3.3 and 4.2)."""
