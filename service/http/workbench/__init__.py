"""The routes of the workbench: projects, runs, links that share a run."""
