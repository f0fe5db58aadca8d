"""Designs and studies in words, as named arrays and as pictures."""
