"""What a user describes: structure, contacts, excitation, what to observe; read, checked, written."""
