"""Long measurements, commands of their own: bench (other software), blind (hidden machines), faults (attacks); pictures and documents."""
