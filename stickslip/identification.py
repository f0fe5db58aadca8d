"""What an identification returns."""

from optim import (
    Identification as Identification,
    IdentifyStatus as IdentifyStatus,
)
