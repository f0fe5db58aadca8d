"""Every command, as help lists them; a further one is a function and a line here."""

from __future__ import annotations

from service.cli.lazy import STUDY, Entries, Entry

DATABASE = (
    Entry("upgrade", "commands.service.upgrade", "Bring a database to this version's revision."),
    Entry("backup", "commands.database.backup", "Copy a database to a file, also while a service uses it."),
    Entry(
        "check", "commands.database.check", "Read a database from end to end and say what is wrong with it."
    ),
    Entry(
        "prune", "commands.database.prune", "Delete old jobs with their results and sweeps, and old uploads."
    ),
)  # fmt: skip

KEYS = (
    Entry("create", "commands.keys.create", "Make a key and print it, this once."),
    Entry(
        "list", "commands.keys.show",
        "List the keys, also those that work no more. What opens the door is not kept, and not shown.",
    ),
    Entry(
        "rotate", "commands.keys.rotate",
        "Give a key another secret and print it, this once; the old one ends within a second.",
    ),
    Entry("revoke", "commands.keys.revoke", "End a key, within a second in every service."),
)  # fmt: skip

RUNS = (
    Entry("list", "commands.client.runs.show", "List the runs, newest first.", keyed=True),
    Entry(
        "change", "commands.client.runs.change", "Change project, name, notes or tags of a run.", keyed=True
    ),
    Entry("delete", "commands.client.runs.delete", "Put a run in the bin.", keyed=True),
    Entry("restore", "commands.client.runs.restore", "Take a run out of the bin.", keyed=True),
    Entry("compare", "commands.client.runs.compare", "Say what differs between two runs.", keyed=True),
    Entry("share", "commands.client.runs.share", "Make a link to a run that needs no key.", keyed=True),
)

PROJECTS = (
    Entry("list", "commands.client.projects.show", "List the projects, newest first.", keyed=True),
    Entry("create", "commands.client.projects.create", "Make a project and print its id.", keyed=True),
    Entry("change", "commands.client.projects.change", "Change name or notes of a project.", keyed=True),
    Entry(
        "delete", "commands.client.projects.delete", "Put a project in the bin; its runs stay.", keyed=True
    ),
    Entry("restore", "commands.client.projects.restore", "Take a project out of the bin.", keyed=True),
)

COMMANDS = {
    "Compute": (
        Entry("plan", STUDY, "Say which effects a scene calls for, and why."),
        Entry("solve", STUDY, "Compute one periodic response, or look for all of them."),
        Entry("sweep", STUDY, "Follow the response over a parameter."),
        Entry("map", STUDY, "Map the response over frequency and a parameter, with the ridge of its peaks."),
        Entry("march", STUDY, "March in time until the motion repeats."),
        Entry("accuracy", STUDY, "Measure what accuracy costs."),
        Entry(
            "sensitivities", STUDY,
            "Say what matters: per cent of the peaks and the band for one per cent of each parameter.",
        ),
        Entry("peaks", STUDY, "Track the highest peak over a parameter."),
    ),
    "Design": (
        Entry("design", "commands.design.design", "Find the best damper."),
        Entry("pareto", "commands.design.pareto", "Find the front of peak against resonance band."),
        Entry(
            "identify", "commands.identify.identify",
            "Find parameters from measured responses and hysteresis loops.",
        ),
    ),
    "Disks and modes": (
        Entry("campbell", STUDY, "Find the speeds at which orders of the running speed meet resonances."),
        Entry(
            "interference", STUDY,
            "Draw natural frequencies over the nodal diameter, with the engine orders that meet them.",
        ),
        Entry("mistuning", STUDY, "Study disks whose blades are not quite equal."),
        Entry("modes", STUDY, "Follow a mode's frequency and damping over its amplitude."),
        Entry(
            "controlled", STUDY,
            "Follow the response over the frequency with one amplitude held, as rigs do.",
        ),
    ),
    "Scenes and files": (
        Entry("scenes", "commands.scenes.scenes", "List the shipped scenes."),
        Entry(
            "import", "commands.import_matrices.import_scene", "Make a scene of matrices or modes in files.",
        ),
        Entry(
            "schema", "commands.schema.schema",
            "Print the JSON Schema of scene files, design problems or jobs, for editors.",
        ),
        Entry(
            "report", "commands.report.report",
            "Write the report of a design or an identification that the service computed.",
        ),
        Entry("demo", "commands.service.demo", "Run the main job end to end, with pictures."),
    ),
    "Service": (
        Entry("serve", "commands.service.serve", "Serve the REST API and work off its queue."),
        Entry("worker", "commands.service.worker", "Work off a queue without HTTP."),
        Entry("submit", "submit_group.SubmitGroup", "Hand a job to a running service.", group=True),
        Entry("watch", "commands.client.jobs.watch", "Follow a job until it has ended.", keyed=True),
        Entry(
            "results", "commands.client.jobs.results",
            "Print what a job computed, or list the stored designs.", keyed=True,
        ),
        Entries("runs", "Name, find, compare and delete runs of a service.", RUNS),
        Entries("projects", "Gather runs in projects.", PROJECTS),
        Entries("db", "Look after the database.", DATABASE),
        Entries("keys", "Make and end keys to the service.", KEYS),
    ),
}  # fmt: skip

TOP = {entry.name: entry for entries in COMMANDS.values() for entry in entries}
