"""Design reports: pages that need nothing else, to be read, printed and kept."""
