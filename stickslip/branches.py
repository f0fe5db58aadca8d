"""Branches of responses: settings, errors, marks of stability, places where they part."""

from solver import (
    AnyBranch as AnyBranch,
    Bifurcations as Bifurcations,
    BranchStatus as BranchStatus,
    ContinuationSettings as ContinuationSettings,
    Course as Course,
    ErrorEstimate as ErrorEstimate,
    Mark as Mark,
    MarkKind as MarkKind,
    Predictor as Predictor,
    Stretch as Stretch,
    Switched as Switched,
    bifurcations as bifurcations,
    branch_errors as branch_errors,
    branch_stability as branch_stability,
    joined as joined,
    switch_branches as switch_branches,
)
