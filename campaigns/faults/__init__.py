"""The fault campaign: deliberate faults with fixed seeds; the outcomes are written to docs/faults.md.

attack:    one attack, its outcomes, and the run of a group of attacks
encoder:   an encoder that fails while the machine is driven
motion:    random settings and states: never outward beyond a limit
damage:    recordings with changed bytes
hostile:   malicious files, and single wrong messages
disk:      every writer on a full disk
endings:   Ctrl-C and SIGTERM at random moments of every long command; a killed recorder
strange:   meaningless signals, and effect files with errors
machine:   real nodes over DDS: killed, or with wrong transitions
door:      attacks on the page's server
tabs:      fifty tabs, stalled clients, restarts, with STOP
cable:     two hosts with a cable that loses packets, as network namespaces
network:   the nodes on two hosts: loss, a pulled cable, restarts, clocks
shared:    every recording of a real machine through every command that reads one
soak:      a day of data through all nodes, with their memory and descriptors
report:    docs/faults.md
"""
