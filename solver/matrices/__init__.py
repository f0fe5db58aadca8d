"""Structures given by their matrices or modes: files, values in a scene, reduction of large models."""
