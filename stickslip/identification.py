"""What measurements tell: results of an identification, posteriors, model choice, reassemblies."""

from solver.first_use import names_of, on_first_use

__getattr__, __dir__, __all__ = on_first_use(__name__, names_of(__name__, __file__))
