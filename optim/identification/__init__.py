"""Identification: parameters of a scene from measurements, with how sure they are."""
