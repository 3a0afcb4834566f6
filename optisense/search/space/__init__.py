"""What may change in a design, between which bounds, and which designs are forbidden.

Paths and specifications of a user come in; a `BoundSpace` of one design comes out, which turns
points of numbers into designs. Manufacturing errors are a space, too.
"""
