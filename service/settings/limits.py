"""What clients may take of a service: limits of all together, and of each owner by default.

A key may have limits of its own (`service.auth.callers.KeyLimits`) in place of those that begin with
`owner_`. Where no keys are needed, everybody is one owner.
"""

from __future__ import annotations

from pydantic import Field
from pydantic_settings import BaseSettings, SettingsConfigDict


class Limits(BaseSettings):
    """The part of the settings that limits clients; 0 is no limit."""

    model_config = SettingsConfigDict(
        env_prefix="STICKSLIP_", frozen=True, extra="forbid", allow_inf_nan=False
    )

    owner_waiting: int = Field(
        default=500,
        ge=0,
        le=1_000_000,
        description="Jobs of one owner that wait at a time, where there are keys; 0: any number.",
    )
    owner_storage_bytes: int = Field(
        default=10_000_000_000,
        ge=0,
        le=10**15,
        description="What one owner's uploads and results take [bytes]; 0: any amount.",
    )
    owner_requests: int = Field(
        default=100,
        ge=0,
        le=100_000,
        description="Requests of one owner that are answered at a time, those that wait for a job among "
        "them; 0: any number.",
    )
    owner_streams: int = Field(
        default=100, ge=0, le=100_000, description="Event streams of one owner at a time; 0: any number."
    )
    owner_previews: int = Field(
        default=4, ge=0, le=1000, description="Previews of one owner that wait at a time; 0: any number."
    )
    owner_uploads: int = Field(
        default=4, ge=0, le=1000, description="Uploads of one owner at a time; 0: any number."
    )
    owner_priority: int = Field(
        default=100, ge=-100, le=100, description="Highest priority one owner may give a job."
    )
    streams: int = Field(
        default=1000, ge=0, le=100_000, description="Event streams of all at a time; 0: any number."
    )
    connections: int = Field(
        default=2000,
        ge=10,
        le=1_000_000,
        description="Open connections, at most as many as the system lets a process have. For one more, the "
        "one is closed that has been idle for longest.",
    )
    write_seconds: float = Field(
        default=10.0,
        ge=0.1,
        le=3600.0,
        description="Time in which a client must take something of its answer [s].",
    )
    unsent_bytes: int = Field(
        default=100_000_000,
        ge=1_000_000,
        le=10**12,
        description="Answers that one owner's clients have not taken yet, together [bytes]: while they are "
        "more, those who take nothing are disconnected and further requests answered 429.",
    )
