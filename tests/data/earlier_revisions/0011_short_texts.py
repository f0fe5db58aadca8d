"""Searches for one or two letters have an index too.

Revision 0011, after 0010. SQLite's index of triples of letters gets two characters more after each text,
which no text has, so that every letter begins a triple: a piece of one or two letters is the beginning of a
word of its vocabulary. It keeps no texts of its own (`content=''`), as those in the table of runs end without
them. PostgreSQL gets an index of the letters and pairs of letters of a text.
"""

from __future__ import annotations

from alembic import op

revision = "0011"
down_revision = "0010"
branch_labels = None
depends_on = None

_COLUMNS = "rowid, name, notes"


def upgrade() -> None:
    """To this revision."""
    if op.get_bind().dialect.name == "sqlite":
        _made_anew("content=''", end=" || char(31, 31)")
        op.execute("CREATE VIRTUAL TABLE run_text_letters USING fts5vocab(run_text, 'instance')")
        return
    op.execute("""
        CREATE FUNCTION letters_of(name text, notes text) RETURNS text[]
        LANGUAGE plpgsql IMMUTABLE PARALLEL SAFE COST 10000 AS $$
            DECLARE letters text[] := string_to_array(lower(name || chr(31) || notes), NULL);
            BEGIN
                RETURN letters || ARRAY(
                    SELECT one || coalesce(next, '') FROM unnest(letters, letters[2:]) AS pairs (one, next));
            END
        $$
    """)
    index = "CREATE INDEX ix_run_letters ON run USING gin (letters_of(name, notes))"
    op.execute(f"{index} WITH (fastupdate = off)")


def downgrade() -> None:
    """Back to the one before."""
    if op.get_bind().dialect.name == "sqlite":
        op.drop_table("run_text_letters")
        _made_anew("content='run', content_rowid='number'", end="")
        return
    op.execute("DROP INDEX ix_run_letters")
    op.execute("DROP FUNCTION letters_of")


def _made_anew(content: str, *, end: str) -> None:
    """SQLite's index of texts with the triggers that keep it, filled."""
    gone, new = (f"{row}.number, {row}.name{end}, {row}.notes{end}" for row in ("old", "new"))
    gone = f"INSERT INTO run_text (run_text, {_COLUMNS}) VALUES ('delete', {gone})"
    new = f"INSERT INTO run_text ({_COLUMNS}) VALUES ({new})"
    kept = (
        ("insert", "INSERT", (new,)),
        ("delete", "DELETE", (gone,)),
        ("update", "UPDATE OF name, notes", (gone, new)),
    )
    for name, _, _ in kept:
        op.execute(f"DROP TRIGGER run_text_{name}")
    op.drop_table("run_text")
    op.execute(f"CREATE VIRTUAL TABLE run_text USING fts5 (name, notes, {content}, tokenize='trigram')")
    op.execute(
        f"INSERT INTO run_text ({_COLUMNS}) SELECT number, name{end}, notes{end} FROM run ORDER BY number"
    )
    for name, when, does in kept:
        op.execute(f"CREATE TRIGGER run_text_{name} AFTER {when} ON run BEGIN {'; '.join(does)}; END")
