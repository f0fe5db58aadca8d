from solver import (
    AccuracyRow as AccuracyRow,
    AccuracyStudy as AccuracyStudy,
    Dataset as Dataset,
    MapStatus as MapStatus,
    Plan as Plan,
    ResponseMap as ResponseMap,
    Shown as Shown,
    Summary as Summary,
    Variable as Variable,
)
