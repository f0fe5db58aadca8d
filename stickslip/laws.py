"""Friction laws of one's own."""

from solver import (
    LawParameter as LawParameter,
    register_law as register_law,
)
