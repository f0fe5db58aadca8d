"""Doors for other programs: answers as functions of parameters with their exact derivatives."""
