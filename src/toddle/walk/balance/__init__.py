"""What the sensors tell corrects the steps, the zero moment point and the servos."""
