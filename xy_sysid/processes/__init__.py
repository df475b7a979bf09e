"""Nodes and workers as processes and threads of their own.

run_plan:      from a run file to the processes to start
starter:       starts, watches and stops them
fit_thread:    one thread that fits while another hears data
story_process: a process that performs jobs on stories
helper:        a process that does one thing while this one does another
terminal:      text from a file or the network, fit to be printed
"""
