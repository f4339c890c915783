"""Arrays on the device: the node sets, the pair lists between them, the clock."""
