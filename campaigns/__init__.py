"""Long measurements, commands of their own: against other software (bench), on hidden machines (blind), under attack (faults), and the pictures."""
