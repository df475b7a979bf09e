"""Files that are not recordings: models, settings, effects.

package_files:  location of the files that come with the package
linear_models:  a transfer function for other tools
models:         models of both kinds, saved and loaded
state:          the identifier's memory on disk
ros_parameters: parameter files of ROS, checked
effects:        users' own effects
provenance:     origin of an answer: versions, command, fingerprint of the data
"""
