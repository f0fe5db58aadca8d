"""From options and files to what is asked: the description of a design problem, scenes with their uploads."""

from __future__ import annotations

import functools
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from optim.criteria.key import Form, Option
from optim.problem.problem_keys import DesignKeys, FrontKeys, options
from service.cli import completion
from service.cli.completion import SCENE_FILES
from service.cli.failures import refused
from service.cli.options import inputs, parameters
from service.cli.options.inputs import whole_number
from service.cli.options.parameters import Command, keyword, parameters_of, with_parameters
from service.errors import InputError
from service.jobs.common.scene_requests import UPLOAD, Place, named_files, with_named
from solver.errors import Issue, SceneError, SettingError
from solver.jit.compiler_process import cost, prepare
from solver.scene.toml import TomlError, found_scene, read_toml

if TYPE_CHECKING:
    from service.client.client import Client
    from service.jobs.common.problem_requests import ProblemRequest
    from solver.scene.scene import Scene


FLAGS = "flags"
KEYS = dict.fromkeys((*DesignKeys.model_fields, *FrontKeys.model_fields))
OPTIONS = {
    "scene": "SCENE", "set": "--set",
    **{name: one.flag for model in (DesignKeys, FrontKeys) for name, one in options(model).items()},
}  # fmt: skip
"""Key to the option that stands for it."""

File = Annotated[
    str | None,
    typer.Option(
        "--problem", metavar="FILE",
        help=f"The problem in a file (.toml, .json), with the keys of the REST body: scene, set, "
        f"{', '.join(KEYS)}. An option beside it replaces the key it stands for.",
    ),
]  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class ProblemFlags:
    """What was given on the command line of a design problem, as it was written."""

    file: Annotated[str | None, "Of ``--problem``."] = None
    values: Annotated[list[str] | None, "Of ``--set``."] = None
    keys: Annotated[Mapping[str, tuple[Option, Any]], "Key to its option and what was given to it."] = field(
        default_factory=dict
    )


_OFFERED: dict[Form, Callable[..., list[str]]] = {
    Form.BOUNDS: completion.paths, Form.NUMBERS_BY_PATH: completion.settings,
    Form.WORDS_BY_PATH: completion.settings, Form.NAMES: completion.contacts,
}  # fmt: skip
_READ: dict[Form, tuple[Any, Callable[[str], Any] | None]] = {
    Form.NUMBER: (float, None), Form.WHOLE_NUMBER: (int, whole_number), Form.WORD: (str, None),
    Form.FLAG: (bool, None),
}  # fmt: skip


@functools.cache
def _option(one: Option) -> Any:
    """The option of a key, the same for every command."""
    type_, parser = _READ.get(one.form, (list[str], None))
    parser = inputs.number_in(one.help) if one.form is Form.NUMBER else parser
    offered = completion.words(*one.words) if one.words else _OFFERED.get(one.form)
    told = typer.Option(
        one.flag, metavar=one.metavar or None, parser=parser, help=one.help, autocompletion=offered
    )
    return Annotated[type_ | None, told]


def takes_problem(keys: Mapping[str, Option]) -> Callable[[Command], Command]:
    """Give a command the options of a design problem in place of its `flags`.

    `keys`: key to its option, of those that the problem has.
    """
    given_as: dict[str, Any] = {
        "problem": File, **{name: _option(one) for name, one in keys.items()}, "values": parameters.Values,
    }  # fmt: skip
    own = [keyword(name, annotation, None) for name, annotation in given_as.items()]

    def taking(command: Command) -> Command:
        @functools.wraps(command)
        def wrapped(**given: Any) -> None:
            file, values = given.pop("problem"), given.pop("values")
            flags = ProblemFlags(
                file=file, values=values, keys={name: (one, given.pop(name)) for name, one in keys.items()}
            )
            command(**given, **{FLAGS: flags})

        listed = [own if one.name == FLAGS else [one] for one in parameters_of(command)]
        return with_parameters(wrapped, chain.from_iterable(listed))

    return taking


@dataclass(frozen=True, slots=True, kw_only=True)
class Description:
    """A design problem as it was given."""

    body: Annotated[dict[str, Any], "The keys of the REST body, `scene` among them."]
    options: Annotated[Mapping[str, str], "Key to the option that gave it, for what is not the file's."]
    file: Annotated[Path | None, "Where the other keys come from."]

    def refusal(self, issues: Sequence[Issue]) -> InputError:
        """What is wrong, with the option or the key of the file that has to change."""
        return refused(issues, OPTIONS if self.file is None else self.options, self.file)

    @contextmanager
    def named(self) -> Iterator[None]:
        """Name options and keys in what is refused inside."""
        try:
            yield
        except SettingError as error:
            raise self.refusal([error.issue.at(*(error.place or error.issue.subject))]) from error


