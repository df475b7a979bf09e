"""Reports: a recording on one self-contained HTML page.

axis_report:    everything that is known about one axis, from all upstream packages
axis_fits:      the response of one axis and three fits, with their tables (``tables``) and as JSON (``fits_document``)
words, captions, remarks, story_words: the sentences
figures, signals, story_*: the figures, in the colours of ``theme``
parts, sheet:   pieces of a page, and the page around them
report_page:    the page; written: a report of a recording, as the command and notebooks request it
plots, notebook: single pictures, and results as a notebook shows them
"""
