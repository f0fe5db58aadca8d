"""Results in words, as named arrays, as files and as pictures."""
