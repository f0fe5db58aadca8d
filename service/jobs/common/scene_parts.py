"""The joints of a scene as a drawing shows them: its contacts, and dampers between the places they touch."""

from __future__ import annotations

from collections.abc import Sequence

from pydantic import BaseModel, ConfigDict, Field

from solver.scene.scene import Scene

GROUND = "ground"


class JointAnswer(BaseModel):
    """A contact, or a damper with the contacts it brings along."""

    model_config = ConfigDict(frozen=True)

    name: str
    law: str = Field(description="Of a damper its shape.")
    between: list[str] = Field(description="Two DOFs or the ground; of a place its first DOF.")
    at: list[float] | None = Field(description="Where it is, in a scene with places.")
    contacts: list[str] = Field(description="Contacts it stands for, as states and limits name them.")
    friction: bool = Field(description="Whether a normal load presses it, which may be kept from opening.")


def joints(scene: Scene) -> list[JointAnswer]:
    """Return every contact that stands by itself, then the dampers."""
    by_name = {contact.name: contact for contact in scene.contacts}
    brought = {damper.name: damper.contacts() for damper in scene.dampers}
    of_dampers = {table["name"] for tables in brought.values() for table in tables}
    found = []
    for name, contact in by_name.items():
        if name in of_dampers:
            continue
        at = contact.at if contact.at is not None else _place(scene, contact.between)
        found.append(
            JointAnswer(
                name=name, law=contact.LAW, between=[_dof(scene, end) for end in contact.between],
                at=None if at is None else list(at), contacts=[name], friction=contact.load is not None,
            )
        )  # fmt: skip
    for damper in scene.dampers:
        tables = brought[damper.name]
        names = [table["name"] for table in tables]
        ends = getattr(damper, "between", tables[0]["between"])
        found.append(
            JointAnswer(
                name=damper.name, law=damper.shape, between=[_dof(scene, end) for end in ends],
                at=tables[0]["at"], contacts=names,
                friction=any(by_name[name].load is not None for name in names),
            )
        )  # fmt: skip
    return found


def _dof(scene: Scene, end: str) -> str:
    """Return the first DOF of a place, with the sector it is in; a body stands still in a drawing."""
    name, at, sector = end.partition("@")
    node = next((node for node in scene.nodes if node.name == name), None)
    if node is not None:
        return f"{node.dofs[0][1]}{at}{sector}"
    return GROUND if any(body.name == name for body in scene.bodies) else end


def _place(scene: Scene, ends: Sequence[str]) -> Sequence[float] | None:
    """Return the place of the node in this sector that a contact holds."""
    own = {end for end in ends if "@" not in end}
    for node in scene.nodes:
        if node.name in own or own & {dof for _, dof in node.dofs}:
            return node.at
    return None
