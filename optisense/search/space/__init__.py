"""The search space: parameters of a design, their bounds, and forbidden designs.

A `SearchSpace` holds paths and specifications of a user; bound to a design it is a `BoundSpace`,
which turns points of numbers into designs. Manufacturing errors are a space, too.
"""
