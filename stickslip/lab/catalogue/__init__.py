"""Designs among the dampers of a catalogue."""
