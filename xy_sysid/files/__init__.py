"""Files that are not recordings: models, settings, effects, layouts.

package_files:  where the files are that come with the package
linear_models:  a transfer function for other tools
models:         models of either kind, saved and loaded
state:          the identifier's memory on disk
ros_parameters: parameter files of ROS, checked and written
effects:        effects from outside
provenance:     where an answer comes from: versions, command, fingerprint of the data
viewer_layouts: layouts for PlotJuggler and Foxglove
"""
