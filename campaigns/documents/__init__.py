"""Pages of docs/ and files of config/ that are generated from the source, so that they agree with it.

architecture: the picture of the packages; effects, machines, settings: their pages; search: the table of its numbers
fleet_columns: the table of columns; ros_parameters, viewer_layouts: files of config/
"""
