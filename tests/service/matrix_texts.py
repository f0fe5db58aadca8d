"""Matrix files for uploads."""


def matrix_market(size: int) -> str:
    """A diagonal matrix as MatrixMarket."""
    rows = "".join(f"{row} {row} {1.0 + row}\n" for row in range(1, size + 1))
    return f"%%MatrixMarket matrix coordinate real symmetric\n{size} {size} {size}\n{rows}"


FILE = matrix_market(40).encode()
