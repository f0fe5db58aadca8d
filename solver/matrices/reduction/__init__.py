"""Large models reduced onto the DOFs in use."""
