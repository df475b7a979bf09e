"""Small models in time, for records that are too short or too special for a frequency response.

``first_order``: gain, time constant, delay and friction from step and ramp tests. ``servo``: a position-controlled joint with its controller.
Both are fitted by ``output_error``; ``as_words`` states the results, and what these data do not determine.
"""
