"""One sector of a disk from its matrices: boundaries, nodal diameters, reduction."""
