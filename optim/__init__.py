"""The design layer: criteria with gradients, and the search for the best damper.

The names in the stub beside this file are public, loaded on first use: CVXPY takes a second to import.
"""

from solver.first_use import names_of, on_first_use

__getattr__, __dir__, __all__ = on_first_use(__name__, names_of(__name__, __file__))
