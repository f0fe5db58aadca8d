"""The steps of `stickslip import`."""
