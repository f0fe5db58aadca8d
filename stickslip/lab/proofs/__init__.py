"""Periodic responses with proofs: certificates, the checker, exact orbits, rigid friction."""
