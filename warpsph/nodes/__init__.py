"""The two node sets and the pair lists between them."""
