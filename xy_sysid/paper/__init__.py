"""The study of the paper, repeated on any recording: figures 2 to 7 and tables 1 and 2.

study:      the three fits of ``report.axis_fits``, and the shift of the pair between two parts or two recordings
pair:       figure 7, its caption, table and remarks
study_page: the page; document: the same as JSON
"""
