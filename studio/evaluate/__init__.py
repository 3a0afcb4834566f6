"""Scores of the sensor, and its chief rays in the viewport."""
