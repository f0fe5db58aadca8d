"""Doors to other programs: answers as functions with exact derivatives, equations of motion, FMU, MATLAB."""
