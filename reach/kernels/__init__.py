"""Compiled numerics of the contact models: mesh tree, clipping, aggregation, support, minimum norm.

The functions here take and return plain arrays and named tuples of arrays, allocate little, and
release the interpreter's lock. The readable formulation of the same theory is in
`reach.patch`, `reach.pressure`, `reach.limit_surface` and `reach.wrench`; tests compare the two.
"""
