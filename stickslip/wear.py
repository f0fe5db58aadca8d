"""Wear: work, load and distance of each contact, and where they are worst."""

from solver import (
    ContactWear as ContactWear,
    Measure as Measure,
    Measured as Measured,
    WearSensitivity as WearSensitivity,
    WorstWear as WorstWear,
    contact_wear as contact_wear,
    worst_friction_work as worst_friction_work,
    worst_slopes as worst_slopes,
    worst_wear as worst_wear,
)
