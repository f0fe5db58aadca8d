"""The contacts of a scene as the compiled loops read them: a law's number and a row of numbers each."""

from __future__ import annotations

import math

import numpy as np

from solver.contacts.kernels import columns
from solver.contacts.kernels.system import KT, MU, N0, N1, PHASE, RATIO
from solver.jit.fourier import Integer, Real
from solver.linear.assembly import LinearModel
from solver.scene.scene import (
    AnyContact,
    ElasticNormalContact,
    FrictionContact,
    GapSpring,
    PlanarContact,
    PolynomialSpring,
    Scene,
)

DEFAULT_SAMPLES = 512


def law_numbers(scene: Scene) -> Integer:
    """Return the law of every contact, (n_contacts,), as `solver.contacts.kernels.columns` numbers them."""
    return np.array([_law(contact) for contact in scene.contacts], dtype=np.int64)


def port_counts(scene: Scene) -> Integer:
    """Return how many relative motions the force of every contact depends on, (n_contacts,)."""
    return np.array([len(contact.pairs) for contact in scene.contacts], dtype=np.int64)


def contact_table(scene: Scene) -> Real:
    """Return the rows of all contacts, (n_contacts, COLUMNS); a load that is not tied has a ratio NaN."""
    table = np.zeros((len(scene.contacts), columns.COLUMNS))
    table[:, RATIO] = math.nan
    for row, contact in zip(table, scene.contacts, strict=True):
        _fill(row, contact)
    return table


def port_stiffnesses(scene: Scene, model: LinearModel) -> Real:
    """Return a stiffness > 0 of every port [N/m]: its own, or one of the size of the structure's."""
    own = np.array([k for contact in scene.contacts for k in contact.stiffnesses], dtype=np.float64)
    largest = float(np.abs(model.K0).max(initial=0.0))
    return np.where(own > 0.0, own, largest if largest > 0.0 else 1.0)


def _law(contact: AnyContact) -> int:
    if isinstance(contact, PlanarContact):
        return columns.COULOMB_BOX if contact.limit == "box" else columns.COULOMB_PLANE
    known: dict[type[AnyContact], int] = {
        ElasticNormalContact: columns.ELASTIC_NORMAL,
        GapSpring: columns.GAP_SPRING,
        PolynomialSpring: columns.POLYNOMIAL,
    }
    return known.get(type(contact), columns.COULOMB)


def _fill(row: Real, contact: AnyContact) -> None:
    if isinstance(contact, FrictionContact):
        row[KT], row[MU], row[N0], row[N1] = contact.kt, contact.mu, contact.N0, contact.N1_value
        row[RATIO] = math.nan if contact.N1_ratio is None else contact.N1_ratio
        row[PHASE] = contact.N1_phase
    if isinstance(contact, ElasticNormalContact):
        row[columns.KN], row[columns.PRESTRESSED] = contact.kn, float(contact.prestressed)
    elif isinstance(contact, PlanarContact):
        row[columns.SAMPLES] = contact.samples or DEFAULT_SAMPLES
    elif isinstance(contact, GapSpring):
        row[columns.K_GAP], row[columns.GAP] = contact.k, contact.gap
    elif isinstance(contact, PolynomialSpring):
        row[columns.A_1 : columns.A_1 + columns.MOST_DEGREE] = contact.coefficients


def enough_samples(table: Real, laws: Integer, highest: int) -> Real:
    """Return the contact table with as many samples of circular limits as `highest` harmonics need.

    Four for the shortest wave: with fewer it would be taken for a longer one.
    """
    few = (laws == columns.COULOMB_PLANE) & (table[:, columns.SAMPLES] < 4 * highest)
    if not np.any(few):
        return table
    table = table.copy()
    table[few, columns.SAMPLES] = 4 * highest
    return table
