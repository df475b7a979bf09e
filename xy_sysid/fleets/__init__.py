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
reference: the effects that are tried first: those of the same axis before
parts:     a long recording -> rows of its consecutive parts
history:   the table -> the series of each parameter
wander, alike: the wander of a parameter without a change; learned from similar machines
change, presence: whether a parameter has changed, or an effect is named more often
causes:    from simultaneous changes to the likely cause
trends, words: all changes of a table, and their sentences
commissioned, baseline, baseline_words: estimates of a running machine compared with those at commissioning
"""
