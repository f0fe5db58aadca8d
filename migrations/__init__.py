"""Alembic's migrations of the service's database; a package, so that an installed wheel carries them."""
