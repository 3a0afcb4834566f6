"""Fitting a sensor to photographs of the real one."""
