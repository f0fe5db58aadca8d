"""Projects, what is said of runs, and links that share them."""
