"""rosbag2 in and out: messages --> proof of layout --> blocks, and blocks --> a bag that survives its recorder."""

from xy_sysid.bags.reading import Bag, Topic
from xy_sysid.bags.streaming import POSITION, REFERENCE, VOLTAGE, stream_blocks
from xy_sysid.bags.writing import BagWriter

__all__ = ["POSITION", "REFERENCE", "VOLTAGE", "Bag", "BagWriter", "Topic", "stream_blocks"]
