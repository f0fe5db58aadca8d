"""What every result can do, named arrays, and their files."""
