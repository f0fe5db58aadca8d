"""Responses that a force drives along a mode: at a held amplitude, and in phase resonance."""
