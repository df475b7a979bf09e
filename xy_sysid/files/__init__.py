"""Files that are not recordings: models, settings, effects.

package_files:  location of the files that come with the package
linear_models:  a transfer function for other tools
models:         models of both kinds, saved and loaded
story_models:   models of stories
seal:           the checksum in a model file
state:          the identifier's memory on disk
ros_parameters: parameter files of ROS, checked
effects:        users' own effects
blame:          errors in a user's file are reported with its line
experiment, trajectories: designed experiments and motions
walk:           the folder of a series of experiments
fmu:            a functional mock-up unit as one file
unasked:        no file is replaced without --force
provenance:     origin of an answer: versions, command, fingerprint of the data
"""
