"""Reports: a recording on one self-contained HTML page.

axis_report:    everything that is known about one axis, from all upstream packages
axis_fits:      the response of one axis and three fits, with their tables (``tables``) and as JSON (``fits_document``)
words, captions, remarks, headline, story_words: the sentences
figures, signals, coupling, story_*: the figures, in the colours of ``theme``
parts, cover, sheet: pieces of a page, and the page around them
report_page:    the page; written: a report of a recording, as the command and notebooks request it
trend_page:     the trend of a fleet as one page
gallery, drawers: every figure of a story, drawn in other processes
figure_data, vector, paper: a figure as a table, as vectors, and in the size of a journal
plots, notebook, offline: single pictures, and results as a notebook shows them, also without a network
"""
