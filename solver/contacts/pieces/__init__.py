"""The states of contacts over a periodic motion, and how their forces follow a perturbation of it."""
