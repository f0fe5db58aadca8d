"""Periodic responses with proofs: certificates, and the checker that stands alone."""
