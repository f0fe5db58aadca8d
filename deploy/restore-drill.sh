#!/bin/sh
# Does the backup bring everything back? A copy of the database is dumped, restored beside it, checked and dropped.
# PGHOST, PGUSER and PGPASSWORD say where, as for every program of PostgreSQL; the user must be able to create
# databases. Services may run meanwhile.
#   sh deploy/restore-drill.sh stickslip /var/backups/stickslip.dump
set -eu
database=${1:?name the database}
dump=${2:?name the file of the dump}
copy="${database}_restored"

pg_dump --format=custom --file="$dump.new" "$database"
mv "$dump.new" "$dump"
dropdb --if-exists "$copy"
createdb "$copy"
trap 'dropdb --if-exists "$copy"' EXIT
pg_restore --exit-on-error --no-owner --dbname="$copy" "$dump"
stickslip db check --database "postgresql:///$copy"
echo "$dump restores: $(wc -c < "$dump") bytes, checked."
