"""The process that serves: its start and end, its memory."""