def description(scene: str | None, flags: ProblemFlags, kind: str, **further: tuple[str, Any]) -> Description:
    """Put the file and the options together.

    InputError if an option or the file cannot be read, or there is no scene.

    Parameters
    ----------
    scene : the argument of the command.
    flags : the options that all kinds of problem have.
    kind : of the problem; a file may say it too.
    further : key to the option that this command has besides, and its value.
    """
    file = None if flags.file is None else Path(flags.file)
    body = {} if file is None else _read(file, kind)
    given = _of_flags(flags) | ({} if scene is None else {"scene": scene})
    given |= {key: value for key, (_, value) in further.items() if value is not None}
    options = OPTIONS | {key: one.flag for key, (one, _) in flags.keys.items()}
    options |= {key: option for key, (option, _) in further.items()}
    body |= given
    if "scene" not in body:
        raise InputError("`SCENE` is missing: name a scene, or a --problem file with the key `scene`")
    return Description(body=body, options={key: options[key] for key in given}, file=file)


def posed(
    told: Description, study: type[ProblemRequest], without: Sequence[str] | None = None
) -> tuple[Scene, dict[str, Any]]:
    """The scene and the arguments of the design layer, checked as the service checks them.

    InputError, SceneError with what is wrong, by the option or the key that has to change.

    Parameters
    ----------
    told : what was given.
    study : its types and ranges, and what is wrong with a problem for a scene.
    without : contacts that are left out.
    """
    from service.jobs.common.problem_requests import arguments

    scene = _scene(told)
    with told.named():
        body = {
            key: value if key == "scene" else inputs.in_units(value, scene, (key,))
            for key, value in told.body.items()
        }
    request = checked(replace(told, body=body), study)
    scene = inputs.left_out(_with_values(told, scene, request), without)
    given = arguments(request)
    # Before kernels are loaded, which what is wrong with a problem is found by.
    prepare(lambda: cost(study.NAME, scene, given))
    if issues := request.issues(scene):
        raise told.refusal(issues)
    return scene, study.completed(scene, given)


def checked(told: Description, model: type[ProblemRequest]) -> ProblemRequest:
    """The description with types and ranges checked; whether it fits the scene is not.

    InputError with what is wrong.
    """
    from service.errors import InvalidRequestError
    from service.jobs.strict_json import validated

    try:
        # The scene is read by those who need it: here it may be a path, which the service does not take.
        return validated(model, {**told.body, "scene": {}})
    except InvalidRequestError as error:
        raise told.refusal(error.issues) from error


def body_to_submit(told: Description) -> dict[str, Any]:
    """The body for the service; a scene file goes with it, a name is looked up there."""
    reference = _reference(told)
    if isinstance(reference, str) and reference.endswith(SCENE_FILES):
        return {**told.body, "scene": scene_to_submit(reference)}
    return dict(told.body)


def _scene(told: Description) -> Scene:
    """A shipped scene, a scene file (one that the problem file names lies beside it), or the table itself."""
    import solver

    reference = _reference(told)
    try:
        if isinstance(reference, Mapping):
            return solver.Scene.from_dict(reference)
        return solver.load_scene(reference)
    except SceneError as error:
        if not isinstance(reference, Mapping):
            raise
        raise told.refusal([issue.below("scene") for issue in error.issues]) from error


def _reference(told: Description) -> Any:
    """The scene as it is named, a file of a problem file as a path from here."""
    reference = told.body["scene"]
    if isinstance(reference, str) and told.file is not None and "scene" not in told.options:
        return str(told.file.parent / reference) if reference.endswith(SCENE_FILES) else reference
    return str(found_scene(reference)) if isinstance(reference, str) else reference


def _with_values(told: Description, scene: Scene, request: ProblemRequest) -> Scene:
    """The scene with the values of the key `set`."""
    for path, value in request.set.items():
        try:
            scene = scene.with_values({path: value})
        except SettingError as error:
            raise told.refusal([error.issue.at("set", path)]) from error
    return scene


def _of_flags(flags: ProblemFlags) -> dict[str, Any]:
    """The keys the options stand for."""
    given = {name: _value(option, text) for name, (option, text) in flags.keys.items()}
    given["set"] = inputs.settings(flags.values) or None
    return {key: value for key, value in given.items() if value is not None}


def _ranges(option: str, texts: Sequence[str], example: str, unit: str | None) -> list[list[float]]:
    """The ranges of a repeatable option LO HI."""
    found = []
    for text in texts:
        words = text.split()
        if len(words) != 2:
            raise InputError(f"`{option}` takes LO HI, for example {example}, got {text!r}")
        found.append([inputs.part(option, text, word, unit) for word in words])
    return found


