"""Periodic response of structures with friction contacts: scenes, balance, continuation, time marching.

The names in the stub beside this file are the public interface, loaded on first use, so that importing the
package is cheap.
"""

from solver.first_use import names_of, on_first_use

__getattr__, __dir__, __all__ = on_first_use(__name__, names_of(__name__, __file__))
