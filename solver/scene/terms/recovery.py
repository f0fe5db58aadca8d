"""Quantities recovered from the motion: stresses, strains and others that are sums of DOFs."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from solver.contacts.fields import MemberName, Part
from solver.scene.terms.excitation import Shares


class Recovered(Part):
    """A row of a recovery matrix: a quantity that may be observed like a DOF.

    Attributes
    ----------
    name : str
        What `observe` and time histories call it.
    unit : str
        Its unit, for example MPa; amplitudes are in it.
    terms : table
        DOF to its factor [unit/m].
    """

    name: MemberName
    unit: Annotated[str, Field(min_length=1, max_length=20)]
    terms: Shares
