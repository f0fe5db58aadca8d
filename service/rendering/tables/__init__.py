"""The tables that the command and the report share."""
