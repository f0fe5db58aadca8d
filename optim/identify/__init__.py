"""Identification: parameters of a scene from measured responses and hysteresis loops, with how sure they are."""
