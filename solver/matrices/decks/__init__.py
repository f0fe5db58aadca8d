"""Decks of finite-element programs: where their nodes are, and along which axes each one moves."""
