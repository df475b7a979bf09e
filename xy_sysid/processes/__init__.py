"""Nodes and workers in separate processes and threads.

run_plan:      from a run file to the processes to start
starter:       starts, watches and stops them
fit_thread:    a thread that fits while another receives data
story_process: a process that performs jobs on stories
settle_process: a process that decides the steps towards a settled diagnosis
helper:        a process that works in parallel with this one
deaf:          processes that ignore Ctrl-C
memory:        freed memory stays with the process
terminal:      makes text from a file or the network safe to print
"""
