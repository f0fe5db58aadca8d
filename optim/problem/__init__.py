"""The design problem: variables, load cases, uncertainty."""
