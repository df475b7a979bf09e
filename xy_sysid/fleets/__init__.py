"""Many machines, many months: one row for each axis of each recording, and what changes over time.

columns:   every column of the table: name, kind, unit, meaning
row:       one axis of a recording -> its row
naming:    which machine, axis and date a recording belongs to
of_file:   one file -> its rows
finding:   folders and patterns -> files
digest:    a file or folder -> the hash of its content
table:     the Parquet data set
journal:   rows that are not in the table yet; a killed run loses none
estimate:  the remaining time of a run
engine:    files -> rows, on the processes of a dask cluster
of_paths:  all of this in one call
"""
