"""Every command, as help lists them; a further one is a function and a line here."""

from __future__ import annotations

from service.cli.lazy import STUDY, CommandEntry, CommandGroup

DATABASE = (
    CommandEntry("upgrade", "commands.service.upgrade", "Bring a database to this version's revision."),
    CommandEntry(
        "backup", "commands.service.backup", "Copy a database to a file, also while a service uses it."
    ),
    CommandEntry(
        "check", "commands.service.check", "Read a database from end to end and say what is wrong with it."
    ),
    CommandEntry(
        "prune", "commands.service.prune", "Delete old jobs with their results and sweeps, and old uploads."
    ),
)  # fmt: skip

KEYS = (
    CommandEntry("create", "commands.keys.create", "Make a key and print it, this once."),
    CommandEntry(
        "list", "commands.keys.show",
        "List the keys, also those that work no more. What opens the door is not kept, and not shown.",
    ),
    CommandEntry(
        "rotate", "commands.keys.rotate",
        "Give a key another secret and print it, this once; the old one ends within a second.",
    ),
    CommandEntry("revoke", "commands.keys.revoke", "End a key, within a second in every service."),
)  # fmt: skip

RUNS = (
    CommandEntry("list", "commands.client.runs.show", "List the runs, newest first.", keyed=True),
    CommandEntry(
        "change", "commands.client.runs.change", "Change project, name, notes or tags of a run.", keyed=True
    ),
    CommandEntry("delete", "commands.client.runs.delete", "Put a run in the bin.", keyed=True),
    CommandEntry("restore", "commands.client.runs.restore", "Take a run out of the bin.", keyed=True),
    CommandEntry("compare", "commands.client.runs.compare", "Say what differs between two runs.", keyed=True),
    CommandEntry(
        "share", "commands.client.runs.share", "Make a link to a run that needs no key.", keyed=True
    ),
)

PROJECTS = (
    CommandEntry("list", "commands.client.projects.show", "List the projects, newest first.", keyed=True),
    CommandEntry("create", "commands.client.projects.create", "Make a project and print its id.", keyed=True),
    CommandEntry(
        "change", "commands.client.projects.change", "Change name or notes of a project.", keyed=True
    ),
    CommandEntry(
        "delete", "commands.client.projects.delete", "Put a project in the bin; its runs stay.", keyed=True
    ),
    CommandEntry("restore", "commands.client.projects.restore", "Take a project out of the bin.", keyed=True),
)

COMMANDS = {
    "Compute": (
        CommandEntry("plan", STUDY, "Say which effects a scene calls for, and why."),
        CommandEntry("solve", STUDY, "Compute one periodic response, or look for all of them."),
        CommandEntry("sweep", STUDY, "Follow the response over a parameter."),
        CommandEntry(
            "map", STUDY, "Map the response over frequency and a parameter, with the ridge of its peaks."
        ),
        CommandEntry("march", STUDY, "March in time until the motion repeats."),
        CommandEntry("accuracy", STUDY, "Measure what accuracy costs."),
        CommandEntry(
            "sensitivities", STUDY,
            "Say what matters: per cent of the peaks and the band for one per cent of each parameter.",
        ),
        CommandEntry("peaks", STUDY, "Track the highest peak over a parameter."),
    ),
    "Design": (
        CommandEntry("design", "commands.design.design", "Find the best damper."),
        CommandEntry("pareto", "commands.design.pareto", "Find the front of peak against resonance band."),
        CommandEntry(
            "identify", "commands.identify.identify",
            "Find parameters from measured responses and hysteresis loops.",
        ),
    ),
    "Disks and modes": (
        CommandEntry(
            "campbell", STUDY, "Find the speeds at which orders of the running speed meet resonances."
        ),
        CommandEntry(
            "interference", STUDY,
            "Draw natural frequencies over the nodal diameter, with the engine orders that meet them.",
        ),
        CommandEntry("mistuning", STUDY, "Study disks whose blades are not quite equal."),
        CommandEntry("modes", STUDY, "Follow a mode's frequency and damping over its amplitude."),
        CommandEntry(
            "controlled", STUDY,
            "Follow the response over the frequency with one amplitude held, as rigs do.",
        ),
    ),
    "Scenes and files": (
        CommandEntry("scenes", "commands.scenes.scenes", "List the shipped scenes."),
        CommandEntry(
            "import", "commands.import_matrices.import_scene", "Make a scene of matrices or modes in files.",
        ),
        CommandEntry(
            "schema", "commands.scenes.schema",
            "Print the JSON Schema of scene files, design problems or jobs, for editors.",
        ),
        CommandEntry(
            "report", "commands.report.report",
            "Write the report of a design or an identification that the service computed.",
        ),
        CommandEntry("demo", "commands.service.demo", "Run the main job end to end, with pictures."),
    ),
    "Service": (
        CommandEntry("serve", "commands.service.serve", "Serve the REST API and work off its queue."),
        CommandEntry("worker", "commands.service.worker", "Work off a queue without HTTP."),
        CommandEntry(
            "submit", "commands.client.submit.SubmitGroup", "Hand a job to a running service.", group=True
        ),
        CommandEntry("watch", "commands.client.jobs.watch", "Follow a job until it has ended.", keyed=True),
        CommandEntry(
            "results", "commands.client.jobs.results",
            "Print what a job computed, or list the stored designs.", keyed=True,
        ),
        CommandGroup("runs", "Name, find, compare and delete runs of a service.", RUNS),
        CommandGroup("projects", "Gather runs in projects.", PROJECTS),
        CommandGroup("db", "Look after the database.", DATABASE),
        CommandGroup("keys", "Make and end keys to the service.", KEYS),
    ),
}  # fmt: skip

TOP = {entry.name: entry for entries in COMMANDS.values() for entry in entries}
