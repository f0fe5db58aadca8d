"""The compiled inner loops: event march, moments, Jacobian, Newton, continuation.

Every function here is compiled by Numba, cached on disk and releases the GIL. They take and return plain
arrays and named tuples of arrays; what the numbers mean to a user is the business of the modules above.
"""
