"""rosbag2 in and out: messages --> proof of layout --> blocks, and blocks --> a bag that survives its recorder.

reading:                               a recording as a whole: its files, topics, messages
sqlite_file, pages:                    a .db3, by SQL or straight from its pages
mcap_file, compression, checksum:      an .mcap and its chunks
sums:                                  check sums for what has none of its own
opening:                               what is looked at before a file is opened
atomic:                                files that are written whole or not at all
cdr, stride:                           proof of layout, then arrays without deserializing each
streaming:                             blocks of voltage and position in log order
writing:                               a bag that is complete at any moment, and the definitions that it carries
sqlite_writer, mcap_writer:            its files
"""

from xy_sysid.bags.reading import Bag, Topic
from xy_sysid.bags.streaming import POSITION, REFERENCE, VOLTAGE, stream_blocks
from xy_sysid.bags.writing import BagWriter

__all__ = ["POSITION", "REFERENCE", "VOLTAGE", "Bag", "BagWriter", "Topic", "stream_blocks"]
