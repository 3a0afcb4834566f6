"""How good a sensor is: four scores that stand for an expert's eye, and a user's own."""
