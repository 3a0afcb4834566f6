"""Making, opening, saving and checking a sensor."""
