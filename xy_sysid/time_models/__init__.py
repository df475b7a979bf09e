"""Small models in time, for records that are too short or too special for a frequency response.

``first_order``: gain, time constant, delay and friction of step and ramp tests. ``servo``: a position-controlled joint with its controller.
Both are fitted by ``output_error``; ``as_words`` says what they tell, and what these data cannot tell.
"""
