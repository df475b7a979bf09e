"""The fault campaign: what can go wrong is done on purpose, with fixed seeds, and what came of it is written to docs/faults.md.

attack:    one attack, what may come of it, and how a group of them runs
encoder:   an encoder that fails while the machine is driven
motion:    settings and states at random: never outward beyond a limit
damage:    recordings with changed bytes
hostile:   files made to harm, and single bad messages
disk:      every writer on a full disk
endings:   Ctrl-C and SIGTERM at any moment of every long command; a killed recorder
strange:   signals that mean nothing, and effect files with errors
machine:   real nodes over DDS: killed, doubled, deaf
door:      attacks on the page's server
tabs:      fifty tabs, a stalled one, restarts, STOP meanwhile
cable:     two hosts with a cable that loses packets, as network namespaces
network:   the nodes on two hosts: loss, a pulled cable, restarts, clocks
shared:    every recording of a real machine through every command that reads one
soak:      a day of data through all nodes, with memory and descriptors of each
report:    docs/faults.md
"""
