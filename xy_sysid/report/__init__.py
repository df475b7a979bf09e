"""Reports: a recording on one self-contained HTML page.

axis_report:    what is known of one axis, from all that stands upstream
study:          the study of the paper, parameter by parameter, and what its tables say (``tables``)
words, captions, remarks, story_words: what is said
figures, signals, story_*: what is drawn, in the colours of ``theme``
parts, sheet:   pieces of a page, and the page around them
report_page, study_page: the two pages; written: a report of a recording, as command and notebook ask for it
plots, notebook: single pictures, and results as a notebook shows them
"""
