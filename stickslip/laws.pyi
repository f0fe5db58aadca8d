from solver import (
    LawParameter as LawParameter,
    register_law as register_law,
    tensor_springs as tensor_springs,
)
