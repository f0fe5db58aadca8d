"""A design by IPOPT: a check of the method that is taken by itself, at two to three times the responses."""
