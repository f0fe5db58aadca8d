"""Files of matrices in every layout."""

import numpy as np
from fe_files import abaqus_input, coordinate, dmig, hbmat, op4_binary, op4_text

A = np.array(
    [[4.0, -1.5, 0, 0, 1e-3], [-1.5, 3, 0.25, 0, 0], [0, 0.25, 2, 0, 0], [0, 0, 0, 7, 0], [1e-3, 0, 0, 0, 1]]
)
NODES = [(3, 1), (3, 2), (8, 1), (8, 6), (12, 3)]


def files() -> dict[str, bytes]:
    pair = {"MAA": np.eye(5), "KAA": A, "RECT": A[:, :2]}
    texts = {
        "k.matrix": hbmat(A), "k.mtx": abaqus_input(A, NODES), "full.mtx": abaqus_input(A, NODES, full=True),
        "triplets.mtx": coordinate(A), "k.sti": coordinate(A), "k.mas": coordinate(A),
        "k.pch": dmig("MAAX", np.eye(5), NODES) + dmig("KAAX", A, NODES),
        "k.dmig": dmig("K2GG", A, NODES, large=False),
        "dense.op4": op4_text(pair), "single.op4": op4_text(pair, double=False),
        "strings.op4": op4_text(pair, sparse=True), "big.op4": op4_text(pair, sparse=True, bigmat=True),
    }  # fmt: skip
    made = {name: text.encode() for name, text in texts.items()}
    for order in "<>":
        for sparse, big, word in ((False, False, 4), (True, False, 4), (True, True, 4), (True, True, 8)):
            name = f"{'little' if order == '<' else 'big'}-{sparse}-{big}-{word}.op4"
            made[name] = op4_binary(pair, order=order, sparse=sparse, bigmat=big, word=word)
    made["single-binary.op4"] = op4_binary({"K": A.astype(np.float32)}, double=False, sparse=True)
    return made
