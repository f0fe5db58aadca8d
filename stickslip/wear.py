"""Wear: work, load and distance of each contact, where they are worst, and what goes over hours."""

from solver import (
    ContactWear as ContactWear,
    LeastWornPeak as LeastWornPeak,
    Measure as Measure,
    Measured as Measured,
    Mission as Mission,
    WearLaw as WearLaw,
    WearLife as WearLife,
    WearLifeStatus as WearLifeStatus,
    WearSensitivity as WearSensitivity,
    WornStatus as WornStatus,
    WorstWear as WorstWear,
    contact_wear as contact_wear,
    least_worn_peak as least_worn_peak,
    wear_life as wear_life,
    worst_friction_work as worst_friction_work,
    worst_slopes as worst_slopes,
    worst_wear as worst_wear,
)
