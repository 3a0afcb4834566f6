"""The search space: parameters of a design, their bounds, and forbidden designs.

Paths and specifications of a user come in; a `BoundSpace` of one design comes out, which turns
points of numbers into designs. Manufacturing errors are a space, too.
"""
