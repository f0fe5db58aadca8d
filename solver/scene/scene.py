"""What a user describes: structure, contacts, excitation, what to observe."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Annotated, Any

from pydantic import (
    ConfigDict,
    Field,
    ModelWrapValidatorHandler,
    ValidationError,
    ValidationInfo,
    field_validator,
    model_validator,
)

from solver.contacts.fields import End, Name, NonNegative, Part, Positive, parse_end
from solver.contacts.laws.contact_law import AnyContact
from solver.contacts.laws.coulomb import Contact
from solver.contacts.laws.coulomb_2d import PlanarContact
from solver.contacts.laws.elastic_normal import ElasticNormalContact
from solver.contacts.laws.friction import FrictionContact
from solver.contacts.laws.gap import GapSpring
from solver.contacts.laws.polynomial import PolynomialSpring
from solver.errors import Issue, SceneError, SettingError
from solver.extensions import on_change
from solver.results import units
from solver.results.known import Measured
from solver.results.told import Summary, html_of
from solver.results.units import number
from solver.scene import parameter_paths as scene_paths
from solver.scene.bodies import kinematics
from solver.scene.bodies.body import Body, Load, Node
from solver.scene.bodies.body_shapes import AnyShape
from solver.scene.bodies.body_validation import body_issues, cyclic_issues
from solver.scene.bodies.kinematics import Form
from solver.scene.bodies.shape_parts import own_parts, with_shapes
from solver.scene.excitation import with_factor_files
from solver.scene.linear_terms import Aerodynamics, CouplingOfAnyKind, Entry, SpeedDependence, at_speed
from solver.scene.materials import Material
from solver.scene.scene_records import (
    KINDS,
    ContactOfAnyLaw,
    CyclicStructure,
    Damper,
    Excitation,
    LumpedStructure,
    Mass,
    MatricesStructure,
    Mistuning,
    Observe,
    Recovered,
    Spring,
    Structure,
)
from solver.scene.toml import load_raw, scene_folder, shipped_scenes
from solver.scene.validation import cross_issues, field_issues, in_si, plain, term_issues

__all__ = [
    "KINDS",
    "AnyContact",
    "Body",
    "Contact",
    "ContactOfAnyLaw",
    "CyclicStructure",
    "Damper",
    "ElasticNormalContact",
    "End",
    "Excitation",
    "FrictionContact",
    "GapSpring",
    "Load",
    "LumpedStructure",
    "Mass",
    "MatricesStructure",
    "Mistuning",
    "Node",
    "Observe",
    "PlanarContact",
    "PolynomialSpring",
    "Scene",
    "Spring",
    "Structure",
    "load_scene",
    "parse_end",
    "shipped_scenes",
]


_OPTIONAL = (
    "bodies",
    "nodes",
    "loads",
    "dampers",
    "couplings",
    "aerodynamics",
    "with_speed",
    "recovery",
    "materials",
)  # left out if empty
_FEW = 6  # contacts that are named where a scene says what it is


_CHECKED = "checked"


class Scene(Part):
    """A structure with friction contacts, how it is excited and what is observed. Frozen, SI units.

    What is wrong with one is a SceneError that lists everything, each with a JSON pointer.
    """

    # The union of the laws is made on first use, when every module that brings one can be imported.
    model_config = ConfigDict(defer_build=True)

    name: Annotated[Name, "Name of the scene: letters, digits, - and _."]
    structure: Annotated[
        Structure,
        Field(discriminator="kind"),
        "What vibrates: masses, springs and dashpots, or matrices; `kind` says how it is given.",
    ]
    contacts: Annotated[
        tuple[ContactOfAnyLaw, ...],
        "What is not linear: friction contacts, rubbing contacts, gaps, nonlinear springs; may be empty.",
    ] = ()
    excitation: Annotated[
        tuple[Excitation, ...],
        "The forces, at least one. A single one may be given without a list.",
    ]
    observe: Annotated[Observe, "The DOF whose amplitude counts, and the band of frequencies [Hz]."]
    bodies: Annotated[
        tuple[Body, ...],
        "Rigid bodies, held by contacts and springs; their DOFs stand behind those of the structure.",
    ] = ()
    nodes: Annotated[tuple[Node, ...], "Positions of DOFs, for contacts with a place."] = ()
    loads: Annotated[tuple[Load, ...], "Constant forces."] = ()
    dampers: Annotated[
        tuple[AnyShape, ...],
        "Dampers by their shape; their bodies and contacts are among `bodies` and `contacts`.",
    ] = ()
    speed: Annotated[
        NonNegative | None,
        "Speed of rotation [1/min], by which bodies with a `radius_of_rotation` are loaded and on which "
        "gyroscopic terms and K_omega2 depend.",
    ] = None
    speed_order: Annotated[
        Positive | None,
        "The speed follows the frequency f along an engine-order line: speed = 60 f / speed_order [1/min]; "
        "in place of `speed`.",
    ] = None
    with_speed: Annotated[
        tuple[SpeedDependence, ...],
        "Normal loads and the amplitude of the excitation that follow the speed.",
    ] = ()
    couplings: Annotated[
        tuple[CouplingOfAnyKind, ...],
        "Entries of stiffness and damping that are no springs and dashpots: not symmetric, gyroscopic.",
    ] = ()
    aerodynamics: Annotated[
        tuple[Aerodynamics, ...],
        "Influence of the gas between blades, of a cyclic structure.",
    ] = ()
    recovery: Annotated[
        tuple[Recovered, ...],
        "Stresses, strains and other sums of DOFs that may be observed.",
    ] = ()
    materials: Annotated[tuple[Material, ...], "Strengths, for the margins of recovered stresses."] = ()

    def __repr__(self) -> str:
        """Say in a line what it is; `to_dict` has all of it."""
        names = ", ".join(contact.name for contact in self.contacts[:_FEW]) or "none"
        if len(self.contacts) > _FEW:
            names = f"{len(self.contacts)} of them"
        low, high = self.observe.band
        return (
            f"<Scene {self.name}: {self.structure.kind}, {len(self.dofs)} DOFs, contacts {names}, "
            f"{self.observe.dof} observed from {units.span(low, high, 'Hz')}>"
        )

    __str__ = __repr__

    def _repr_html_(self) -> str:
        """Return its numbers as a table, for notebooks: a row for each owner of parameter paths."""
        laws, rows = {contact.name: contact.LAW for contact in self.contacts}, dict[str, list[str]]()
        for path in scene_paths.parameter_paths(self):
            found = scene_paths.parameter_of(self, path)
            owner, _, key = path.rpartition(".")
            said = [f"law {laws[owner]}"] if owner in laws else []
            value = number(found.get(), digits=6)
            rows.setdefault(owner, said).append(" ".join((key, value, found.unit)).rstrip())
        pairs = tuple((owner, ", ".join(said)) for owner, said in rows.items())
        return html_of("Scene", [Summary(repr(self)[len("<Scene ") : -1], pairs)])

    @field_validator("excitation", mode="before")
    @classmethod
    def _one_or_many(cls, data: object) -> object:
        return [data] if isinstance(data, Mapping | Excitation) else data

    @field_validator("excitation")
    @classmethod
    def _at_least_one(cls, forces: tuple[Excitation, ...]) -> tuple[Excitation, ...]:
        if not forces:
            raise ValueError("`excitation` must have at least one force, got []")
        return forces

    @model_validator(mode="wrap")
    @classmethod
    def _report_everything(
        cls, data: Any, handler: ModelWrapValidatorHandler[Scene], info: ValidationInfo[Any]
    ) -> Scene:
        if isinstance(data, Scene):
            return data
        checked = info.context is _CHECKED
        raw = data if checked else plain(data)
        if not isinstance(raw, dict):
            raise SceneError.of((), f"a scene must be a table, got {type(raw).__name__}", named=False)
        raw = raw if checked else in_si(raw, raw)
        try:
            scene, issues = handler(raw), []
        except ValidationError as error:
            scene, issues = None, field_issues(error, raw)
        if not checked:
            issues += [*cross_issues(raw), *cyclic_issues(raw), *body_issues(raw), *term_issues(raw)]
        if scene is not None and not issues:
            issues += [
                Issue(("couplings", i, "K"), wanted)
                for i, each in enumerate(scene.couplings)
                if (wanted := each.misfit(scene.structure))
            ]
        if scene is None or issues:
            raise SceneError(issues)
        scene = scene if not scene.dampers else scene.model_copy(update=with_shapes(scene))
        return scene if scene.speed is None or not scene.with_speed else _at_its_speed(scene)

    @classmethod
    def from_dict(cls, obj: Mapping[str, object]) -> Scene:
        """Read a scene from tables and lists, as TOML or JSON gives them.

        Raises
        ------
        SceneError
            Lists everything that is wrong.
        """
        return cls.model_validate(obj)

    @classmethod
    def from_checked(cls, obj: Mapping[str, object]) -> Scene:
        """Read what `to_dict` of this version wrote: as `from_dict`, but not how its parts fit together.

        Raises
        ------
        SceneError
            A field that is missing, unknown or out of its range.
        """
        return cls.model_validate(obj, context=_CHECKED)

    def to_dict(self) -> dict[str, object]:
        """The scene as tables and lists for JSON; `from_dict` gives back an equal scene."""
        own = self.model_copy(update=own_parts(self)) if self.dampers else self
        empty = {key for key in _OPTIONAL if not getattr(own, key)}
        obj: dict[str, Any] = own.model_dump(mode="json", exclude_none=True, exclude=empty)
        if len(self.excitation) == 1:
            obj["excitation"] = obj["excitation"][0]
        return obj

    @property
    def dofs(self) -> tuple[str, ...]:
        """Names of all degrees of freedom: of the structure, then of the bodies, then points of terms."""
        own = tuple(self.structure.dofs)
        if not self.bodies and not self.couplings:
            return own
        return (*own, *(dof for body in self.bodies for dof in body.dofs), *self.points)

    @property
    def points(self) -> tuple[str, ...]:
        """The DOFs without inertia that couplings make."""
        return tuple(point for each in self.couplings for point in each.points)

    @property
    def forms(self) -> tuple[tuple[Form, ...], ...]:
        """The relative motions of every contact as sums of DOFs."""
        return tuple(
            tuple(map(kinematics.pair_form, contact.pairs))
            if contact.motions is None and contact.at is None
            else kinematics.forms_of(self, contact)
            for contact in self.contacts
        )

    @property
    def port_counts(self) -> tuple[int, ...]:
        """How many relative motions the force of every contact depends on."""
        return tuple(len(contact.end_keys) for contact in self.contacts)

    @property
    def constant_forces(self) -> tuple[Excitation, ...]:
        """The constant forces of loads and of rotation, each on a DOF; along a line those at 1 rad/s."""
        if not self.loads and self.speed is None and self.speed_order is None:
            return ()
        return kinematics.static_forces(self)

    @property
    def forces(self) -> tuple[Excitation, ...]:
        """The excitation, and the constant forces, each on a DOF."""
        return (*self.excitation, *self.constant_forces)

    @property
    def base_moves(self) -> bool:
        """Whether it is driven by a base that moves, not by forces alone."""
        return any(force.ground or force.driven for force in self.excitation)

    @property
    def level(self) -> float:
        """Value of ``excitation.amplitude``: the amplitude of the first force."""
        return self.excitation[0].amplitude

    @property
    def phase(self) -> float:
        """Value of ``excitation.phase``: that of the first force that is not static."""
        return next((force.phase for force in self.excitation if force.harmonic), 0.0)

    @property
    def rigid_contact(self) -> AnyContact | None:
        """The first contact with an infinite stiffness: such a scene is followed by events."""
        return next((contact for contact in self.contacts if contact.is_rigid), None)

    @property
    def entries(self) -> tuple[Entry, ...]:
        """Every entry that couplings and gas add to K and C."""
        every, sectors = (*self.couplings, *self.aerodynamics), self.structure.sector_count
        return tuple(entry for each in every for entry in each.entries(sectors))

    def seen(self, name: str) -> tuple[tuple[str, float], ...] | None:
        """The DOFs, each with its factor, that a DOF or a recovered quantity of that name is a sum of."""
        if name in self.dofs:
            return ((name, 1.0),)
        return next((each.terms for each in self.recovery if each.name == name), None)

    @property
    def measured(self) -> Measured:
        """What amplitudes, peaks and limits are of, with its name and unit."""
        seen = self.observe
        return Measured(dof=seen.dof, measure=seen.measure, harmonic=seen.harmonic, unit=self.observed_unit)

    @property
    def observed_unit(self) -> str:
        """Unit of the amplitudes: m, or that of the recovered quantity that is observed."""
        return next((each.unit for each in self.recovery if each.name == self.observe.dof), "m")

    @property
    def engine_order(self) -> int:
        """Engine order of the excitation; 0 for a lumped structure."""
        return next((e.engine_order for e in self.excitation if e.engine_order is not None), 0)

    def value(self, path: str) -> float:
        """Value of a parameter path, for example ``"shroud.N0"``; of a group, its first member's.

        Raises
        ------
        SettingError
            The path is unknown, or it has no value in this scene.
        """
        return scene_paths.value(self, path)

    def with_values(self, values: Mapping[str, float]) -> Scene:
        """A scene with other values on parameter paths, set in the given order.

        ``<contact>.N1`` unties the amplitude of the load from N0, ``<contact>.N1_ratio`` ties it again.
        A group sets all its members, ``excitation.amplitude`` scales every force by the factor that brings
        the first to the value, ``excitation.phase`` shifts every force alike.

        Raises
        ------
        SettingError
            The path is unknown or the value is out of its range.
        """
        return scene_paths.with_values(self, values)

    def without(self, names: Iterable[str]) -> Scene:
        """The scene without some contacts, their free limit: names, groups, dampers or patterns, ``patch-*``.

        With a damper goes its body, with the last contact of a body the body, and what is fixed to it.

        Raises
        ------
        SettingError
            No contact has such a name.
        """
        return scene_paths.without(self, names)

    def at_frequency(self, frequency_hz: float) -> Scene:
        """The scene at a frequency [Hz] of its engine-order line; itself where it is on none."""
        if self.speed_order is None:
            return self
        there: Scene = at_speed(self, 60.0 * frequency_hz / self.speed_order)
        return there

    def parameter_paths(self) -> tuple[str, ...]:
        """Every path `value` and `with_values` take (``frequency`` belongs to the run, not to the scene)."""
        return scene_paths.parameter_paths(self)

    def check_path(self, path: str) -> None:
        """Raise SettingError unless `path` is ``frequency`` or one of `parameter_paths`."""
        scene_paths.check_path(self, path)


def _at_its_speed(scene: Scene) -> Scene:
    """The scene with everything that follows the speed at its value there."""
    try:
        there: Scene = at_speed(scene, scene.speed or 0.0)
    except SettingError as error:
        raise SceneError([error.issue.at("with_speed")]) from error
    return there


def load_scene(name_or_path: object) -> Scene:
    """Load a shipped scene by name, or a scene file (.toml or .json) by path.

    Files of matrices that the scene names are read too, relative to its own folder.

    Raises
    ------
    SceneError
        No such scene, a file that cannot be read, or everything that is wrong with its content.
    """
    raw = with_factor_files(load_raw(name_or_path), scene_folder(name_or_path))
    if "tensors" in raw:
        from solver.scene.tensor_springs import with_tensors

        raw = with_tensors(raw, scene_folder(name_or_path))
    structure = raw.get("structure")
    if isinstance(structure, Mapping) and structure.get("kind") == "matrices":
        from solver.matrices.scene_files import with_files

        raw = with_files(raw, scene_folder(name_or_path))
    return Scene.from_dict(raw)


on_change(lambda: Scene.model_rebuild(force=True))
