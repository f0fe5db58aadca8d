"""Friction dampers: scenes, periodic responses, designs, and the client of the service, under one name.

    import stickslip

    scene = stickslip.load_scene("bladed-disk")
    best = stickslip.design(scene, variables={"shroud.N0": (20.0, 3000.0)})

What a script asks stands here; what goes further, by subject: `stickslip.modes`, `stickslip.disks`, ….
Every name is the very object of `solver` or `optim`, loaded on first use, so that importing costs nothing.
"""

from solver.first_use import names_in, names_of, on_first_use

_homes = names_of(__name__, __file__)
_SUBJECTS = sorted(name for name, home in _homes.items() if home == f"{__name__}.")
_load, __dir__, __all__ = on_first_use(__name__, _homes)


def __getattr__(name: str) -> object:
    """Load a public name on first use; one that has moved to a subject is found there, with a warning."""
    from importlib import import_module

    if name in _SUBJECTS:
        return import_module(f"{__name__}.{name}")
    if name == "__version__":
        from importlib.metadata import version

        return version("stickslip")
    if name in _homes or name.startswith("_"):
        return _load(name)
    for subject in _SUBJECTS:
        if name in names_in(f"{__path__[0]}/{subject}.pyi", __name__):
            import warnings

            told = f"stickslip.{name} is stickslip.{subject}.{name} now; the short form goes with 0.2"
            warnings.warn(told, DeprecationWarning, stacklevel=2)
            return getattr(import_module(f"{__name__}.{subject}"), name)
    return _load(name)
