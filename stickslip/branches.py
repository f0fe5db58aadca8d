"""Branches of responses: settings, errors, marks of stability, places where they part."""

from solver.first_use import names_of, on_first_use

__getattr__, __dir__, __all__ = on_first_use(__name__, names_of(__name__, __file__))
