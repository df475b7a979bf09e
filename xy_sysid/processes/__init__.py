"""Nodes and workers in separate processes and threads.

run_plan:      from a run file to the processes to start
starter:       starts, watches and stops them
fit_thread:    a thread that fits while another receives data
story_process: a process that performs jobs on stories
helper:        a process that works in parallel with this one
terminal:      makes text from a file or the network safe to print
"""
