"""Resonance peaks that follow from a nonlinear mode: the performance curve, its error and its gradient."""
