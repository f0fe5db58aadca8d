"""What people see of jobs: tables of words, pictures and the rows of the documentation."""
