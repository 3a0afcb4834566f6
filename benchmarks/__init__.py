"""Benchmarks: speed, accuracy, and other renderers on the same scene (``python -m benchmarks``).

Not part of the installed package.
"""
