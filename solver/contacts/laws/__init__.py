"""The contact laws, one a file: what a scene says of each, its kernel, and what others ask of it."""