def _value(option: Option, given: Any) -> Any:
    """The value of a key, from its option as it was written; None if it was not given."""
    flag, example, unit = option.flag, option.example, inputs.unit_said(option.help)
    if given is None or given == []:
        return None
    if option.form is Form.BOUNDS:
        return inputs.bounds(flag, given)
    if option.form is Form.RANGES:
        return _ranges(flag, given, example, unit)
    if option.form is Form.NAMES:
        return dict.fromkeys(given, option.word)
    if option.form is Form.WORDS_BY_PATH:
        return inputs.by_name(flag, given, example, "NAME=VALUE", once=True)
    if option.form is Form.NUMBER_OR_TABLE and len(given) == 1 and "=" not in given[0]:
        return inputs.part(flag, given[0], given[0], unit)
    if option.form in (Form.NUMBERS_BY_PATH, Form.NUMBERS_BY_WORD, Form.NUMBER_OR_TABLE):
        words = inputs.by_name(flag, given, example, "NAME=VALUE", once=True)
        return inputs.numbers(flag, words, None if option.form is Form.NUMBERS_BY_PATH else unit)
    return given


def _read(file: Path, kind: str) -> dict[str, Any]:
    """The tables and lists of a problem file."""
    from service.errors import InvalidRequestError, MalformedBodyError
    from service.jobs import strict_json

    if file.suffix.lower() not in SCENE_FILES:
        raise InputError(f"`--problem` must end in {', '.join(SCENE_FILES)}, got {str(file)!r}")
    try:
        data = file.read_bytes()
        is_json = file.suffix.lower() == ".json"
        body: Any = strict_json.loads(data) if is_json else read_toml(data.decode("utf-8"))
    except OSError as error:
        raise InputError(f"`--problem`: {str(file)!r} cannot be read: {error.strerror}") from error
    except (UnicodeDecodeError, TomlError) as error:
        raise InputError(f"`--problem`: {str(file)!r} is not TOML: {error}") from error
    except (InvalidRequestError, MalformedBodyError) as error:
        raise InputError(f"`--problem`: {str(file)!r}: {error}") from error
    if not isinstance(body, dict):
        raise InputError(f"`--problem`: {str(file)!r} must hold one table, got {json.dumps(body)[:80]}")
    named = body.pop("kind", kind)
    if named != kind:
        raise InputError(f"{file}: /kind: must be {kind} here or be left out, got {named!r}")
    return body


_DECK = "inp"  # word of the format of a deck, which may have any ending


@dataclass(frozen=True, slots=True)
class SceneWithFiles:
    """The tables of a scene file, and the folder in which the files it names are."""

    tables: Mapping[str, Any]
    folder: Path


def scene_to_submit(path: str) -> dict[str, Any] | SceneWithFiles:
    """A scene file for the body of a request; one that names files of matrices waits for their upload.

    SceneError if it cannot be read, or is wrong and names no files.
    """
    import solver
    from solver.scene.toml import load_raw

    raw = load_raw(path)
    structure = raw.get("structure")
    named = (
        isinstance(structure, Mapping)
        and structure.get("kind") == "matrices"
        and bool(named_files(structure))
    )
    return SceneWithFiles(raw, Path(path).parent) if named else solver.load_scene(path).to_dict()


def uploaded(client: Client, body: Mapping[str, Any]) -> dict[str, Any]:
    """The body with its scene's files uploaded and referred to by their ids.

    InputError if a file cannot be read.
    """
    scene = body.get("scene")
    if not isinstance(scene, SceneWithFiles):
        return dict(body)
    structure = dict(scene.tables["structure"])
    known: dict[tuple[str, bool], str] = {}
    labels = _labels_beside(structure, scene.folder)
    if labels is not None:
        structure["mapping"] = str(labels)
    sent = {}
    for place, name in named_files(structure).items():
        if not name.startswith(UPLOAD):
            once = name, place[-1] == "nodes"
            known[once] = known.get(once) or _sent(client, scene.folder / name, place)
            sent[place] = known[once]
    return {**body, "scene": {**scene.tables, "structure": with_named(structure, sent)}}


def _labels_beside(structure: Mapping[str, Any], folder: Path) -> Path | None:
    """The file that names the rows, where DOFs are named by node and only its place says so."""
    from solver.matrices.load_set import labels_beside

    dofs = structure.get("dofs")
    by_node = isinstance(dofs, Mapping) and any(isinstance(row, str) for row in dofs.values())
    cyclic = structure.get("cyclic")
    by_node = by_node or (isinstance(cyclic, Mapping) and not {"low", "high", "nodes"}.isdisjoint(cyclic))
    if not by_node or "mapping" in structure:
        return None
    files = [folder / structure[key] for key in ("M", "K", "C") if isinstance(structure.get(key), str)]
    found = next(filter(None, map(labels_beside, files)), None)
    return None if found is None else found.absolute()


def _sent(client: Client, file: Path, place: Place) -> str:
    key = place[-1]
    try:
        data = file.read_bytes()
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"`{key}` of the scene: {str(file)!r} cannot be read: {reason}") from error
    form = _DECK if place == ("cyclic", "nodes") else None
    return UPLOAD + client.upload(data, f"{place[0]}{file.suffix}", form).id
