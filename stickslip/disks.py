"""Disks: Campbell and interference diagrams, mistuning, the whole annulus."""

from optim import (
    CampbellDiagram as CampbellDiagram,
    CampbellStatus as CampbellStatus,
    campbell_diagram as campbell_diagram,
    forbidden_hz as forbidden_hz,
)
from solver import (
    BladeAmplitudes as BladeAmplitudes,
    BladePeaks as BladePeaks,
    DiameterFrequencies as DiameterFrequencies,
    Extent as Extent,
    FoldedOrder as FoldedOrder,
    IntentionalPattern as IntentionalPattern,
    Interference as Interference,
    InterferenceDiagram as InterferenceDiagram,
    InterferenceStatus as InterferenceStatus,
    MistunedDisk as MistunedDisk,
    MistuningStatus as MistuningStatus,
    MistuningStudy as MistuningStudy,
    PatternPeak as PatternPeak,
    Wave as Wave,
    WorstMistuning as WorstMistuning,
    WorstMistuningStatus as WorstMistuningStatus,
    annulus as annulus,
    blade_amplitudes as blade_amplitudes,
    blade_peaks as blade_peaks,
    interference_diagram as interference_diagram,
    mistuned as mistuned,
    mistuning_study as mistuning_study,
    sectors_needed as sectors_needed,
    worst_mistuning as worst_mistuning,
)
