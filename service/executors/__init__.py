"""Where attempts run: worker processes on this machine (and later a cluster), behind one contract."""
