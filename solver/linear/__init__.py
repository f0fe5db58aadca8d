"""The linear structure: assembly, modes, reduction to the contacts, receptances."""
