"""The database: engine, tables, revisions, retention."""
