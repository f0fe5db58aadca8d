"""Where attempts run: worker processes on this machine or on a cluster, behind one contract.

Importing this package loads nothing: what processes are forked off (`preloaded`) and the processes on a
cluster stand in it, and need neither the database nor the settings of the service.
"""
