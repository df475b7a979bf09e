"""Long measurements as separate commands: bench (other software), blind (hidden machines), faults (attacks); pictures and documents."""
