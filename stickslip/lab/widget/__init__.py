"""An explorer of designs in a notebook."""
