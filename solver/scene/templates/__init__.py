"""Scenes of the common cases, made of the few things a designer knows."""
