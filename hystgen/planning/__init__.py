"""Planning: the drive records that a diagnosis needs."""
