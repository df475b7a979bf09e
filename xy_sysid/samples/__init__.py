"""Streams of samples: their pairing, order and storage.

block:        consecutive samples of one quantity, as in one message; a gap-free pair of both quantities
recording:    a full recording, checked and in SI
ring:         one stream, stored by its counter, for blocks in any order
pairing:      voltage and position, paired by that counter
reference:    the controller's reference for paired samples, by its stamps
joint_states: samples with a time stamp and no counter, numbered by ``stamp_counter``
joint_fields: the fields of a joint state that are used
integral:     velocity to position
newest:       the newest paired samples of a machine
rate:         the sampling rate from all stamps
moves:        whether a recording has only one move
"""
